import { LpdeformError } from "lpdeform-client";
import { describe, expect, it } from "vitest";
import { EnergyTrail } from "../src/app/energy_trail.js";
import { Pace } from "../src/app/pace.js";
import { Meter } from "../src/link/meter.js";
import { elementsIn, isPassing, statusAtEnd, statusOf } from "../src/link/status.js";
import { changes as changesOf, exponent, newSession, type Side } from "../src/model/changes.js";
import {
  addHandle,
  changeHandle,
  type Document,
  emptyDocument,
  extendHandle,
  handleOf,
  nameFault,
  paint,
  releaseVertices,
  removeHandle,
  withoutPaint,
} from "../src/model/document.js";
import { quaternionOf, scaled } from "../src/model/pose.js";
import { shapeKinds } from "../src/model/shapes.js";
import { drawnAt, spread } from "lpdeform-client/mesh/drawmesh";
import { drawnOf } from "lpdeform-client/mesh/drawn";

const rest = Float32Array.from({ length: 30 }, (_, k) => k);
const mesh = { positions: rest, faces: new Uint32Array([0, 1, 2]) };
const changes = (before: Document, after: Document, side?: Side) => changesOf(before, after, mesh, side);
const two = addHandle(addHandle(emptyDocument, [0, 1], rest, { name: "a" }), [2, 1, 3], rest, { name: "b" });

describe("the document", () => {
  it("gives a vertex to one handle", () => {
    expect(handleOf(two, "b")!.vertices).toEqual([2, 3]);
    expect(addHandle(two, [0, 3], rest)).toBe(two);
    expect(handleOf(extendHandle(two, "a", [3, 4, 4, 5], rest), "a")!.vertices).toEqual([0, 1, 4, 5]);
  });

  it("lets handles go whose last vertex is released", () => {
    const left = releaseVertices(two, [0, 1, 2], rest);
    expect(left.handles.map(({ name, vertices }) => [name, vertices])).toEqual([["b", [3]]]);
  });

  it("keeps a handle where it is when its middle changes", () => {
    const moved = changeHandle(two, "a", { pose: { ...handleOf(two, "a")!.pose, translation: [1, 2, 3] } });
    expect(handleOf(extendHandle(moved, "a", [8], rest), "a")!.pose.translation).toEqual([1, 2, 3]);
  });

  it("has names and colours that differ", () => {
    const three = addHandle(addHandle(two, [5], rest), [6], rest);
    expect(three.handles.map(({ name }) => name)).toEqual(["a", "b", "Handle 1", "Handle 2"]);
    expect(new Set(three.handles.map(({ colour }) => colour)).size).toBe(4);
    expect(nameFault(two, "a", "b")).toMatch(/already/);
    expect(nameFault(two, "a", "")).toBeDefined();
    expect(nameFault(two, "a", "ä".repeat(65))).toMatch(/128/);
    expect(nameFault(two, "a", "a")).toBeUndefined();
  });
});

