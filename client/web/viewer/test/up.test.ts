import { expect, it } from "vitest";
import { guessYUp } from "lpdeform-client/mesh/up";

/** A pyramid that stands on a square, its tip along `up`; with `isDouble`, one on each side of the square. */
function pyramid(up: 1 | 2, name: string, isDouble = false) {
  const at = (a: number, b: number, height: number) => (up === 2 ? [a, b, height] : [b, height, a]);
  const square = [at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0)];
  const positions = Float32Array.from([...square, at(0.5, 0.5, 1), at(0.5, 0.5, -1)].flat());
  const sides = (tip: number) => [0, 1, 2, 3].flatMap((k) => [k, (k + 1) % 4, tip]);
  return { name, positions, faces: Uint32Array.from(isDouble ? [...sides(4), ...sides(5)] : [...sides(4), 0, 2, 1, 0, 3, 2]) };
}

it.each(["a.obj", "a.stl", "A.OBJ", "a.ply"])("what stands is shown standing, whatever wrote it: %s", (name) => {
  expect([guessYUp(pyramid(1, name)), guessYUp(pyramid(2, name))]).toEqual([true, false]);
});

it.each([
  ["a.OBJ", true],
  ["a.off", false],
  ["a.ply", false],
  ["a.stl", false],
])("where the shape does not say, the kind of file does: %s", (name, isYUp) => {
  expect([1, 2].map((up) => guessYUp(pyramid(up as 1 | 2, name, true)))).toEqual([isYUp, isYUp]);
});

it("without a surface there is nothing to fall over", () => {
  const nothing = { name: "a.off", positions: new Float32Array(9), faces: Uint32Array.of(0, 1, 2) };
  expect(guessYUp(nothing)).toBe(false);
});
