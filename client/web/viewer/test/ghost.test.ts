import type { Mesh as Drawing } from "three";
import { expect, it, vi } from "vitest";
import { firstView } from "../src/model/view.js";
import { Surface } from "../src/stage/surface.js";
import { splitTube } from "./split_tube.js";

vi.mock("../src/stage/software.js", () => ({ isSoftware: false }));

it("the original gets its faces when it is first shown, and they are those of the mesh", () => {
  const mesh = splitTube(4, 6);
  const surface = new Surface(mesh);
  const ghost = surface.group.children.find(({ renderOrder }) => renderOrder === 2) as Drawing;
  surface.show({ ...firstView, ghost: false });
  expect(ghost.geometry.index).toBeNull();
  surface.show({ ...firstView, ghost: true });
  expect(ghost.visible).toBe(true);
  const placesOf = (faces: ArrayLike<number>) =>
    Array.from(faces, (vertex) => [...mesh.positions.subarray(3 * vertex, 3 * vertex + 3)].map((value) => value.toFixed(5)));
  expect(placesOf(ghost.geometry.index!.array)).toEqual(placesOf(mesh.faces)); // copies along the seam may stand for each other
});