describe("what the server is told", () => {
  it("is everything at first, and nothing where nothing changed", () => {
    const all = changes(newSession, two)!;
    expect(Object.keys(all.handles!)).toEqual(["a", "b"]);
    expect(all.settings).toMatchObject({ p: 1.5 });
    expect(changes(two, two)).toBeUndefined();
  });

  it("is the places of a handle's vertices and points where it is scaled, but for one that is held by its direction", () => {
    const [a] = two.handles;
    const larger = scaled({ ...a!.pose, rotation: quaternionOf([0, 0, 1], Math.PI / 2) }, [2, 3, 1]);
    const { move } = changes(two, changeHandle(two, "a", { pose: larger }))!.handles!["a"] as {
      move: { targets: Float64Array };
    };
    // Vertices at 0, 1, 2 and 3, 4, 5 about 1.5, 2.5, 3.5: x and y twice and three times as far, then a quarter turn.
    expect([...move.targets].map((value) => Number(value.toFixed(9)))).toEqual([6, -0.5, 2, -3, 5.5, 5]);
    const point = { ...a!, vertices: [], points: [{ face: 0, barycentric: [0.5, 0.5, 0] as const }], pose: larger };
    const set = changes(newSession, { ...two, handles: [point] })!.handles!["a"] as {
      set: { motion: { targets: Float64Array } };
    };
    expect([...set.set.motion.targets].map((value) => Number(value.toFixed(9)))).toEqual([1.5, 2.5, 3.5]);
    const turned = changeHandle(two, "a", { pose: larger, hold: { kind: "orientation" } });
    expect((changes(two, turned)!.handles!["a"] as { set: { motion: object } }).set.motion).toHaveProperty("angle");
  });

  it("is a move where only the pose changed, and a removal where it is gone", () => {
    const pose = { ...two.handles[0]!.pose, translation: [0, 0, 1] as const };
    expect(changes(two, changeHandle(two, "a", { pose }))!.handles).toEqual({
      a: { move: { axis: [0, 0, 1], angle: 0, center: two.handles[0]!.pose.center, translation: [0, 0, 1] } },
    });
    expect(changes(two, removeHandle(two, "a"))!.handles).toEqual({ a: { remove: true } });
    expect(changes(two, changeHandle(two, "a", { colour: "#000", isLocked: true }))).toBeUndefined();
    const renamed = changes(two, changeHandle(two, "a", { name: "c" }))!.handles!;
    expect([renamed["a"], "set" in renamed["c"]!]).toEqual([{ remove: true }, true]);
  });

  it("is also of a handle whose name is one of the language's", () => {
    const named = addHandle(emptyDocument, [0], rest, { name: "__proto__" });
    expect(Object.entries(changes(newSession, named)!.handles!).map(([name]) => name)).toEqual(["__proto__"]);
  });

  it("is each side's own p", () => {
    const after: Document = { ...two, p: 3 };
    expect(changes(two, after, "first")!.settings).toEqual({ p: 3 });
    expect(changes(two, after, "second")).toBeUndefined();
    expect(changes(two, { ...two, secondP: 2 }, "second")!.settings).toEqual({ p: 2 });
  });

  it("is a field where p is painted, which the slider changes elsewhere", () => {
    const painted = paint(two, "p", [1], 4, 3);
    expect(changes(two, painted)!.settings).toEqual({ p: Float32Array.of(1.5, 4, 1.5) });
    expect(changes(painted, { ...painted, p: 2 })!.settings).toEqual({ p: Float32Array.of(2, 4, 2) });
    expect(changes(painted, withoutPaint(painted))!.settings).toEqual({ p: 1.5 });
    expect(changes(two, paint(two, "stiffness", [0], 9, 2))!.settings).toEqual({ stiffness: Float32Array.of(9, 1) });
  });

  it("is to find p by itself, until the slider is moved", () => {
    const automatic: Document = { ...two, isAutomatic: true };
    expect(changes(two, automatic)!.settings).toEqual({ p: { automatic: 1 }, stiffness: { automatic: 1 } });
    expect(changes(automatic, { ...automatic, isAutomatic: false, p: 3 })!.settings).toEqual({ p: 3, stiffness: 1 });
  });
});

it("the exponent of an energy is that of the side's slider, and 2 where the server finds p", () => {
  expect([exponent(two, "first"), exponent(two, "second"), exponent({ ...two, isAutomatic: true }, "first")]).toEqual([
    1.5, 6, 2,
  ]);
});

