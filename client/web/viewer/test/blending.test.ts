import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { LpdeformError } from "lpdeform-client";
import { Blend, mostSoon } from "../src/app/blend.js";
import type { App } from "../src/app/app.js";
import { firstFacts } from "../src/app/facts.js";
import { shapesOf } from "../src/link/prepare.js";
import { say } from "../src/link/status.js";
import { blendPs, type Shape } from "../src/model/blend.js";
import { addHandle, type Document, emptyDocument } from "../src/model/document.js";
import { History } from "../src/model/history.js";
import { State } from "../src/model/state.js";
import { firstView } from "../src/model/view.js";

// When shapes are prepared for the blend through p. Each solve ends when a test says so.

vi.mock("../src/link/prepare.js", () => ({ shapesOf: vi.fn() }));

const shape = (p: number): Shape => ({ positions: new Float32Array(9).fill(p), distortion: new Float32Array(3) });
const idle = () => vi.advanceTimersByTimeAsync(1500);
const meshOf = (vertices: number) => ({
  name: "",
  positions: Float32Array.from({ length: 3 * vertices }, (_, k) => k % 7),
  faces: Uint32Array.from([0, 1, 2]),
});

/** The p of each session, and whether it was ended. */
let sessions: { ps: number[]; isOver: boolean }[];
/** Ends a solve. */
let solve: () => Promise<void>;
let page: EventTarget & { visibilityState: string };
let app: ReturnType<typeof fakeApp>;
let blend: Blend;

function fakeApp(vertices: number) {
  const mesh = meshOf(vertices);
  const history = new History<Document>(addHandle(emptyDocument, [0], mesh.positions));
  const facts = new State({ ...firstFacts, mesh, document: history.present, status: say("live", "Live") });
  const during = (document: Document) => (history.during(document), facts.set({ document }));
  return {
    view: new State(firstView),
    facts,
    history,
    onCancel: new Set<() => boolean>(),
    panes: [{ live: { isSettling: false }, frame: { isFinal: true } }],
    get mesh() {
      return facts.now.mesh;
    },
    get document() {
      return history.present;
    },
    during,
    change: (document: Document) => (history.push(document), facts.set({ document })),
    preview: vi.fn<(shown: Shape) => void>(),
    endPreview: vi.fn(),
  };
}

const movedHandles = ({ handles }: Document) => handles.map((handle) => ({ ...handle }));

function open(vertices: number): void {
  app = fakeApp(vertices);
  blend = new Blend(app as unknown as App);
}

beforeEach(() => {
  vi.useFakeTimers();
  page = Object.assign(new EventTarget(), { visibilityState: "visible" });
  vi.stubGlobal("document", page);
  sessions = [];
  vi.mocked(shapesOf).mockImplementation(async function* (_mesh, documents, _weld, signal) {
    const session = { ps: documents.map(({ p }) => p), isOver: false };
    sessions.push(session);
    try {
      for (const { p } of documents) {
        await new Promise<void>((done, failed) => {
          solve = async () => void (done(), await vi.advanceTimersByTimeAsync(0));
          signal.addEventListener("abort", () => failed(new Error("ended")));
        });
        yield shape(p);
      }
    } finally {
      session.isOver = true;
    }
  });
});

afterEach(() => vi.unstubAllGlobals());

it("a small mesh's shapes are prepared without a press, once nothing is done, and a slider shows them without a change of p", async () => {
  open(mostSoon);
  await vi.advanceTimersByTimeAsync(1400);
  expect(sessions).toEqual([]);
  await idle();
  for (const _ of blendPs) await solve();
  expect(sessions).toEqual([{ ps: blendPs, isOver: true }]);
  expect(blend.facts.now).toMatchObject({ waitsLong: false, ready: blendPs.length, fault: "" });
  const { p } = app.document;
  expect(blend.show(6)).toMatchObject({ low: 6, high: 6 });
  expect(app.preview.mock.lastCall![0].positions[0]).toBe(6);
  expect(app.document.p).toBe(p);
  await idle();
  expect(sessions).toHaveLength(1);
});

it("a large mesh's shapes are prepared once nothing is done for long, or sooner when the slider is used", async () => {
  open(mostSoon + 1);
  await idle();
  await idle();
  expect(blend.facts.now.waitsLong).toBe(true);
  expect(sessions).toEqual([]);
  expect(blend.show(3)).toBeUndefined();
  await idle();
  expect(sessions).toHaveLength(1);
  await solve();
  expect(blend.facts.now.ready).toBe(1);
  app.change({ ...app.document, handles: movedHandles(app.document) });
  await vi.advanceTimersByTimeAsync(19_900);
  expect(sessions).toHaveLength(1);
  expect(blend.facts.now).toMatchObject({ waitsLong: true, ready: 0 });
  await idle();
  expect(sessions).toHaveLength(2);
  expect(blend.facts.now.waitsLong).toBe(false);
  for (const _ of blendPs) await solve();
  expect(blend.facts.now).toMatchObject({ waitsLong: false, ready: blendPs.length });
});

