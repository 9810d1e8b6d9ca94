// The program of npm run figures. It measures how soon the page says that the server is away, the frames of a drag of 10,000, 40,000
// and 100,000 vertices, and how long a shape takes to settle. SECONDS is the length of each drag (default 8). No figure makes it fail.
import { mkdtempSync, rmSync } from "node:fs";
import { loadavg, tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { afterAll, beforeAll, it } from "vitest";
import { percentile } from "lpdeform-client/mesh/statistics";
import { Service } from "../../../client/test/support/service.js";
import { type MeterFacts, launch } from "../real/user.js";
import { args, BarePage, stir } from "../real/bare_page.js";
import { ringObj, ringVertex } from "../support/ring.js";

const seconds = Number(process.env["SECONDS"] ?? 8);
const files = process.env["FILES"] ?? join(import.meta.dirname, "../../dist"); // or another build of the page
const folder = mkdtempSync(join(tmpdir(), "lpdeform-figures-"));
const banners = ["| what happens | at rest | during a drag |", "|:--|--:|--:|"];
const drags = [
  "| vertices | frames / pictures a second | input to picture, p50 / p99 | of it server | link | page | settled after | load |",
  "|--:|--:|--:|--:|--:|--:|--:|--:|",
];

afterAll(() => {
  rmSync(folder, { recursive: true, force: true });
  console.log(
    [
      "How soon the page says so, in ms:",
      ...banners,
      "",
      "Live drags, in ms (medians where nothing else is said). Link: a call that Envoy answers by itself. Server: from sending to the",
      "whole frame, without that. Page: the rest, with waiting for the picture before, which the processor draws.",
      ...drags,
    ].join("\n"),
  );
});

async function opened(service: Service, query: string) {
  const browser = await chromium.launch({ ...launch, args });
  const page = await BarePage.open(browser, `${service.url}/?${query}`);
  await page.settled();
  return { browser, page };
}

const longestMs = 20_000;

const isSaid = `[...document.querySelectorAll(".banner")].some((one) => one.checkVisibility() && one.textContent.trim() !== "")`;

const troubles: Record<string, (service: Service) => Promise<void> | void> = {
  "the server is killed": (service) => service.killServer(),
  "the server is stopped (SIGSTOP)": (service) => service.pause("server"),
  "Envoy is stopped (SIGSTOP)": (service) => service.pause("envoy"),
};

it.each(Object.entries(troubles))(
  "%s",
  async (what, trouble) => {
    const times: string[] = [];
    for (const isDragging of [false, true]) {
      const service = await Service.start({ files });
      const { browser, page } = await opened(service, "shape=bar&detail=coarse");
      const at = await page.ask<{ x: number; y: number }>("vertexOnPage(window.__lpdeform.document().handles[1].vertices[0])");
      await page.mouse("mouseMoved", at.x, at.y);
      if (isDragging) await page.mouse("mousePressed", at.x, at.y);
      await trouble(service);
      const begin = performance.now();
      const passed = () => performance.now() - begin;
      let isThere = false;
      for (let k = 0; !isThere && passed() < longestMs; ++k) {
        if (isDragging) await page.mouse("mouseMoved", at.x + 60 * Math.sin(k / 20), at.y + 5, true);
        else await new Promise((again) => setTimeout(again, 10));
        isThere = await page.evaluate<boolean>(isSaid);
      }
      times.push(isThere ? passed().toFixed(0) : `not within ${longestMs}`);
      for (const part of ["server", "envoy"] as const) if (what.includes("SIGSTOP")) service.resume(part);
      await browser.close();
      await service.stop();
    }
    banners.push(`| ${what} | ${times.join(" | ")} |`);
  },
  120_000,
);

let service: Service;
beforeAll(async () => {
  service = await Service.start({ files });
});
afterAll(() => service.stop());

it.each([
  [146, 69],
  [291, 138],
  [460, 218],
])(
  "a drag of %d times %d vertices",
  async (around, across) => {
    const { browser, page } = await opened(service, "shape=sheet&detail=coarse");
    await page.openFile(join(folder, "ring.obj"), ringObj(around, across));
    await page.until(`window.__lpdeform.app.mesh.name === "ring.obj" && window.__lpdeform.status() === "live"`);
    const onPage = (turn: number) =>
      page.ask<{ x: number; y: number }>(`vertexOnPage(${ringVertex(around, across, turn, 0.2)})`);
    for (const turn of [0.62, 0.88]) await page.click(await onPage(turn));
    await page.settled();
    const pings = await page.evaluate<number[]>(`(async () => {
      const times = [];
      for (let k = 0; k < 30; ++k) {
        const begin = performance.now();
        await (await fetch("/healthz")).text();
        times.push(performance.now() - begin);
        await new Promise((again) => setTimeout(again, 33));
      }
      return times;
    })()`);
    await page.evaluate(`window.__pictures = 0; window.__lpdeform.app.afterDrawing.add(() => void ++window.__pictures)`);
    const at = await onPage(0.88);
    await page.mouse("mouseMoved", at.x, at.y);
    await page.mouse("mousePressed", at.x, at.y);
    const begin = performance.now();
    const framesBefore = await page.evaluate<number>(frameCount);
    await stir(page, at, seconds);
    const passed = (performance.now() - begin) / 1000;
    const meter = await page.ask<MeterFacts>("meter()");
    const pictures = await page.evaluate<number>("window.__pictures");
    const frames = (await page.evaluate<number>(frameCount)) - framesBefore;
    await page.mouse("mouseMoved", at.x + 60, at.y + 30, true);
    const last = performance.now();
    await page.mouse("mouseReleased", at.x + 60, at.y + 30);
    await page.settled(20);
    const settled = performance.now() - last;
    const link = percentile(pings, 0.5);
    const cells = [
      (around * across).toLocaleString("en"),
      `${(frames / passed).toFixed(1)} / ${(pictures / passed).toFixed(1)}`,
      `${meter.p50.toFixed(0)} / ${meter.p99.toFixed(0)}`,
      (meter.service50 - link).toFixed(0),
      link.toFixed(1),
      (meter.p50 - meter.service50).toFixed(0),
      settled.toFixed(0),
      loadavg()[0]!.toFixed(1),
    ];
    drags.push(`| ${cells.join(" | ")} |`);
    await browser.close();
  },
  (10 * seconds + 600) * 1000,
);

const frameCount = "window.__lpdeform.app.panes[0].frame?.frameSeq ?? 0";
