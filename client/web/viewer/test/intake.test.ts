import { expect, it } from "vitest";
import { aheadOf } from "../src/model/ahead.js";
import { derivedOf, know, shownOf } from "../src/model/derived.js";
import { addHandle, changeHandle, emptyDocument } from "../src/model/document.js";
import { blockBoxes, faceOrder } from "../src/model/face_blocks.js";
import { boundsOf } from "../src/model/mesh.js";
import { pullOf } from "../src/model/pull.js";
import { raycast } from "../src/model/raycast.js";
import { shapeKinds } from "../src/model/shapes.js";
import { energyStatistics } from "../src/model/statistics.js";
import { DrawMesh } from "../src/stage/drawmesh.js";
import { IntakeWorker, Taking } from "../src/stage/intake.js";
import { openedMesh } from "../src/io/opened.js";
import { splitTube } from "./split_tube.js";

const { mesh } = shapeKinds.find(({ id }) => id === "creature")!.make("medium");
const { positions, faces } = mesh;
const { diagonal, center } = boundsOf(positions);
/** As a frame could have it: nothing like at rest. */
const bent = positions.map((value, k) => value + 0.2 * diagonal * Math.sin((3 * positions[k - (k % 3)]!) / diagonal));

it("a ray that tests blocks of faces hits what a ray that tests all of them hits", () => {
  const order = faceOrder(positions, faces);
  expect([...order].sort((a, b) => a - b)).toEqual(Array.from({ length: faces.length / 3 }, (_, face) => face));
  for (const now of [positions, bent]) {
    const blocks = { order, boxes: blockBoxes(now, faces, order) };
    let hits = 0;
    for (let k = 0; k < 400; ++k) {
      const [turn, roll] = [k * 2.4, Math.acos(1 - (2 * k + 1) / 400)];
      const out = [Math.sin(roll) * Math.cos(turn), Math.sin(roll) * Math.sin(turn), Math.cos(roll)] as const;
      const origin = out.map((value, axis) => center[axis]! + 2 * diagonal * value) as [number, number, number];
      const to = [0, 1, 2].map((axis) => now[3 * ((k * 37) % (now.length / 3)) + axis]! + 0.001 * diagonal);
      const direction = to.map((value, axis) => (value - origin[axis]!) / diagonal) as [number, number, number];
      const hit = raycast(now, faces, origin, direction);
      if (hit) ++hits;
      expect(raycast(now, faces, origin, direction, blocks)).toEqual(hit);
    }
    expect(hits).toBeGreaterThan(200);
  }
});

it("a ray along an axis, in the plane of flat boxes, hits", () => {
  const square = Float32Array.of(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0);
  const two = Uint32Array.of(0, 1, 2, 0, 2, 3);
  const order = faceOrder(square, two);
  const blocks = { order, boxes: blockBoxes(square, two, order) };
  expect(raycast(square, two, [0, 0.5, 3], [0, 0, -1], blocks)).toEqual(raycast(square, two, [0, 0.5, 3], [0, 0, -1]));
  expect(raycast(square, two, [0.2, 0.5, 3], [0, 0, -1], blocks)?.distance).toBe(3);
});

it("what a worker takes of a frame is what the page would take", () => {
  const { adjacency, drawn } = shownOf(mesh, faces);
  const { order } = derivedOf(mesh);
  const distortion = Float32Array.from({ length: positions.length / 3 }, (_, vertex) => vertex % 97);
  const taking = new Taking({ positions, faces, drawn, adjacency, order });
  const intake = taking.take({ positions: bent, distortion });
  const draw = new DrawMesh(mesh);
  draw.take(bent);
  const values = new Float32Array(draw.source.length);
  draw.spread(distortion, values);
  expect(intake.positions).toEqual(draw.positions);
  expect(intake.normals).toEqual(draw.normals);
  expect(intake.distortion).toEqual(values);
  expect(intake.boxes).toEqual(blockBoxes(bent, faces, order));
  expect(intake.statistics).toEqual(energyStatistics(distortion));
  // Its memory goes to the page, so the next frame must not be in it.
  expect(taking.take({ positions, distortion }).positions.buffer).not.toBe(intake.positions.buffer);
  expect(IntakeWorker.start({ positions, faces, drawn, adjacency, order })).toBeUndefined(); // few vertices
});

it("what was found of a mesh elsewhere is not found again, welded or not", () => {
  const tube = splitTube(12, 4);
  const derived = derivedOf(tube);
  const copy = { ...tube };
  know(copy, derived);
  expect(derivedOf(copy)).toBe(derived);
  expect(shownOf(copy, derived.seams!.faces)).toBe(derived.shown);
  expect(shownOf(copy, copy.faces)).not.toBe(derived.shown);
  expect(shownOf(copy, copy.faces)).toBe(shownOf(copy, copy.faces));
});

it("a large file is read where there are no workers, too", async () => {
  const lines = [...Array(20_000).keys()].map((k) => `v ${k % 100} ${Math.floor(k / 100)} 0`);
  const file = new File([`${lines.join("\n")}\nf 1 2 102\n`], "long.obj");
  expect(file.size).toBeGreaterThan(200_000);
  expect((await openedMesh(file, [])).positions.length).toBe(60_000);
});

it("vertices go along with a handle that is pulled, the less the nearer they are to what is held", () => {
  const { adjacency } = derivedOf(mesh).shown;
  const [pulled, held] = [[0], [Math.floor(positions.length / 6)]];
  const shares = pullOf(positions, adjacency, pulled, held);
  expect(shares[0]).toBe(1);
  expect(shares[held[0]!]).toBe(0);
  expect(shares.every((share) => share >= 0 && share <= 1)).toBe(true);
  // Smooth: neighbours differ by little.
  for (let v = 0; v + 1 < adjacency.starts.length; ++v) {
    for (let k = adjacency.starts[v]!; k < adjacency.starts[v + 1]!; ++k) {
      expect(Math.abs(shares[v]! - shares[adjacency.neighbours[k]!]!)).toBeLessThan(0.5);
    }
  }
  expect(pullOf(positions, adjacency, pulled, []).every((share) => share === 1)).toBe(true);
  const apart = { starts: adjacency.starts.slice().fill(0), neighbours: new Uint32Array(0) };
  expect(pullOf(positions, apart, [3], [4]).indexOf(1)).toBe(3);
  expect(pullOf(positions, apart, [3], [4]).filter((share) => share > 0)).toHaveLength(1);
});

it("handles are ahead by their motion alone, and only those that are held exactly", () => {
  const two = addHandle(addHandle(emptyDocument, [0, 1], positions, { name: "a" }), [5, 6], positions, { name: "b" });
  const { pose } = two.handles[0]!;
  const to = { ...pose, translation: [1, 0, 0] } as const;
  const moved = changeHandle(two, "a", { pose: to });
  expect(aheadOf(two, moved)).toEqual({ pulled: [0, 1], held: [5, 6], from: pose, to });
  expect(aheadOf(two, moved)!.pulled).toBe(two.handles[0]!.vertices);
  expect(aheadOf(two, two)).toBeUndefined();
  expect(aheadOf(two, changeHandle(two, "a", { vertices: [0, 1, 2], pose: to }))).toBeUndefined();
  expect(aheadOf(two, { ...two, handles: [] })).toBeUndefined();
  const soft = changeHandle(two, "a", { hold: { kind: "soft", weight: 1 } });
  expect(aheadOf(soft, changeHandle(soft, "a", { pose: to }))).toBeUndefined();
});
