import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import { runLoad } from "../../bench/load.js";
import { root, Service } from "../support/service.js";

let service: Service;
const work = mkdtempSync(join(tmpdir(), "lpdeform-load-"));
beforeAll(async () => {
  service = await Service.start();
}, 60_000);
afterAll(async () => {
  await service.stop();
  rmSync(work, { recursive: true });
});

/** The keys of an object and of those in it; what stands for a number or a list ends there. */
function keysOf(value: unknown, path = ""): string[] {
  if (typeof value !== "object" || value === null || Array.isArray(value)) return [path];
  return Object.entries(value).flatMap(([key, inner]) => keysOf(inner, `${path}/${key}`));
}

test("every update is answered through Envoy, and the report is that of lpdeform load", async () => {
  const report = await runLoad({ url: service.url, sessions: 4, vertices: [100, 400], rate: 10, seconds: 2, p: 2 });
  expect(report.all.updates).toEqual({ due: 80, answered: 80, unanswered: 0 });
  expect([report.all.errors, report.all.reconnects]).toEqual([{}, 0]);
  expect(report.all.input_to_frame_histogram_us.reduce((sum, [, count]) => sum + count, 0)).toBe(80);
  const frames = Object.entries(report.by_vertices).map(
    ([vertices, tally]) => 16 * Number(vertices) * tally.frames.received,
  );
  expect(report.all.payload_bytes).toBe(frames.reduce((sum, bytes) => sum + bytes));

  const file = join(work, "native.json");
  const flags = ["--sessions", "4", "--vertices", "100,400", "--rate", "10", "--seconds", "1", "--report", file];
  execFileSync(join(root, "build/release/bin/lpdeform"), ["load", "--server", service.serverAddress, ...flags]);
  expect(keysOf(report).sort()).toEqual(keysOf(JSON.parse(readFileSync(file, "utf8"))).sort());
}, 60_000);

test("slow readers and changed connections leave no update without an answer", async () => {
  const usual = { url: service.url, sessions: 4, vertices: [100], rate: 10, seconds: 3, p: 2 };
  const before = await service.stat("cluster.lpdeform.upstream_rq_total");
  const { all, slow_readers } = await runLoad({ ...usual, slowReaders: 2, slowPause: 0.2, reconnect: 1 });
  expect(slow_readers).toBe(2);
  expect(all.updates).toEqual({ due: 120, answered: 120, unanswered: 0 });
  expect(all.errors).toEqual({});
  expect(all.reconnects).toBeGreaterThanOrEqual(4);
  expect((await service.stat("cluster.lpdeform.upstream_rq_total")) - before).toBeGreaterThan(120);
}, 60_000);

test("a server that dies under load and comes back is counted, and no update stays without an answer", async () => {
  const calls = () => service.stat("cluster.lpdeform.upstream_rq_total");
  const before = await calls();
  const running = runLoad({ url: service.url, sessions: 4, vertices: [100], rate: 10, seconds: 4, p: 2 });
  while ((await calls()) < before + 100) await new Promise((again) => setTimeout(again, 20)); // half of it, or less
  await service.killServer();
  await service.startServer();
  const { all } = await running;
  expect(all.reconnects).toBeGreaterThanOrEqual(4);
  expect(all.updates).toEqual({ due: 160, answered: 160, unanswered: 0 });
  expect(all.errors).toEqual({});
}, 60_000);
