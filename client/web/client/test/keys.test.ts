import { describe, expect, test } from "vitest";
import { joinWith, openWith, restoreWith, type Session } from "../src/session.js";
import type { OpenOptions, Update } from "../src/types.js";
import { FakeServer, triangle } from "./fake_server.js";
import { begin } from "./harness.js";

/** As scripts without types call it. */
const untyped = <Value>(value: unknown) => value as Value;

const motionKeys = "axis, angle, center, translation";

describe("an update is refused at once, by the name of the key that is not known, with those that are, for", () => {
  const tip = (change: unknown) => ({ handles: { tip: change } });
  const set = (handle: unknown) => tip({ set: handle });
  test.each<[string, unknown, string, string, string]>([
    ["the update", { handle: {} }, "update", "handle", "handles, settings, resize, beginsStep"],
    ["a change", tip({ moves: {} }), 'handle "tip"', "moves", "set, move, remove"],
    ["a motion", tip({ move: { rotation: [1, 0, 0] } }), 'motion of handle "tip"', "rotation", motionKeys],
    ["a motion", tip({ move: { translate: [1, 0, 0] } }), 'motion of handle "tip"', "translate", motionKeys],
    ["numbers in place of a motion", tip({ move: [1, 2, 3] }), 'motion of handle "tip"', "0", motionKeys],
    ["targets", tip({ move: { targets: [1], angle: 1 } }), 'motion of handle "tip"', "angle", "targets"],
    ["a handle", set({ vertex: [1] }), 'handle "tip"', "vertex", "vertices, points, motion, hold, footprint"],
    [
      "a handle's motion",
      set({ vertices: [1], motion: { offset: [1, 0, 0] } }),
      'motion of handle "tip"',
      "offset",
      motionKeys,
    ],
    ["a hold", set({ hold: { kind: "soft", weigth: 2 } }), 'hold of handle "tip"', "weigth", "kind, weight"],
    ["a hold's kind", set({ hold: { kind: "Soft" } }), 'hold of handle "tip"', "Soft", "exact, soft"],
    [
      "a point",
      set({ points: [{ face: 0, weights: [1] }] }),
      'a point of handle "tip"',
      "weights",
      "face, barycentric",
    ],
    ["settings", { settings: { P: 2 } }, "settings", "P", "p, stiffness, lengthUnit, solver, region"],
    ["a field", { settings: { p: { auto: 1 } } }, "p", "auto", "automatic"],
    ["the solver", { settings: { solver: { tol: 1 } } }, "solver", "tol", "method, tolerance"],
    ["the search", { settings: { solver: { search: { efort: 1 } } } }, "search", "efort", "effort, show, leastShare"],
    ["a method", { settings: { solver: { method: "newton" } } }, "method", "newton", "auto, quasiNewton"],
    ["a guess", { settings: { solver: { initial: "zero" } } }, "initial", "zero", "current, laplacian, rest"],
    ["a resize", { resize: { scales: [1, 1, 1] } }, "resize", "scales", "scale, origin, axes"],
  ])("%s: %j", async (_, update, element, key, known) => {
    const { server, session } = await begin();
    const limit = expect.stringContaining(known);
    const message = expect.stringContaining(`"${key}"`);
    const refusal = { code: "invalid_argument", reason: "UNKNOWN_KEY", element, limit, message };
    expect(() => session.update(untyped<Update>(update))).toThrow(expect.objectContaining(refusal));
    expect([server.updates.length, session.newestInput]).toEqual([0, 0]);
  });

  test.each<[string, unknown, string]>([
    ["p", { settings: { p: "auto" } }, "p"],
    ["p", { settings: { p: true } }, "p"],
    ["a stiffness", { settings: { stiffness: null } }, "stiffness"],
    ["a translation", tip({ move: { translation: [1, 2] } }), 'translation of motion of handle "tip"'],
    ["a center", tip({ move: { center: [1, 2, 3, 4] } }), 'center of motion of handle "tip"'],
    ["an axis", set({ vertices: [1], motion: { axis: ["0", 0, 1] } }), 'axis of motion of handle "tip"'],
    ["a lock's axis", set({ vertices: [1], hold: { kind: "axisLock", axis: 1 } }), 'axis of handle "tip"'],
    ["a scale", { resize: { scale: 2 } }, "scale of resize"],
    ["an axis of a resize", { resize: { scale: [1, 1, 2], axes: [[1, 0, 0], [0]] } }, "axes[1] of resize"],
  ])("%s that is none: %j", async (_, update, element) => {
    const { server, session } = await begin();
    const refusal = { code: "invalid_argument", reason: "ARRAY_TYPE", element };
    expect(() => session.update(untyped<Update>(update))).toThrow(expect.objectContaining(refusal));
    expect([server.updates.length, session.newestInput]).toEqual([0, 0]);
  });

  test("a change that says nothing, or two things", async () => {
    const { session } = await begin();
    for (const change of [{}, { move: "fixed", remove: true }]) {
      const call = () => session.update(untyped<Update>(tip(change)));
      expect(call).toThrow('Handle "tip" needs one of set, move and remove; known are set, move, remove.');
    }
  });
});

