import { derive, usualWelding } from "lpdeform-client/mesh/derived";
import { expect, it } from "vitest";
import { boundsOf, type Mesh } from "lpdeform-client/mesh/mesh";
import { seamsOf } from "lpdeform-client/mesh/seams";
import { leastEdge } from "../src/model/least_edge.js";
import { shapeKinds } from "../src/model/shapes.js";
import { splitTube } from "./split_tube.js";

const columns = 12;
const rows = 4;

/** Two meshes beside each other in one file. */
function together(...meshes: Mesh[]): Mesh {
  const faces: number[] = [];
  let begin = 0;
  for (const mesh of meshes) {
    for (const vertex of mesh.faces) faces.push(begin + vertex);
    begin += mesh.positions.length / 3;
  }
  const positions = Float32Array.from(meshes.flatMap((mesh) => [...mesh.positions]));
  return { name: "together", positions, faces: Uint32Array.from(faces) };
}

const { tolerance: usual } = usualWelding;

it("vertices in one place on open borders are found, and the faces that use them", () => {
  const mesh = splitTube(columns, rows);
  const seams = seamsOf(mesh, usual)!;
  expect(seams.copyCount).toBe(rows + 1);
  // Row by row, each with one column more than there are places.
  const first = Array.from({ length: rows + 1 }, (_, row) => row * (columns + 1));
  for (const vertex of first) expect(seams.groups[vertex + columns]).toBe(vertex);
  expect(new Set(seams.groups).size).toBe((rows + 1) * columns);
  expect(seams.faces).toEqual(mesh.faces.map((vertex) => seams.groups[vertex]!));
  expect(seams.withCopies([columns, 1, 0])).toEqual([0, columns, 1]);
});

it.each([
  [1e-16, true],
  [5e-7, true],
  [5e-6, false],
])("as in one place counts what is %d of the size apart: %s", (share, isSeam) => {
  const mesh = splitTube(columns, rows);
  const exact = Float64Array.from(mesh.positions);
  for (let row = 0; row <= rows; ++row) exact[3 * (row * (columns + 1) + columns)]! += share;
  expect(seamsOf({ ...mesh, exact }, usual) !== undefined).toBe(isSeam);
});

it.each([
  [0, 0, true],
  [0, 1e-7, false],
  [1e-3, 5e-4, true],
  [1e-3, 2e-3, false],
])("with a tolerance of %d, what is %d of the size apart counts as in one place: %s", (tolerance, share, isSeam) => {
  const mesh = splitTube(columns, rows);
  const { diagonal } = boundsOf(mesh.positions, mesh.faces);
  const exact = Float64Array.from(mesh.positions);
  for (let row = 0; row <= rows; ++row) exact[3 * (row * (columns + 1) + columns)]! += share * diagonal;
  const seams = seamsOf({ ...mesh, exact }, tolerance);
  expect(seams?.copyCount).toBe(isSeam ? rows + 1 : undefined);
});

it("also where that lies on both sides of 0, or of any other number", () => {
  const mesh = splitTube(columns, rows);
  for (const shift of [0, 1e-9, 0.1, 1000 * 1e-9]) {
    const exact = Float64Array.from(mesh.positions, (value, k) => value + (k % 3 === 1 ? shift : 0));
    for (let row = 0; row <= rows; ++row) {
      exact[3 * (row * (columns + 1)) + 1] = shift - 1e-10;
      exact[3 * (row * (columns + 1) + columns) + 1] = shift + 1e-10;
    }
    expect(seamsOf({ ...mesh, exact }, usual)?.copyCount).toBe(rows + 1);
  }
});

/** Single triangles, one corner of each on the x axis at these places, which are shares of the diagonal. */
function corners(shares: readonly number[], size = 1): Mesh {
  const exact = new Float64Array(9 * shares.length);
  const diagonal = Math.sqrt(3) * size;
  shares.forEach((share, k) => {
    const far = (k + 1) / shares.length;
    exact.set([share * diagonal, 0, 0, size * far, size * far, size * far, 0, size * far, size * far], 9 * k);
  });
  const faces = Uint32Array.from({ length: 3 * shares.length }, (_, corner) => corner);
  return { name: "corners", positions: Float32Array.from(exact), exact, faces };
}

it("at the usual tolerance every copy is within it of the first of its place, as servers want it of groups", () => {
  const chain = seamsOf(corners([0, 0.74e-6, 1.48e-6, 0.74e-6]), usual)!;
  expect([0, 3, 6, 9].map((vertex) => chain.groups[vertex])).toEqual([0, 0, 6, 0]);
  expect(chain.copyCount).toBe(2);
});

it("above the usual tolerance chains are joined, as servers weld by position", () => {
  const chain = seamsOf(corners([0, 0.74e-4, 1.48e-4]), 1e-4)!;
  expect([0, 3, 6].map((vertex) => chain.groups[vertex])).toEqual([0, 0, 0]);
});

