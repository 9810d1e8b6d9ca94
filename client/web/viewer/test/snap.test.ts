import { expect, it } from "vitest";
import { quaternionOf } from "../src/model/pose.js";
import { gridStep, nearestTo, onGrid, onTurnedGrid } from "../src/model/snap.js";

it.each([
  [50, 1],
  [99, 1],
  [100, 2],
  [250, 5],
  [499, 5],
  [500, 10],
  [0.05, 0.001],
  [3e-7, 5e-9],
])("the grid of a mesh of %d has steps of %d", (diagonal, step) => {
  expect(gridStep(diagonal) / step).toBeCloseTo(1, 12);
});

it("a value that is dragged goes to the grid, and one that is not stays", () => {
  expect(onGrid([0, 0.13, 0], [0.26, 0.13, -0.24], 0.1)).toEqual([0.3, 0.13, -0.2]);
  expect(onGrid([0.3, 0, 0], [0.04, 0, 0], 0.1)).toEqual([0, 0, 0]);
});

it("along turned axes, the movement goes by steps", () => {
  const frame = quaternionOf([0, 0, 1], Math.PI / 4);
  const moved = onTurnedGrid([1, 0, 0.05], [1.2, 0.2, 0.05], 0.1, frame); // by 0.283 along the turned x
  expect(Math.hypot(moved[0] - 1, moved[1])).toBeCloseTo(0.3, 12);
  expect(moved[0] - 1).toBeCloseTo(moved[1], 12);
  expect(moved[2]).toBeCloseTo(0.05, 12);
});

it("the nearest place within reach is found, and none that does not count", () => {
  const screen = Float32Array.from([0, 0, 10, 0, NaN, NaN, 12, 1]);
  expect(nearestTo(screen, 12, 0)).toBe(3);
  expect(nearestTo(screen, 3, 3)).toBe(0);
  expect(nearestTo(screen, 200, 0)).toBeUndefined();
  expect(nearestTo(new Float32Array(0), 0, 0)).toBeUndefined();
});
