// Live drags of 10,000 vertices, as the page itself measures them: npm run drag. Measures, does not judge.
import { join } from "node:path";
import { loadavg } from "node:os";
import { afterAll, beforeAll, it } from "vitest";
import { Service } from "../../../client/test/real/service.js";
import { type MeterFacts, User } from "../real/user.js";

const seconds = Number(process.env["SECONDS"] ?? 12);
const rows: string[] = [];
let service: Service;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(async () => {
  await service.stop();
  console.log(
    [
      "shape     encoding    vertices  inputs  frames/s  kB/s  input to picture p50  p99 ms  of it service p50  p99 ms",
      ...rows,
    ].join("\n"),
  );
});

it.each([
  ["bar", "float32"],
  ["bar", "quantized"],
  ["bar", "compressed"],
] as const)("%s, %s", async (shape, encoding) => {
  const user = await User.open(`${service.url}/?shape=${shape}&detail=fine&encoding=${encoding}`);
  try {
    await user.settled();
    await user.page.waitForTimeout(3000); // the gap is asked for meanwhile
    const vertex = await user.ask<number>("document().handles.at(-1).vertices[0]");
    const { x, y } = await user.vertexOnPage(vertex);
    const { mouse } = user.page;
    await mouse.move(x, y);
    await mouse.down();
    const begin = performance.now();
    let middle: MeterFacts | undefined;
    for (let now = 0; now < 1000 * seconds; now = performance.now() - begin) {
      await mouse.move(x + 110 * Math.sin(now / 900), y + 40 * (1 - Math.cos(now / 700)));
      await new Promise((again) => setTimeout(again, 16));
      if (!middle && now > 500 * seconds) middle = await user.ask<MeterFacts>("meter()");
    }
    const all = await user.ask<MeterFacts>("meter()");
    await mouse.up();
    const vertices = await user.ask<number>("app.mesh.positions.length / 3");
    const cells = [
      [shape, -8],
      [encoding, -10],
      [vertices, 8],
      [all.inputs, 6],
      [middle!.framesPerSecond, 8],
      [(middle!.bytesPerSecond / 1000).toFixed(0), 4],
      [all.p50.toFixed(0), 20],
      [all.p99.toFixed(0), 6],
      [all.service50.toFixed(0), 17],
      [all.service99.toFixed(0), 6],
    ] as const;
    rows.push(
      cells.map(([text, width]) => (width < 0 ? String(text).padEnd(-width) : String(text).padStart(width))).join("  "),
    );
    rows.push(`    load of the machine: ${loadavg()[0]!.toFixed(1)}`);
  } finally {
    await user.close();
  }
});
