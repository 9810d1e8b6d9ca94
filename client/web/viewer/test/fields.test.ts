import { expect, it } from "vitest";
import { fromEuler, toEuler } from "../src/model/euler.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { atRest, type Quaternion, turned } from "../src/model/pose.js";

const distance = (a: Quaternion, b: Quaternion) =>
  Math.min(Math.hypot(...a.map((value, k) => value - b[k]!)), Math.hypot(...a.map((value, k) => value + b[k]!)));
const radians = (degrees: number) => (degrees * Math.PI) / 180;

const angles: Vector3[] = [
  [0, 0, 0],
  [30, 0, 0],
  [0, -40, 0],
  [0, 0, 170],
  [25, 50, -75],
  [-160, 89, 12],
];

it.each(angles)("angles %d, %d and %d turn about x, then y, then z, and come back", (x, y, z) => {
  const one = turned(atRest([0, 0, 0]), [1, 0, 0], radians(x));
  const pose = turned(turned(one, [0, 1, 0], radians(y)), [0, 0, 1], radians(z));
  expect(distance(fromEuler([x, y, z]), pose.rotation)).toBeLessThan(1e-14);
  toEuler(pose.rotation).forEach((angle, k) => expect(angle).toBeCloseTo([x, y, z][k]!, 9));
});

it.each<Vector3>([
  [20, 90, 50],
  [-70, -90, 10],
  [200, 120, -300],
])("angles %d, %d and %d, which are not the only ones of their rotation, give it back", (...angles) => {
  const rotation = fromEuler(angles);
  expect(distance(fromEuler(toEuler(rotation)), rotation)).toBeLessThan(1e-7); // the sine is flat at 90 degrees
});
