// Somebody who drags on in the viewer: npm run soak, for SECONDS (default 600). Prints what page, browser, server and Envoy hold,
// and fails where it grows.
import { join } from "node:path";
import { expect, it } from "vitest";
import { Memory } from "../../../client/test/real/memory.js";
import { Service } from "../../../client/test/real/service.js";
import { User } from "../real/user.js";

const seconds = Number(process.env["SECONDS"] ?? 600);
const samples = 20;

it(
  `holds no more and no less after ${seconds} s of dragging`,
  async () => {
    const service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
    const user = await User.open(service.url);
    await user.settled();
    const memory = await Memory.of(user.page, service);
    console.log("seconds  drags  inputs  page MiB  browser MiB  server MiB  Envoy MiB");
    const begin = performance.now();
    let [drags, inputs] = [0, 0];
    for (let sample = 1; sample <= samples; ++sample) {
      const end = begin + (1000 * seconds * sample) / samples;
      do inputs += await round(user, drags++);
      while (performance.now() < end);
      await user.settled();
      const passed = ((performance.now() - begin) / 1000).toFixed(0);
      const cells = [passed, drags, inputs, ...Memory.row(await memory.sample())];
      console.log(cells.map((cell, k) => String(cell).padStart([7, 5, 6, 8, 11, 10, 9][k]!)).join("  "));
    }
    expect(user.errors).toEqual([]);
    await user.close();
    await service.stop();
    const verdicts = memory.verdicts();
    console.log(verdicts.map(({ text }) => text).join("\n"));
    expect(verdicts.filter(({ isFlat }) => !isFlat)).toEqual([]);
  },
  3000 * seconds + 120_000,
);

/** A drag there and back, and now and then another p, two pictures, another step back. The number of moves. */
async function round(user: User, count: number): Promise<number> {
  const { mouse, keyboard } = user.page;
  if (count % 4 === 1) {
    await keyboard.press("s");
    await user.until("window.__lpdeform.app.panes.every(({ frame }) => frame)");
  }
  const vertex = await user.ask<number>("document().handles.at(-1).vertices[40]");
  const { x, y } = await user.vertexOnPage(vertex);
  await mouse.move(x, y);
  await mouse.down();
  const moves = 40;
  for (let move = 1; move <= moves; ++move) {
    const turn = (2 * Math.PI * move) / moves;
    await mouse.move(x - 60 * Math.sin(turn), y - 50 * (1 - Math.cos(turn)));
    await new Promise((again) => setTimeout(again, 16));
  }
  await mouse.up();
  if (count % 4 === 2) await keyboard.press("s");
  if (count % 4 === 3) for (const key of [".", ".", "Control+z", "Control+z"]) await keyboard.press(key);
  return moves;
}
