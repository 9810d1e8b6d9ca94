// Scripted dragging in a bare page of Chromium with two sessions: npm run soak -- SECONDS (default 600). Prints what page,
// browser, server and Envoy hold, and fails where it grows. The viewer has one of its own.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { build } from "vite";
import { BarePage } from "../test/support/bare_page.js";
import { Memory } from "../test/support/memory.js";
import type {} from "../test/real/page/page.js";
import { root, Service } from "../test/support/service.js";

const seconds = Number(process.argv[2] ?? 600);
const samples = 20;

const files = mkdtempSync(join(tmpdir(), "lpdeform-soak-"));
const page = join(root, "client/web/client/test/real/page");
await build({
  root: page,
  base: "./",
  logLevel: "error",
  configFile: false,
  build: { outDir: files, target: "es2022" },
});
const service = await Service.start({ files });
const tab = await BarePage.open(service.url);
await tab.until("window.views");
const memory = new Memory(service);

/** Runs in the page. */
async function drag(milliseconds: number): Promise<{ updates: number; frames: number }> {
  const views = window.views!;
  let updates = 0;
  const end = performance.now() + milliseconds;
  while (performance.now() < end) {
    for (const view of views) view.move(5 * Math.sin(++updates / 40));
    await new Promise((next) => setTimeout(next, 16));
  }
  return { updates, frames: views.reduce((sum, view) => sum + view.frames, 0) };
}

console.log("seconds  updates  frames  page MiB  browser MiB  server MiB  Envoy MiB");
for (let sample = 1; sample <= samples; ++sample) {
  const { updates, frames } = await tab.evaluate<Awaited<ReturnType<typeof drag>>>(
    `(${drag})(${(1000 * seconds) / samples})`,
  );
  const cells = [
    ((seconds * sample) / samples).toFixed(0),
    updates,
    frames,
    ...Memory.row(memory.add(await tab.held())),
  ];
  console.log(cells.map((cell, k) => String(cell).padStart([7, 7, 6, 8, 11, 10, 9][k]!)).join("  "));
}
await tab.close();
await service.stop();
rmSync(files, { recursive: true, force: true });

for (const { text, isFlat } of memory.verdicts()) {
  console.log(text);
  if (!isFlat) process.exitCode = 1;
}
process.exit();