describe("words for", () => {
  it.each([
    ["unavailable", "", "away", true],
    ["unavailable", "DRAINING", "draining", true],
    ["resource_exhausted", "SESSIONS_FULL", "full", true],
    ["resource_exhausted", "MEMORY_FULL", "full", true],
    ["not_found", "SESSION_EXPIRED", "away", true],
    ["invalid_argument", "MESH_TOO_LARGE", "refused", false],
  ] as const)("%s %s are of the kind %s", (code, reason, kind, passes) => {
    const status = statusOf(new LpdeformError(code, "the mesh has 9 faces", { reason, element: "face 3" }));
    expect([status.kind, isPassing(status)]).toEqual([kind, passes]);
    expect(status.title).not.toBe("");
  });

  it.each([
    ["invalid_argument", "The server refuses this mesh"],
    ["resource_exhausted", "The server is full"],
    ["unauthenticated", "The server does not let you in"],
    ["permission_denied", "The server does not let you in"],
    ["unimplemented", "The server does not know this request"],
  ] as const)("%s are its own", (code, title) => {
    expect(statusOf(new LpdeformError(code, "no", {})).title).toBe(title);
  });

  it("a full server leave its advice out, which the page follows by itself", () => {
    const full = "The server has all of its 8 sessions in use; try again after the time given.";
    expect(statusOf(new LpdeformError("resource_exhausted", full, {})).text).toBe(
      "The server has all of its 8 sessions in use. Trying again by itself; your work is kept here.",
    );
  });

  it("limits are set as people write them", () => {
    const text = statusOf(new LpdeformError("invalid_argument", "allowed are vertices <= 500, faces <= 1500", {})).text;
    expect(text.replaceAll("\u00a0", " ")).toBe("Allowed are vertices ≤ 500, faces ≤ 1500.");
    const large = "the mesh has 2102500 vertices; allowed are vertices <= 2000000; vertex 123456 is one";
    expect(statusOf(new LpdeformError("invalid_argument", large, {})).text.replaceAll("\u00a0", " ")).toBe(
      "The mesh has 2,102,500 vertices; allowed are vertices ≤ 2,000,000; vertex 123456 is one.",
    );
  });

  it("what is wrong name the element and its place", () => {
    expect(statusOf(new LpdeformError("invalid_argument", "a face has 2 corners", { element: "face 3" }))).toMatchObject({
      text: "A face has 2 corners.",
      element: "face 3",
    });
    expect(elementsIn("face 3")).toEqual({ vertices: [], edges: [], faces: [3] });
    expect(elementsIn("edge 4-5")).toEqual({ vertices: [], edges: [4, 5], faces: [] });
    const handles = [{ name: "Handle 2", vertices: [7, 9] }];
    expect(elementsIn('handle "Handle 2"', handles)).toEqual({ vertices: [7, 9], edges: [], faces: [] });
    expect(elementsIn('handle "face 3"', handles)).toEqual({ vertices: [], edges: [], faces: [] });
    expect(elementsIn("component 2", handles)).toEqual({ vertices: [], edges: [], faces: [] });
  });
});

describe("words at the end", () => {
  it.each(["FRAME_PARTS", "FRAME_VERTICES"] as const)("of a session by %s tell what to do, and try nothing again", (reason) => {
    const status = statusAtEnd(new LpdeformError("data_loss", "4 of 3", { reason }));
    expect(isPassing(status)).toBe(false);
    expect(status.text).toMatch(/reload the page\. Your work is kept here/);
    expect(isPassing(statusAtEnd(new LpdeformError("data_loss", "cut off", {})))).toBe(true);
  });

  it("of a session by a failure of the page itself say so, and begin again", () => {
    const status = statusAtEnd(new LpdeformError("internal", "out of memory", { reason: "EXCEPTION" }));
    expect(isPassing(status)).toBe(true);
    expect(status.title).toBe("This page failed with a frame");
  });
});

describe("the meter", () => {
  it("counts a second's frames and bytes", () => {
    const meter = new Meter();
    for (let k = 0; k < 30; ++k) meter.drawn(100 * k, 1000);
    expect(meter.framesPerSecond(2900)).toBe(11);
    expect(meter.bytesPerSecond(2900)).toBe(11_000);
    expect(meter.framesPerSecond(9000)).toBe(0);
  });

  it("keeps the newest latencies", () => {
    const meter = new Meter(100);
    for (let k = 1; k <= 200; ++k) meter.answered(k, k / 2);
    expect(meter.inputs).toBe(100);
    expect([meter.latency(0.5), meter.latency(0.99), meter.service(1)]).toEqual([150, 199, 100]);
  });
});

it("the energies of solve after solve are one line, of bounded length", () => {
  const trail = new EnergyTrail(4);
  for (const [iteration, energy] of [
    [0, 9],
    [5, 8],
    [1, 7],
    [3, 6],
    [0, 5],
  ] as const)
    trail.add(iteration, energy);
  expect(trail.iterations).toEqual([5, 6, 8, 8]);
  expect(trail.energies).toEqual([8, 7, 6, 5]);
  expect(trail.starts).toEqual([6, 8]);
});