it("a drag ends the session at once, and none begins before it is over and solved", async () => {
  open(100);
  await idle();
  await solve();
  app.during({ ...app.document, handles: movedHandles(app.document) });
  await vi.advanceTimersByTimeAsync(0);
  expect(sessions[0]!.isOver).toBe(true);
  expect(blend.facts.now.ready).toBe(0);
  await idle(); // the handle is held still
  await idle();
  app.history.end();
  app.panes[0]!.frame.isFinal = false;
  await idle();
  expect(sessions).toHaveLength(1);
  app.panes[0]!.frame.isFinal = true;
  await idle();
  expect(sessions[1]!.ps).toEqual(blendPs);
});

it("another p ends the session and drops no shape: the next session begins with the last that is ready", async () => {
  open(100);
  await idle();
  for (let k = 0; k < 3; ++k) await solve();
  app.change({ ...app.document, p: 4 });
  await vi.advanceTimersByTimeAsync(0);
  expect(sessions[0]!.isOver).toBe(true);
  expect(blend.facts.now.ready).toBe(3);
  await idle();
  expect(sessions[1]!.ps).toEqual(blendPs.slice(2));
  await solve();
  expect(blend.facts.now.ready).toBe(3);
  await solve();
  expect(blend.facts.now.ready).toBe(4);
});

it("a page that is hidden, and another mesh, end the session", async () => {
  open(100);
  await idle();
  page.visibilityState = "hidden";
  page.dispatchEvent(new Event("visibilitychange"));
  await idle();
  expect(sessions).toEqual([{ ps: blendPs, isOver: true }]);
  page.visibilityState = "visible";
  page.dispatchEvent(new Event("visibilitychange"));
  await idle();
  expect(sessions).toHaveLength(2);
  app.facts.set({ mesh: meshOf(50) });
  await vi.advanceTimersByTimeAsync(0);
  expect(sessions[1]!.isOver).toBe(true);
});

it("a server that has no room is asked again when the slider is used, and not before", async () => {
  open(100);
  vi.mocked(shapesOf).mockImplementationOnce(() => {
    throw new LpdeformError(
      "resource_exhausted",
      "The server has all of its 1 sessions in use; try again after the time given.",
    );
  });
  await idle();
  expect(blend.facts.now.fault).toBe("The server has no room for it now.");
  app.change({ ...app.document, p: 4 });
  await idle();
  await idle();
  expect(sessions).toEqual([]);
  blend.show(2);
  await idle();
  expect(sessions).toHaveLength(1);
  expect(blend.facts.now.fault).toBe("");
});

it("a press that is cancelled shows nothing any more and changes nothing; the next one does", async () => {
  open(100);
  await idle();
  for (const _ of blendPs) await solve();
  const cancel = () => [...app.onCancel].map((one) => one());
  const { document: before } = app;
  blend.begin();
  blend.show(8);
  expect(cancel()).toEqual([true]);
  expect(app.endPreview).toHaveBeenLastCalledWith(false);
  expect(cancel()).toEqual([false]);
  app.preview.mockClear();
  expect(blend.show(6)).toBeUndefined(); // the pointer goes on
  expect(app.preview).not.toHaveBeenCalled();
  blend.release();
  expect(app.document).toBe(before);
  blend.begin();
  blend.show(6);
  blend.release();
  expect(app.document.p).toBe(6);
});

it("p that becomes automatic, another p and another mesh end the press", async () => {
  open(100);
  const held = [
    () => app.change({ ...app.document, isAutomatic: true }),
    () => app.change({ ...app.document, isAutomatic: false, p: 4 }),
    () => app.facts.set({ mesh: meshOf(50) }),
  ];
  for (const change of held) {
    blend.begin();
    blend.show(8);
    change();
    const { document: before } = app;
    expect(blend.show(7)).toBeUndefined();
    expect(blend.facts.now.held).toBeUndefined();
    blend.release();
    expect(app.document).toBe(before);
  }
});

it("none are prepared while poses are exported, and what is prepared then ends", async () => {
  open(100);
  await idle();
  app.facts.set({ isFilming: true });
  await idle();
  await idle();
  expect(sessions).toEqual([{ ps: blendPs, isOver: true }]);
  app.facts.set({ isFilming: false });
  await idle();
  expect(sessions).toHaveLength(2);
});

it("while the server is away, nothing is prepared, no time is told and no timer runs; it goes on when the server is back", async () => {
  open(100);
  await idle();
  await solve();
  expect(blend.facts.now.secondsLeft).toBeDefined();
  app.facts.set({ status: say("away", "The server is away") });
  await vi.advanceTimersByTimeAsync(0);
  expect(sessions[0]!.isOver).toBe(true);
  expect(blend.facts.now).toMatchObject({ ready: 1, secondsLeft: undefined });
  await idle();
  expect(vi.getTimerCount()).toBe(0);
  app.facts.set({ status: say("live", "Live") });
  await idle();
  expect(sessions[1]!.ps).toEqual(blendPs);
});
