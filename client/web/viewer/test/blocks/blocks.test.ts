// How long the viewer keeps the page's main thread busy without a break, at 100,000 vertices and more: npm run blocks.
// SECONDS (default 8) of each drag; FILES: the folder of another build of the page; PROFILE: says what the longest tasks did, "all" with
// functions, which makes them longer, or "events". FAR: the server computes only when the page and the browser do not, as if it was on
// another machine. Measures, does not judge.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { percentile } from "lpdeform-client/mesh/statistics";
import { chromium, type Browser } from "playwright-core";
import { launch } from "../real/user.js";
import { make3mf, makeDae, makeFbx, tubeOf } from "../made_foreign.js";
import { ringObj, ringVertex } from "../support/ring.js";
import { args, BarePage, stir } from "../real/bare_page.js";
import { tasksByMark, type Task, Trace } from "./trace.js";

const seconds = Number(process.env["SECONDS"] ?? 8);
const [around, across] = [460, 218]; // 100,280 vertices
const [largeAround, largeAcross] = [620, 280]; // 173,600 vertices
const blocks = ["what", "steps", "computed: median", "p95", "longest", "by the clock: median", "p95", "longest"].map(String);
const profile = process.env["PROFILE"] as "all" | "events" | undefined;
const table: string[][] = [blocks];
const notes: string[] = [];
const folder = mkdtempSync(join(tmpdir(), "lpdeform-blocks-"));
let service: Service;

beforeAll(async () => {
  const files = process.env["FILES"] ?? join(import.meta.dirname, "../../dist");
  service = await Service.start({ files, isLow: process.env["FAR"] !== undefined });
});

afterAll(async () => {
  await service.stop();
  rmSync(folder, { recursive: true, force: true });
  const widths = blocks.map((_, column) => Math.max(...table.map((row) => row[column]!.length)));
  const lines = table.map((row) => row.map((cell, k) => (k ? cell.padStart(widths[k]!) : cell.padEnd(widths[k]!))).join("  "));
  console.log(
    [
      "The longest task of the main thread in each step, in ms: by what the thread computed in it, and by the clock, which goes on while",
      "the thread waits for the GPU's process, where the processor draws here, and while other programs have the processor.",
      ...lines,
      "",
      ...notes,
    ].join("\n"),
  );
});

/** `steps`: the tasks of each. */
function note(what: string, steps: readonly (readonly Task[])[]): void {
  const longest = (key: "wall" | "cpu") => steps.map((tasks) => Math.max(...tasks.map((task) => task[key])));
  const cells = (numbers: number[]) => [0.5, 0.95, 1].map((share) => percentile(numbers, share).toFixed(1));
  table.push([what, String(steps.length), ...cells(longest("cpu")), ...cells(longest("wall"))]);
}

function sayLongest(what: string, tasks: readonly Task[], trace: Trace): void {
  if (!profile) return;
  for (const task of [...tasks].sort((a, b) => b.cpu - a.cpu).slice(0, 5)) {
    console.log([`${what}: ${task.wall.toFixed(1)} ms, computed ${task.cpu.toFixed(1)}`, ...trace.what(task)].join("\n"));
  }
}

/** The GPU's process takes what it is told to draw, and draws nothing. */
const drawsNothing = "--disable-gl-drawing-for-tests";

const bare = (browser: Browser) => BarePage.open(browser, `${service.url}/?shape=sheet&detail=coarse`);

async function opened(text: string, ...flags: string[]): Promise<{ browser: Browser; page: BarePage }> {
  const browser = await chromium.launch({ ...launch, args: [...args, ...flags] });
  const page = await bare(browser);
  await page.settled();
  await page.openFile(join(folder, "ring.obj"), text);
  await page.until(`window.__lpdeform.app.mesh.name === "ring.obj" && window.__lpdeform.status() === "live"`);
  return { browser, page };
}

const vertexOnPage = (page: BarePage, turn: number, roll: number, [one, other] = [around, across]) =>
  page.ask<{ x: number; y: number }>(`vertexOnPage(${ringVertex(one, other, turn, roll)})`);

it.each([
  ["a drag", around, across, true] as const,
  ["a drag where nothing is drawn", 146, 69, false] as const,
  ["a drag where nothing is drawn", 291, 138, false] as const,
  ["a drag where nothing is drawn", around, across, false] as const,
])(
  "%s, %d x %d vertices",
  async (title, one, other, isDrawn) => {
    const { browser, page } = await opened(ringObj(one, other), ...(isDrawn ? [] : [drawsNothing]));
    const place = (turn: number) => vertexOnPage(page, turn, 0.2, [one, other]);
    for (const turn of [0.62, 0.88]) await page.click(await place(turn));
    await page.settled();
    await page.evaluate(`(${watchDrag.toString()})()`);
    const at = await place(0.88);
    const trace = await Trace.start(browser, profile);
    await page.mouse("mouseMoved", at.x, at.y);
    await page.mouse("mousePressed", at.x, at.y);
    await stir(page, at, seconds, !isDrawn);
    const { tasks, marks } = await trace.stop("frame-taken");
    const pictures = trace
      .marks("picture-drawn")
      .filter((drawn) => !tasks.some((task) => has(task, drawn) && marks.some((taken) => has(task, taken))));
    const watched = await page.evaluate<{ gaps: number[]; corrections: number[]; pictures: number; seconds: number }>(
      "window.__drag",
    );
    await page.mouse("mouseReleased", at.x, at.y);
    await browser.close();
    const name = `${title}, ${(one * other).toLocaleString("en")} vertices`;
    note(`${name}: a frame`, tasksByMark(tasks, marks, "before"));
    note(
      `${name}: a picture between`,
      pictures.map((drawn) => tasks.filter((task) => has(task, drawn))),
    );
    sayLongest(name, tasks, trace);
    const [gaps, corrections] = [watched.gaps, watched.corrections].map((all) =>
      [0.5, 0.95, 1].map((share) => percentile(all, share).toFixed(1)).join(" / "),
    );
    const rate = (count: number) => (count / watched.seconds).toFixed(1);
    notes.push(
      `${name}: ${rate(marks.length)} frames and ${rate(watched.pictures)} pictures a second; between handle and surface ${gaps} pixels, ` +
        `median / p95 / most. A frame puts the vertex that it moves most ${corrections} pixels from where it was drawn ahead.`,
    );
  },
  (10 * seconds + 120) * 1000,
);

