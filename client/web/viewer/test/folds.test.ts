import { adjacencyOf } from "lpdeform-client/mesh/adjacency";
import { derivedOf } from "lpdeform-client/mesh/derived";
import { expect, it } from "vitest";
import { foldsOf } from "../src/model/folds.js";
import { shapeKinds } from "../src/model/shapes.js";
import { splitTube } from "./split_tube.js";

it("edges of a bar are folds, and its sides are not", () => {
  const { mesh } = shapeKinds.find(({ id }) => id === "bar")!.make("medium");
  const { bounds, edge, shown } = derivedOf(mesh);
  const folds = foldsOf(mesh.positions, mesh.faces, shown.adjacency, 2 * edge);
  const [edges, sides] = [[] as number[], [] as number[]];
  folds.forEach((fold, vertex) => {
    const [x, y, z] = mesh.positions.subarray(3 * vertex, 3 * vertex + 3);
    const toSide = [x! - bounds.min[0], bounds.max[0] - x!, y! - bounds.min[1], bounds.max[1] - y!].sort((a, b) => a - b);
    const isEnd = z! - bounds.min[2] < 3 * edge || bounds.max[2] - z! < 3 * edge;
    if (toSide[1]! < 1e-6) edges.push(fold);
    else if (toSide[1]! > 3 * edge && !isEnd) sides.push(fold);
  });
  expect(Math.min(...edges)).toBeGreaterThan(0.3);
  expect(sides.length).toBeGreaterThan(10);
  expect(Math.max(...sides)).toBe(0);
});

it("a tube turns by its radius: wholly within an eighth of its circumference, and less within less", () => {
  const tube = splitTube(64, 20); // radius 1
  const { seams, shown } = derivedOf(tube);
  const at = (size: number) => foldsOf(tube.positions, seams!.faces, shown.adjacency, size, seams!.groups);
  // Two of six edges go round the tube, and two slantwise.
  const [small, large] = [at(0.1), at(10)];
  const middle = 10 * 65 + 5;
  expect(large[middle]).toBe(1);
  expect(small[middle]).toBeGreaterThan(0);
  expect(small[middle]).toBeLessThan(0.05);
  // Copies along the seam have what the first has.
  for (let row = 0; row <= 20; ++row) expect(small[row * 65 + 64]).toBe(small[row * 65]);
});

it("a flat sheet has none, and a vertex without neighbours neither", () => {
  const positions = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5]);
  const faces = Uint32Array.from([0, 1, 2]);
  expect([...foldsOf(positions, faces, adjacencyOf(4, faces), 1)]).toEqual([0, 0, 0, 0]);
});
