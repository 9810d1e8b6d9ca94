import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type Browser, chromium, type Page } from "playwright-core";
import { build } from "vite";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Service } from "./service.js";
import type {} from "./page/page.js";

const tabs = 4;
let files: string;
let service: Service;
let browser: Browser;

beforeAll(async () => {
  files = mkdtempSync(join(tmpdir(), "lpdeform-page-"));
  const root = join(import.meta.dirname, "page");
  await build({ root, base: "./", logLevel: "error", configFile: false, build: { outDir: files, target: "es2022" } });
  service = await Service.start({ files });
  browser = await chromium.launch({ executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
}, 120_000);

afterAll(async () => {
  await browser?.close();
  await service?.stop();
  rmSync(files, { recursive: true, force: true });
});

/** Moves both views and waits until both show where they were moved to, with everything on the way acknowledged. */
async function follows(page: Page, height: number): Promise<void> {
  await page.evaluate(async (height) => {
    const views = window.views!;
    const seqs = views.map((view) => view.move(height));
    const isDone = () => views.every(({ newest }, k) => newest?.converged && newest.inputSeq >= seqs[k]!);
    while (!isDone()) await new Promise((again) => setTimeout(again, 5));
    for (const { newest } of views) {
      const z = newest!.positions[3 * 19 + 2]!;
      if (Math.abs(z - height) > 1e-4) throw new Error(`the edge is at ${z}, not at ${height}`);
    }
  }, height);
}

// A browser has six connections to an origin over plain HTTP/1.1, for all its tabs together.
test("four tabs in split view all update and acknowledge over plain HTTP", async () => {
  const context = await browser.newContext();
  const pages = await Promise.all(Array.from({ length: tabs }, () => context.newPage()));
  await Promise.all(pages.map((page) => page.goto(service.url)));
  await Promise.all(pages.map((page) => page.waitForFunction(() => window.views)));
  for (let round = 1; round <= 10; ++round) await Promise.all(pages.map((page) => follows(page, round)));
  // More frames than credit: without acknowledgements they would have stopped at two.
  for (const page of pages) {
    const frames = await page.evaluate(() => window.views!.map((view) => view.frames));
    for (const count of frames) expect(count).toBeGreaterThanOrEqual(10);
  }
  expect(await service.stat("http.web.downstream_cx_http1_total")).toBeGreaterThan(0);
  expect(await service.stat("http.web.downstream_cx_active")).toBeLessThanOrEqual(6);
  await context.close();
}, 120_000);