it("above the usual tolerance vertices count that are on no border, and the diagonal of all vertices", () => {
  const { mesh } = shapeKinds.find(({ id }) => id === "block")!.make("coarse");
  const count = mesh.positions.length / 3;
  expect(seamsOf(together(mesh, mesh), 2e-6)!.copyCount).toBe(count); // closed bodies in one place
  const tube = splitTube(columns, rows);
  const far = { ...tube, positions: Float32Array.from([...tube.positions, 1e4, 1e4, 1e4]) }; // no face uses it
  expect(seamsOf(far, usual)!.copyCount).toBe(rows + 1);
  expect(seamsOf(far, 1e-3)!.copyCount).toBeGreaterThan(rows + 1);
});

it("too many vertices within a large tolerance of each other are refused, as servers do", () => {
  const positions = Float32Array.from({ length: 30_000 }, (_, k) => ((k * 7919) % 30_000) * 1e-9);
  positions[0] = 1;
  const heap = { name: "heap", positions, faces: Uint32Array.of(0, 1, 2) };
  expect(() => seamsOf(heap, 1e-3)).toThrow(expect.objectContaining({ reason: "WELD_TOO_DENSE", element: "weld tolerance" }));
});

it.each([
  [5e-7, 0],
  [5e-6, 2 * (rows + 1)],
  [5e-4, 2 * (rows + 1)],
  [5e-3, 0],
])("at %d of the size from each other, borders that look like one are told: %d vertices", (share, count) => {
  const mesh = splitTube(columns, rows);
  const { diagonal } = boundsOf(mesh.positions, mesh.faces);
  const exact = Float64Array.from(mesh.positions);
  for (let row = 0; row <= rows; ++row) exact[3 * (row * (columns + 1) + columns)]! += share * diagonal;
  expect(derive({ ...mesh, exact }, usualWelding).looseCount).toBe(count);
  expect(derive({ ...mesh, exact }, { tolerance: 1e-3, isOn: true }).looseCount).toBe(0);
});

it("a fine border that is torn is told whole, and a way around its ends does not join it", () => {
  const fine = 2000;
  const mesh = splitTube(columns, fine);
  const { diagonal } = boundsOf(mesh.positions, mesh.faces);
  const exact = Float64Array.from(mesh.positions);
  for (let row = 0; row <= fine; ++row) exact[3 * (row * (columns + 1) + columns)]! += 1e-5 * diagonal;
  expect(derive({ ...mesh, exact }, usualWelding).looseCount).toBe(2 * (fine + 1));
});

it.each([5000, 50_000])("a border of %d vertices that is whole is not told to come apart", (count) => {
  const positions = new Float32Array(3 * (count + 1));
  for (let k = 0; k < count; ++k)
    positions.set([Math.cos((2 * Math.PI * k) / count), Math.sin((2 * Math.PI * k) / count), 0], 3 * k);
  const faces = Uint32Array.from(
    { length: 3 * count },
    (_, k) => [count, Math.floor(k / 3), (Math.floor(k / 3) + 1) % count][k % 3]!,
  );
  expect(derive({ name: "fan", positions, faces }, usualWelding).looseCount).toBe(0);
});

it.each(shapeKinds.map(({ id, make }) => [id, make("medium").mesh] as const))("the shape %s has no such borders", (_, mesh) => {
  expect(derive(mesh, usualWelding).looseCount).toBe(0);
});

it("surfaces that are closed, or whose borders lie apart, have none", () => {
  const { mesh } = shapeKinds.find(({ id }) => id === "block")!.make("coarse");
  expect(seamsOf(mesh, usual)).toBeUndefined();
  expect(seamsOf(together(mesh, mesh), usual)).toBeUndefined(); // in one place, and yet two bodies
  for (const { make } of shapeKinds) expect(seamsOf(make("coarse").mesh, usual)).toBeUndefined();
});

it("any number may be in one place", () => {
  const count = 60_000;
  const positions = new Float32Array(3 * count);
  positions[0] = 1; // the rest lie on the origin
  const faces = Uint32Array.from({ length: count }, (_, corner) => corner);
  const seams = seamsOf({ name: "heap", positions, faces }, usual)!;
  expect([seams.copyCount, seams.groups[1], seams.groups[count - 1]]).toEqual([count - 2, 1, 1]);
});

it("a heap of single triangles is one surface", () => {
  const { mesh } = shapeKinds.find(({ id }) => id === "block")!.make("coarse");
  const heap: Mesh = {
    name: "heap",
    positions: Float32Array.from([...mesh.faces].flatMap((vertex) => [...mesh.positions.subarray(3 * vertex, 3 * vertex + 3)])),
    faces: Uint32Array.from({ length: mesh.faces.length }, (_, corner) => corner),
  };
  expect(new Set(seamsOf(heap, usual)!.groups).size).toBe(mesh.positions.length / 3);
});

it("the least edge that keeps a tolerance small is one with a length", () => {
  const positions = Float32Array.of(0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 0);
  expect(leastEdge({ positions, faces: Uint32Array.of(0, 1, 2) })).toBe(3);
  expect(leastEdge({ positions, faces: Uint32Array.of(0, 3, 2) })).toBe(4);
  expect(leastEdge({ positions, faces: Uint32Array.of(0, 3, 0) })).toBe(Infinity);
});