describe("what is drawn", () => {
  it("has hard edges where they are sharp, and none where it is smooth", () => {
    const { mesh: bar } = shapeKinds[0]!.make("coarse");
    const { mesh: creature } = shapeKinds[3]!.make("coarse");
    const [sharp, smooth] = [drawnOf(bar), drawnOf(creature)];
    const cells = 4;
    const height = 21;
    // Each corner is drawn three times, each other vertex of an edge twice.
    expect(sharp.source.length).toBe(bar.positions.length / 3 + 8 * 2 + 4 * (height - 1) + 8 * (cells - 1));
    // Its ears are creased where so few vertices make them.
    expect(smooth.source.length).toBeLessThan((1.02 * creature.positions.length) / 3);
  });

  it("knows whether it has an inside that nobody sees", () => {
    const { mesh } = shapeKinds[0]!.make("coarse");
    expect(drawnOf(mesh).isClosed).toBe(true);
    expect(drawnOf({ ...mesh, faces: mesh.faces.slice(3) }).isClosed).toBe(false);
    expect(drawnOf({ ...mesh, faces: Uint32Array.from([...mesh.faces, 0, 1, 2]) }).isClosed).toBe(false);
  });

  it("has each of several faces in one place once, the last of them, and keeps what is turned the other way", () => {
    const faces = [0, 1, 2, 0, 2, 3, 1, 2, 0, 2, 1, 0, 0, 1, 3, 2, 0, 1, 0, 2, 3];
    const drawn = drawnOf({
      positions: Float32Array.from({ length: 12 }, (_, k) => (k * k) % 7),
      faces: Uint32Array.from(faces),
    });
    expect([...drawn.once].map((vertex) => drawn.source[vertex])).toEqual([2, 1, 0, 0, 1, 3, 2, 0, 1, 0, 2, 3]);
    expect([...drawn.once]).toEqual([...drawn.indices.slice(9)]);
    expect([...drawn.indices].map((vertex) => drawn.source[vertex])).toEqual(faces);
    const { mesh } = shapeKinds[0]!.make("coarse");
    const whole = drawnOf(mesh);
    expect(whole.once).toBe(whole.indices);
  });

  it("follows the mesh's vertices, with normals that look outwards", () => {
    const { mesh } = shapeKinds[0]!.make("coarse");
    const drawn = drawnOf(mesh);
    const draw = drawnAt(
      mesh.positions.map((value) => 2 * value),
      drawn,
    );
    for (let k = 0; k < drawn.source.length; ++k) {
      for (let axis = 0; axis < 3; ++axis)
        expect(draw.positions[3 * k + axis]).toBe(2 * mesh.positions[3 * drawn.source[k]! + axis]!);
    }
    const top = draw.positions.findIndex((value, k) => k % 3 === 2 && value > 10.4 && draw.normals[k]! > 0);
    expect(top).toBeGreaterThan(0);
    const values = new Float32Array(drawn.source.length);
    spread(
      Float32Array.from({ length: mesh.positions.length / 3 }, (_, vertex) => vertex),
      drawn,
      values,
    );
    expect([...values]).toEqual([...drawn.source]);
  });
});

describe("the pace", () => {
  const drawEvery = (pace: Pace, milliseconds: number) => {
    for (let k = 0; k < 30; ++k) pace.drew(1000 + milliseconds * k);
  };

  it("is coarse while pictures that move are slow, and fine once they rest", () => {
    const pace = new Pace(() => undefined);
    drawEvery(pace, 120);
    expect(pace.quality).toBeLessThan(1);
    expect(pace.isAtRest(1000 + 120 * 30)).toBe(false);
    expect(pace.isAtRest(10_000)).toBe(true);
    expect(pace.quality).toBe(1);
    expect(pace.isAtRest(10_500)).toBe(false); // once is enough
  });

  it("is fine throughout where drawing is quick", () => {
    const pace = new Pace(() => undefined);
    drawEvery(pace, 16);
    expect(pace.quality).toBe(1);
  });
});
