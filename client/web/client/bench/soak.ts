// Scripted dragging in a page of Chromium with two sessions: npm run soak -- SECONDS (default 600). Prints what page, server and
// Envoy hold, and fails where it grows.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { build } from "vite";
import type {} from "../test/real/page/page.js";
import { root, Service } from "../test/real/service.js";

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
const browser = await chromium.launch({
  executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
  args: ["--no-sandbox"],
});
const tab = await browser.newPage();
await tab.goto(service.url);
await tab.waitForFunction(() => window.views);
const tools = await tab.context().newCDPSession(tab);

/** MiB that are held, by whom. */
async function held(): Promise<Record<"page" | "server" | "envoy", number>> {
  await tools.send("HeapProfiler.collectGarbage");
  const { usedSize, backingStorageSize = 0 } = (await tools.send("Runtime.getHeapUsage")) as {
    usedSize: number;
    backingStorageSize?: number;
  };
  const mebibytes = (bytes: number) => bytes / 2 ** 20;
  return {
    page: mebibytes(usedSize + backingStorageSize),
    server: mebibytes(service.residentBytes("server")),
    envoy: mebibytes(service.residentBytes("envoy")),
  };
}

const rows: Awaited<ReturnType<typeof held>>[] = [];
console.log("seconds  updates  frames  page MiB  server MiB  Envoy MiB");
for (let sample = 1; sample <= samples; ++sample) {
  const { updates, frames } = await tab.evaluate(
    async (milliseconds) => {
      const views = window.views!;
      let updates = 0;
      const end = performance.now() + milliseconds;
      while (performance.now() < end) {
        for (const view of views) view.move(5 * Math.sin(++updates / 40));
        await new Promise((next) => setTimeout(next, 16));
      }
      return { updates, frames: views.reduce((sum, view) => sum + view.frames, 0) };
    },
    (1000 * seconds) / samples,
  );
  const row = await held();
  rows.push(row);
  const cells = [
    ((seconds * sample) / samples).toFixed(0),
    updates,
    frames,
    row.page.toFixed(1),
    row.server.toFixed(1),
    row.envoy.toFixed(1),
  ];
  console.log(cells.map((cell, k) => String(cell).padStart([7, 7, 6, 8, 10, 9][k]!)).join("  "));
}
await browser.close();
await service.stop();
rmSync(files, { recursive: true, force: true });

// The first quarter warms caches and pools; from then on nothing may grow by a tenth and 2 MiB.
for (const who of ["page", "server", "envoy"] as const) {
  const mean = (part: typeof rows) => part.reduce((sum, row) => sum + row[who], 0) / part.length;
  const [before, after] = [mean(rows.slice(samples / 4, samples / 2)), mean(rows.slice(-samples / 4))];
  const isFlat = after <= 1.1 * before + 2;
  console.log(`${who}: ${before.toFixed(1)} MiB, then ${after.toFixed(1)} MiB${isFlat ? "" : ": it grows"}`);
  if (!isFlat) process.exitCode = 1;
}
process.exit();