const has = ({ begin, end }: Task, at: number) => begin <= at && at <= end;

/**
 * Marks each frame that is taken and each picture that is drawn. Measures in each picture how far the surface is from where the handle
 * is, and with each frame how far it moves the surface that was drawn ahead.
 */
function watchDrag(): void {
  const { app, pointOnPage } = (window as any).__lpdeform;
  const [pane] = app.panes;
  const take = pane.takeFrame.bind(pane);
  const sampled = Array.from({ length: 50 }, (_, k) => Math.floor((k * app.mesh.positions.length) / 150));
  const sample = () => sampled.map((vertex) => pane.stage.surface.placeOf(vertex).toArray());
  let expected: number[][] | undefined;
  pane.takeFrame = () => {
    pane.lookAhead(app.document, true);
    const before = sample();
    const isNew = take();
    if (isNew) performance.mark("frame-taken");
    expected = isNew ? before : undefined;
    return isNew;
  };
  const drag = { gaps: [] as number[], corrections: [] as number[], pictures: 0, seconds: 0 };
  Object.assign(window, { __drag: drag });
  let begin: number | undefined;
  app.afterDrawing.add((now: number) => {
    performance.mark("picture-drawn");
    const { vertices, pose } = app.document.handles.at(-1);
    if (pose.translation.every((value: number) => value === 0)) return;
    begin ??= now;
    drag.seconds = (now - begin) / 1000;
    ++drag.pictures;
    const [vertex] = vertices;
    const rest = app.mesh.positions.slice(3 * vertex, 3 * vertex + 3);
    const jump = expected && [expected, sample()];
    const places = [[0, 1, 2].map((axis) => rest[axis] + pose.translation[axis]), pane.stage.surface.placeOf(vertex).toArray()];
    // In a task of its own, because it is not the page's.
    setTimeout(() => {
      const gap = ([from, to]: number[][]) => {
        const [one, other] = [pointOnPage(from), pointOnPage(to)];
        return Math.hypot(one.x - other.x, one.y - other.y);
      };
      drag.gaps.push(gap(places));
      if (jump) drag.corrections.push(Math.max(...jump[0]!.map((from, k) => gap([from, jump[1]![k]!]))));
    });
  });
}

it(
  "a brush's stroke",
  async () => {
    const { browser, page } = await opened(ringObj(around, across));
    await page.click(await vertexOnPage(page, 0.62, 0.2));
    await page.evaluate(`addEventListener("pointermove", () => performance.mark("brush-step"), { capture: true })`);
    for (const tool of ["brush", "paint"]) {
      await page.ask(`app.view.set({ tool: "${tool}", radius: 0.05 })`);
      await page.settled();
      const at = await vertexOnPage(page, 0.8, 0.2);
      await page.mouse("mouseMoved", at.x, at.y);
      const trace = await Trace.start(browser, profile);
      await page.mouse("mousePressed", at.x, at.y);
      await stir(page, at, seconds);
      const { tasks, marks } = await trace.stop("brush-step");
      await page.mouse("mouseReleased", at.x, at.y);
      note(`${tool}: a step of a stroke`, tasksByMark(tasks, marks, "after"));
      sayLongest(tool, tasks, trace);
    }
    await browser.close();
  },
  (10 * seconds + 120) * 1000,
);

const obj = (one: number, other: number) => ["OBJ", one * other, () => ringObj(one, other)] as const;
const tube = () => tubeOf(across - 1, around);

it.each([
  obj(around, across),
  obj(largeAround, largeAcross),
  ["FBX", around * across, () => makeFbx(tube())] as const,
  ["DAE", around * across, () => makeDae(tube())] as const,
  ["3MF", around * across, () => make3mf(0, tube())] as const,
])(
  "opening a file: %s, %d vertices",
  async (kind, count, make) => {
    const content = make();
    const ending = kind.toLowerCase();
    const openings: Task[][] = [];
    const waits: number[] = [];
    for (let time = 0; time < 3; ++time) {
      const browser = await chromium.launch({ ...launch, args });
      const page = await bare(browser);
      await page.settled();
      await page.evaluate(
        `document.querySelector("#app").addEventListener("click", () => performance.mark("opening"), { capture: true })`,
      );
      const trace = await Trace.start(browser, profile);
      const begin = performance.now();
      await page.openFile(join(folder, `ring.${ending}`), content);
      await page.until(`window.__lpdeform.app.mesh.name.startsWith("ring.")`);
      waits.push(performance.now() - begin);
      await page.until(`window.__lpdeform.status() === "live"`);
      await new Promise((again) => setTimeout(again, 1500)); // what the page keeps for later
      const { tasks } = await trace.stop("opening");
      openings.push(tasks);
      sayLongest("opening", tasks, trace);
      await browser.close();
    }
    const name = `opening ${count.toLocaleString("en")} vertices, ${kind}`;
    note(name, openings);
    notes.push(`${name}: the mesh is there after ${percentile(waits, 0.5).toFixed(0)} ms.`);
  },
  300_000,
);