describe("a call is refused by the name of the option that is not known, before anything is made:", () => {
  const refusal = (key: string) =>
    expect.objectContaining({ reason: "UNKNOWN_KEY", message: expect.stringContaining(`"${key}"`) });

  test.each<[string, unknown]>([
    ["P", { P: 2 }],
    ["Uniform", { weights: "Uniform" }],
    ["stays", { freeComponents: "stays" }],
    ["raw", { encoding: "raw" }],
    ["best", { lowestEncoding: "best" }],
    ["position", { weld: "position" }],
    ["tol", { weld: { tol: 1e-6 } }],
    ["q", { settings: { q: 2 } }],
  ])("openSession, %s", async (key, options) => {
    const server = new FakeServer();
    await expect(openWith(server.rpc(), triangle, untyped<OpenOptions>(options))).rejects.toEqual(refusal(key));
    expect(server.creations).toEqual([]);
  });

  test("openSession's mesh", async () => {
    const mesh = { ...triangle, triangles: [0, 1, 2] };
    await expect(openWith(new FakeServer().rpc(), mesh, {})).rejects.toEqual(refusal("triangles"));
  });

  test("joinSession and restoreSession", async () => {
    const rpc = new FakeServer().rpc();
    await expect(joinWith(rpc, "sessions/1", untyped({ role: "owner" }))).rejects.toEqual(refusal("owner"));
    await expect(joinWith(rpc, "sessions/1", untyped({ weld: "byPosition" }))).rejects.toEqual(refusal("weld"));
    await expect(restoreWith(rpc, new Uint8Array(1), untyped({ settings: {} }))).rejects.toEqual(refusal("settings"));
  });

  test("an event", async () => {
    const { session } = await begin();
    for (const name of ["problems", "toString"]) {
      const call = () => session.on(untyped<"problem">(name), () => undefined);
      expect(call).toThrow(`Event is "${name}", which is not known; known are problem, connection, notice.`);
    }
  });

  test.each<[string, (session: Session) => Promise<unknown>]>([
    ["timeout", (session) => session.settle(untyped({ timeout: 5 }))],
    ["timeoutMs", (session) => session.solve(untyped({ timeoutMs: 5 }))],
    ["double", (session) => session.solve(untyped({ scalar: "double" }))],
    ["deadlineMs", (session) => session.undo(untyped({ deadlineMs: 5 }))],
    ["deadlineMs", (session) => session.redo(untyped({ deadlineMs: 5 }))],
    ["deadlineMs", (session) => session.ping(untyped({ deadlineMs: 5 }))],
    ["deadlineMs", (session) => session.takeBetterShape(untyped({ deadlineMs: 5 }))],
    ["deadlineMs", (session) => session.snapshot(untyped({ deadlineMs: 5 }))],
  ])("%s of a session's call", async (key, call) => {
    const { session } = await begin();
    await expect(call(session)).rejects.toEqual(refusal(key));
  });
});

describe("what is welded", () => {
  test.each<[NonNullable<OpenOptions["weld"]>, object]>([
    ["byPosition", { tolerance: 0 }],
    [{}, { tolerance: 0 }],
    [{ tolerance: 1e-6 }, { tolerance: 1e-6 }],
  ])("by position: %j", async (weld, value) => {
    const server = new FakeServer();
    const session = await openWith(server.rpc(), triangle, { weld });
    expect(server.creations[0]!.weld!.by).toMatchObject({ case: "position", value });
    await session.close();
  });
});
