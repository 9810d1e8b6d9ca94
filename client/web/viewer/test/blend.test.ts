import { expect, it } from "vitest";
import { blended, blendPs, type Shape } from "../src/model/blend.js";

const shape = (value: number): Shape => ({
  positions: new Float32Array(6).fill(value),
  distortion: new Float32Array(2).fill(-value),
});
const shapes = new Map([
  [4, shape(8)],
  [1, shape(0)],
  [2, shape(4)],
]);
const at = (p: number) => {
  const { shape, low, high } = blended(shapes, p)!;
  return [shape.positions[5], shape.distortion[1], low, high];
};

it("between two values of p that are known, a shape is interpolated by the logarithm of p", () => {
  const [position, distortion, low, high] = at(Math.SQRT2);
  expect([position, distortion]).toEqual([expect.closeTo(2, 5), expect.closeTo(-2, 5)]);
  expect([low, high]).toEqual([1, 2]);
  expect(at(3)[0]).toBeCloseTo(4 + 4 * Math.log2(1.5), 5);
});

it("at a value that is known, and beyond all, it is the shape there", () => {
  expect(at(2)).toEqual([4, -4, 2, 2]);
  expect(at(1)).toEqual([0, -0, 1, 1]);
  expect(at(9)).toEqual([8, -8, 4, 4]);
  expect(blended(new Map(), 2)).toBeUndefined();
});

it("the values that are prepared are once each, and reach over the whole slider", () => {
  expect(new Set(blendPs).size).toBe(blendPs.length);
  expect([Math.min(...blendPs), Math.max(...blendPs)]).toEqual([1, 12]);
});
