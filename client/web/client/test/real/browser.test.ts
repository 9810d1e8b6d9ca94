import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type Browser, chromium, type Page } from "playwright-core";
import { build } from "vite";
import { afterAll, beforeAll, expect, test } from "vitest";
import { openSession } from "../../src/index.js";
import type { Watched } from "./page/page.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

let files: string;
let service: Service;
let browser: Browser;

beforeAll(async () => {
  files = mkdtempSync(join(tmpdir(), "lpdeform-page-"));
  const root = join(import.meta.dirname, "page");
  await build({ root, base: "./", logLevel: "error", configFile: false, build: { outDir: files, target: "es2022" } });
  service = await Service.start({ files });
  browser = await chromium.launch({
    executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
    args: ["--no-sandbox"],
  });
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
    const isDone = () => views.every(({ newest }, k) => newest?.isFinal && newest.inputSeq >= seqs[k]!);
    while (!isDone()) await new Promise((again) => setTimeout(again, 5));
    for (const { newest } of views) {
      const z = newest!.positions[3 * 19 + 2]!;
      if (Math.abs(z - height) > 1e-4) throw new Error(`the edge is at ${z}, not at ${height}`);
    }
  }, height);
}

// A browser has six connections to an origin over plain HTTP/1.1, for all its tabs together.
test.each([4, 5])(
  "%i tabs in split view all update and acknowledge over plain HTTP",
  async (tabs) => {
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
  },
  120_000,
);

test.each([1, 2])(
  "a page of credit %i that is busy for five seconds then gets a fresh frame",
  async (credit) => {
    const { mesh, handles } = grid(100);
    const session = await openSession(mesh, { url: service.url, settings: { p: 2 } });
    session.setHandles(handles);
    const madeAt = new Map<number, number>();
    let tick = 0;
    const dragging = setInterval(() => {
      const height = 10 * Math.sin(++tick / 50);
      madeAt.set(session.move("right", { translation: [0, 0, height] }), Date.now());
    }, 10);
    const page = await browser.newPage();
    await page.goto(service.url);
    const { resumedAt, after } = await page.evaluate(
      async ({ name, credit }) => {
        const log = await window.watch(name, credit);
        const atLeast = async (count: number) => {
          while (log.length < count) await new Promise((again) => setTimeout(again, 5));
        };
        await atLeast(20);
        const taken = log.length;
        const until = Date.now() + 5000;
        while (Date.now() < until); // as a page that computes
        await atLeast(taken + 15);
        return { resumedAt: until, after: log.slice(taken) };
      },
      { name: session.name, credit },
    );
    clearInterval(dragging);
    // Fresh: it answers an update of the second half of the pause, or a later one. Frames that were held on the way are older.
    const isFresh = ({ inputSeq }: Watched) => (madeAt.get(inputSeq) ?? 0) > resumedAt - 2500;
    const first = after.findIndex(isFresh);
    expect(first).toBeGreaterThanOrEqual(0);
    expect(first).toBeLessThanOrEqual(credit);
    expect(after.slice(first).every(isFresh)).toBe(true);
    const { inputSeq, at } = after[first]!;
    console.log(
      `credit ${credit}: ${first} older frames, the newest ${at - resumedAt} ms after the pause, ` +
        `${at - madeAt.get(inputSeq)!} ms after its update`,
    );
    await page.close();
    await session.close();
  },
  60_000,
);

test("frames of many vertices are unpacked in a worker, those of few in the page", async () => {
  const page = await browser.newPage();
  await page.goto(service.url);
  await page.waitForFunction(() => window.views);
  const lift = (side: number, encoding: "quantized" | "compressed") =>
    page.evaluate(([side, encoding]) => window.lift(side, encoding), [side, encoding] as const);
  expect(await lift(20, "quantized")).toBeCloseTo(2, 3);
  expect(page.workers()).toHaveLength(0);
  expect(await lift(150, "quantized")).toBeCloseTo(2, 2);
  expect(await lift(150, "compressed")).toBeCloseTo(2, 2);
  expect(page.workers()).toHaveLength(1);
  await page.close();
  // A page that can have no worker gets the same.
  const bare = await browser.newPage();
  await bare.addInitScript(() => {
    window.Worker = class {
      constructor() {
        throw new DOMException("no workers here", "SecurityError");
      }
    } as unknown as typeof Worker;
  });
  await bare.goto(service.url);
  await bare.waitForFunction(() => window.views);
  const height = await bare.evaluate(() => window.lift(150, "compressed"));
  expect(height).toBeCloseTo(2, 2);
  await bare.close();
}, 120_000);

test("a page of another address is told what lets it in, and is let in by that", async () => {
  const context = await browser.newContext({ bypassCSP: true }); // pages that Envoy serves may call no other
  const page = await context.newPage();
  await page.goto(service.url);
  await page.waitForFunction(() => window.views);
  const tryAt = (url: string) => page.evaluate((url) => window.tryAt(url), url);
  const [strict, open] = await Promise.all([Service.start({}), Service.start({ origins: [service.url] })]);
  try {
    const refused = await tryAt(strict.url);
    expect(refused).toMatchObject({ code: "permission_denied", reason: "ORIGIN_NOT_ALLOWED", element: service.url });
    expect(refused!.message).toContain(`"deploy/up --origin ${service.url}"`);
    expect(await tryAt(open.url)).toBeUndefined();
    // Nobody there, or nobody behind it, is another matter.
    await strict.killEnvoy();
    expect(await tryAt(strict.url)).toMatchObject({ code: "unavailable", message: "The server cannot be reached." });
    await open.killServer();
    expect(await tryAt(open.url)).toMatchObject({ code: "unavailable" });
  } finally {
    await context.close();
    await Promise.all([strict.stop(), open.stop()]);
  }
}, 60_000);
