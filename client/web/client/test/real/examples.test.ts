import { execFile } from "node:child_process";
import { readFile, rm, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { promisify } from "node:util";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Service } from "../support/service.js";

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

async function run(example: string): Promise<string> {
  const program = join(import.meta.dirname, "../../examples", `${example}.ts`);
  return (await promisify(execFile)(process.execPath, [program, service.url])).stdout;
}

test.each(["../../../README.md", "../../README.md"])("the code in %s does what it says", async (path) => {
  const readme = await readFile(join(import.meta.dirname, path), "utf8");
  const block = /^```ts\n(.*?)^```$/ms.exec(readme)![1]!;
  const name = "quick_start.tmp";
  const file = join(import.meta.dirname, "../../examples", `${name}.ts`);
  const strip = `
    const vertices = new Float32Array(Array.from({ length: 22 }, (_, i) => [Math.floor(i / 2), i % 2, 0]).flat());
    const faces = Array.from({ length: 60 }, (_, k) => 2 * Math.floor(k / 6) + [0, 2, 3, 0, 3, 1][k % 6]!);
    const base = [0, 1], tip = [20, 21];
  `;
  const end = "\nconsole.log(frame.positions[3 * 20 + 2]);\nawait session.close();\n";
  await writeFile(file, strip + block.replace('"http://localhost:8080"', "process.argv[2]!") + end);
  try {
    expect(await run(name)).toBe("1\n");
  } finally {
    await rm(file);
  }
});

test("first.ts lifts the middle to where it was told to", async () => {
  expect(await run("first")).toBe("5 vertices, the middle at height 1\n");
});

test("drag.ts ends where the pointer did", async () => {
  expect(await run("drag")).toBe("the end is at height 2.000\n");
});

test("solve.ts comes with its proof", async () => {
  const [how, gap, search] = (await run("solve")).split("\n");
  expect(how).toMatch(/^converged after \d+ iterations of \w+$/);
  expect(Number(/within (\S+) %/.exec(gap!)![1])).toBeLessThan(1);
  expect(search).toMatch(/^looked for lower minima from 0 further starts; minima were seen at E = [\d.]+$/);
});

test("steps.ts takes a step back and does it again in the session that is restored", async () => {
  expect(await run("steps")).toBe("the middle is at height 1\nand at height 2 again\n");
});

test("errors.ts names what is wrong", async () => {
  expect((await run("errors")).split("\n")).toEqual([
    "MESH_INDEX_OUT_OF_RANGE face 0: 0 <= index < 3",
    "HANDLE_VERTEX_OUT_OF_RANGE vertex 9",
    "NOT_THE_WRITER",
    "SESSION_CLOSED",
    "",
  ]);
});
