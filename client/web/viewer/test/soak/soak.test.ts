// Somebody who drags on in the viewer: npm run soak, for SECONDS (default 600). Prints what page, browser, server and Envoy hold,
// and fails where it grows.
import { join } from "node:path";
import { expect, it } from "vitest";
import { BarePage } from "../../../client/test/support/bare_page.js";
import { Memory } from "../../../client/test/support/memory.js";
import { Service } from "../../../client/test/support/service.js";
import { launch } from "../real/user.js";

const seconds = Number(process.env["SECONDS"] ?? 600);
const samples = 20;

it(
  `holds no more and no less after ${seconds} s of dragging`,
  async () => {
    const service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
    const page = await BarePage.open(service.url, launch.args);
    await page.settled();
    const memory = new Memory(service);
    console.log("seconds  drags  inputs  page MiB  browser MiB  server MiB  Envoy MiB");
    const begin = performance.now();
    let [drags, inputs] = [0, 0];
    for (let sample = 1; sample <= samples; ++sample) {
      const end = begin + (1000 * seconds * sample) / samples;
      // Samples are taken where the same is open: one picture, all steps taken.
      do inputs += await round(page, drags++);
      while (performance.now() < end || drags % 4 !== 0);
      await page.settled();
      const passed = ((performance.now() - begin) / 1000).toFixed(0);
      const cells = [passed, drags, inputs, ...Memory.row(memory.add(await page.held()))];
      console.log(cells.map((cell, k) => String(cell).padStart([7, 5, 6, 8, 11, 10, 9][k]!)).join("  "));
    }
    await page.close();
    await service.stop();
    expect(page.errors).toEqual([]);
    const verdicts = memory.verdicts();
    console.log(verdicts.map(({ text }) => text).join("\n"));
    expect(verdicts.filter(({ isFlat }) => !isFlat)).toEqual([]);
  },
  3000 * seconds + 120_000,
);

/** A drag there and back, and now and then another p, two pictures, another step back. The number of moves. */
async function round(page: BarePage, count: number): Promise<number> {
  if (count % 4 === 1) {
    await page.press("s");
    await page.until("window.__lpdeform.app.panes.every(({ frame }) => frame)");
  }
  const vertex = await page.ask<number>("document().handles.at(-1).vertices[40]");
  const { x, y } = await page.ask<{ x: number; y: number }>(`vertexOnPage(${vertex}, 0)`);
  await page.mouse("mouseMoved", x, y, false);
  await page.mouse("mousePressed", x, y, true);
  const moves = 40;
  for (let move = 1; move <= moves; ++move) {
    const turn = (2 * Math.PI * move) / moves;
    await page.mouse("mouseMoved", x - 60 * Math.sin(turn), y - 50 * (1 - Math.cos(turn)), true);
    await new Promise((again) => setTimeout(again, 16));
  }
  await page.mouse("mouseReleased", x, y, true);
  if (count % 4 === 2) await page.press("s");
  if (count % 4 === 3) {
    await page.press(".");
    await page.press(".");
    await page.press("z", true);
    await page.press("z", true);
  }
  return moves;
}
