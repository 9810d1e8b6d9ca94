import { execFile } from "node:child_process";
import { join } from "node:path";
import { promisify } from "node:util";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Service } from "./service.js";

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

async function run(example: string): Promise<string> {
  const program = join(import.meta.dirname, "../../examples", `${example}.ts`);
  return (await promisify(execFile)(process.execPath, [program, service.url])).stdout;
}

test("first.ts lifts the middle to where it was told to", async () => {
  expect(await run("first")).toBe("5 vertices, the middle at height 1\n");
});

test("drag.ts ends where the pointer did", async () => {
  expect(await run("drag")).toBe("the end is at height 2.000\n");
});

test("solve.ts comes with its proof", async () => {
  const [how, gap] = (await run("solve")).split("\n");
  expect(how).toMatch(/^converged after \d+ iterations of \w+$/);
  expect(Number(/within (\S+) %/.exec(gap!)![1])).toBeLessThan(1);
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
