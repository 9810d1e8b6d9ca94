import { describe, expect, test } from "vitest";
import { rigidOf } from "../src/rotation.js";
import type { Motion, Vector3 } from "../src/types.js";
import { begin } from "./harness.js";

/** Rodrigues' formula, column by column. */
function matrixOf([x, y, z]: Vector3, angle: number, [a, b, c]: Vector3): number[] {
  const [s, v] = [Math.sin(angle), 1 - Math.cos(angle)];
  const cosine = Math.cos(angle);
  return [
    ...[x * x * v + cosine, x * y * v + z * s, x * z * v - y * s, 0],
    ...[x * y * v - z * s, y * y * v + cosine, y * z * v + x * s, 0],
    ...[x * z * v + y * s, y * z * v - x * s, z * z * v + cosine, 0],
    ...[a, b, c, 1],
  ];
}

const axes: Vector3[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
  [2 / 3, -1 / 3, 2 / 3],
  [-0.6, 0, 0.8],
];
const angles = [1e-7, 0.3, Math.PI / 2, 3, Math.PI - 1e-9];

describe.each(axes)("a motion about %d, %d, %d", (...axis) => {
  const at = axis as Vector3;
  test.each(angles)("by %d is the same as a matrix", (angle) => {
    const { axis: found, angle: by, translation } = rigidOf({ matrix: matrixOf(at, angle, [1, 2, 3]) });
    expect(translation).toEqual([1, 2, 3]);
    expect(by).toBeCloseTo(angle, 12);
    found!.forEach((value, k) => expect(value).toBeCloseTo(at[k]!, angle < 1e-3 ? 7 : 9));
  });

  test.each(angles)("by %d is the same as a quaternion of any length", (angle) => {
    const quaternion = [...at.map((value) => 5 * value * Math.sin(angle / 2)), 5 * Math.cos(angle / 2)] as never;
    const { axis: found, angle: by, center } = rigidOf({ quaternion, center: [1, 0, 0] });
    expect([center, by]).toEqual([[1, 0, 0], expect.closeTo(angle, 12)]);
    found!.forEach((value, k) => expect(value).toBeCloseTo(at[k]!, 12));
  });
});

test("without a rotation there is none", () => {
  expect(rigidOf({ quaternion: [0, 0, 0, -2], translation: [1, 0, 0] })).toEqual({ translation: [1, 0, 0] });
});

test("both go to the server as axis and angle", async () => {
  const { server, session } = await begin();
  session.setHandle("a", { vertices: [0], motion: { quaternion: [0, 0, 1, 1] } });
  session.setHandle("b", { vertices: [1], motion: { matrix: new Float32Array(matrixOf([0, 0, 1], 1, [0, 4, 0])) } });
  await server.until(() => server.updates.flatMap(({ update }) => update!.handles).length === 2);
  const rigid = server.updates
    .flatMap(({ update }) => update!.handles)
    .map(({ change }) => (change.case === "set" ? change.value.motion!.kind.value : undefined));
  expect(rigid).toMatchObject([
    { axis: { x: 0, y: 0, z: 1 }, angleRadians: expect.closeTo(Math.PI / 2, 12) },
    { axis: { x: 0, y: 0, z: 1 }, angleRadians: expect.closeTo(1, 6), translation: { x: 0, y: 4, z: 0 } },
  ]);
});

const still = matrixOf([0, 0, 1], 0, [0, 0, 0]);
const withEntry = (k: number, value: number) => still.map((one, j) => (j === k ? value : one));
test.each<[string, unknown, string]>([
  ["no turn", { quaternion: [0, 0, 0, 0] }, "not all 0"],
  ["three numbers", { quaternion: [0, 0, 1] }, "four numbers"],
  ["an object", { quaternion: { x: 0, y: 0, z: 0, w: 1 } }, "four numbers"],
  ["nine numbers", { matrix: still.slice(0, 9) }, "16 numbers"],
  ["no number", { matrix: withEntry(0, NaN) }, "16 numbers"],
  ["a scale", { matrix: withEntry(0, 1.001) }, "without scale"],
  ["a mirror", { matrix: withEntry(0, -1) }, "without scale"],
  ["rows for columns", { matrix: withEntry(3, 7) }, "without scale"],
  ["two rotations", { quaternion: [0, 0, 0, 1], angle: 1 }, "quaternion, center, translation"],
  ["a matrix with a center", { matrix: still, center: [0, 0, 0] }, "matrix"],
])("%s is refused by name", async (_, motion, limit) => {
  const { server, session } = await begin();
  const refusal = { code: "invalid_argument", limit: expect.stringContaining(limit) };
  const element = { element: expect.stringContaining('motion of handle "tip"') };
  expect(() => session.move("tip", motion as Motion)).toThrow(expect.objectContaining({ ...refusal, ...element }));
  expect(server.updates).toEqual([]);
});
