import { expect, it } from "vitest";
import { aheadOf } from "../src/model/ahead.js";
import { derivedOf, isKnown, know, usualWelding } from "lpdeform-client/mesh/derived";
import { addHandle, changeHandle, emptyDocument } from "../src/model/document.js";
import { blockBoxes, faceOrder } from "lpdeform-client/mesh/face_blocks";
import { boundsOf, type Mesh } from "lpdeform-client/mesh/mesh";
import { pullOf } from "lpdeform-client/mesh/pull";
import { raycast } from "../src/model/raycast.js";
import { shapeKinds } from "../src/model/shapes.js";
import { energyStatistics } from "lpdeform-client/mesh/statistics";
import { drawnAt, spread } from "lpdeform-client/mesh/drawmesh";
import { shadedOf } from "lpdeform-client/mesh/shaded";
import { openedMesh, workerOf } from "../src/io/opened.js";
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

it("what is drawn of a surface is found in new arrays, with its statistics and boxes", () => {
  const derived = derivedOf(mesh);
  const { drawn } = derived.shown;
  const distortion = Float32Array.from({ length: positions.length / 3 }, (_, vertex) => vertex % 97);
  const shaded = shadedOf({ positions: bent, distortion }, mesh, derived);
  const values = new Float32Array(drawn.source.length);
  spread(distortion, drawn, values);
  expect(shaded).toEqual({
    ...drawnAt(bent, drawn),
    distortion: values,
    boxes: blockBoxes(bent, faces, derived.order),
    statistics: energyStatistics(distortion),
  });
  // Its memory goes to the page, so the next frame must not be in it.
  expect(shadedOf({ positions, distortion }, mesh, derived).positions.buffer).not.toBe(shaded.positions.buffer);
  expect(shadedOf({ positions, distortion: new Float32Array(0) }, mesh, derived).distortion).toHaveLength(0);
});

it("what was found of a mesh elsewhere is not found again", () => {
  const tube = splitTube(12, 4);
  const derived = derivedOf(tube);
  const copy = { ...tube };
  know(copy, derived);
  expect(derivedOf(copy)).toBe(derived);
  expect(isKnown(copy, usualWelding)).toBe(true);
  expect(isKnown(copy, { ...usualWelding, isOn: false })).toBe(false);
});

it("a large file is read where there are no workers, too", async () => {
  const lines = [...Array(20_000).keys()].map((k) => `v ${k % 100} ${Math.floor(k / 100)} 0`);
  const file = new File([`${lines.join("\n")}\nf 1 2 102\n`], "long.obj");
  expect(file.size).toBeGreaterThan(200_000);
  const read = await openedMesh(file, []);
  expect(read.positions.length).toBe(60_000);
  // Its frames are taken without a worker, too.
  const { shaded } = await frameOf(read);
  expect(shaded.positions).toEqual(derivedOf(read).shown.atRest.positions);
});

async function frameOf(read: Mesh) {
  const distortion = new Float32Array(read.positions.length / 3);
  return { shaded: await workerOf(read)!.shade({ positions: read.positions, distortion }) };
}

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
