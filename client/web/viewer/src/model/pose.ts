import type { Motion } from "lpdeform-client";
import type { Vector3 } from "lpdeform-client/mesh/mesh";

/** x, y, z, w of a unit quaternion. */
export type Quaternion = readonly [number, number, number, number];

/** x = R S (p - center) + center + translation, relative to the mesh at rest. */
export interface Pose {
  rotation: Quaternion;
  translation: Vector3;
  center: Vector3;
  /** S: how much larger along the handle's own axes. Left out: 1. */
  scale?: Vector3;
}

export const noRotation: Quaternion = [0, 0, 0, 1];
export const noScale: Vector3 = [1, 1, 1];
export const leastScale = 0.01;
export const mostScale = 100;

export function atRest(center: Vector3): Pose {
  return { rotation: noRotation, translation: [0, 0, 0], center };
}

export function isAtRest({ rotation, translation, scale }: Pose): boolean {
  return Math.abs(rotation[3]) > 1 - 1e-12 && translation.every((value) => value === 0) && !scale;
}

/** The pose with its scale, each factor kept between leastScale and mostScale. */
export function scaled({ scale: _, ...rest }: Pose, scale: Vector3): Pose {
  const [x, y, z] = scale.map((value) => Math.min(Math.max(value, leastScale), mostScale)) as [number, number, number];
  return x === 1 && y === 1 && z === 1 ? rest : { ...rest, scale: [x, y, z] };
}

/** The place to which the middle of the handle moves. */
export function anchorOf({ center, translation }: Pose): Vector3 {
  return add(center, translation);
}

export function axisAngle(rotation: Quaternion): { axis: Vector3; angle: number } {
  const [x, y, z, w] = rotation;
  const length = Math.hypot(x, y, z);
  if (length < 1e-12) return { axis: [0, 0, 1], angle: 0 };
  return { axis: [x / length, y / length, z / length], angle: 2 * Math.atan2(length, w) };
}

export function quaternionOf(axis: Vector3, angle: number): Quaternion {
  const length = Math.hypot(...axis);
  const sine = Math.sin(angle / 2) / length;
  return [axis[0] * sine, axis[1] * sine, axis[2] * sine, Math.cos(angle / 2)];
}

/** Of a pose without scale. */
export function toMotion(pose: Pose): Motion {
  if (isAtRest(pose)) return "fixed";
  return { ...axisAngle(pose.rotation), center: pose.center, translation: pose.translation };
}

export function apply({ rotation, translation, center, scale = noScale }: Pose, point: Vector3): Vector3 {
  return add(add(rotate(rotation, times(scale, subtract(point, center))), center), translation);
}

/** Rotated by `angle` radians about an axis through the present place of its center. */
export function turned(pose: Pose, axis: Vector3, angle: number): Pose {
  return { ...pose, rotation: product(quaternionOf(axis, angle), pose.rotation) };
}

/** The same pose about another center. */
export function about(pose: Pose, center: Vector3): Pose {
  return { ...pose, center, translation: subtract(apply(pose, center), center) };
}

export function add(a: Vector3, b: Vector3): Vector3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/** Number by number. */
export function times(a: Vector3, b: Vector3): Vector3 {
  return [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
}

export function subtract(a: Vector3, b: Vector3): Vector3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/** The inverse. */
export function conjugate([x, y, z, w]: Quaternion): Quaternion {
  return [-x, -y, -z, w];
}

/** The product that applies the second rotation first, normalised so that errors do not accumulate. */
export function product([ax, ay, az, aw]: Quaternion, [bx, by, bz, bw]: Quaternion): Quaternion {
  const [x, y, z] = add(cross([ax, ay, az], [bx, by, bz]), [aw * bx + bw * ax, aw * by + bw * ay, aw * bz + bw * az]);
  const w = aw * bw - ax * bx - ay * by - az * bz;
  const length = Math.hypot(x, y, z, w);
  return [x / length, y / length, z / length, w / length];
}

/** The vector, turned. */
export function rotate([x, y, z, w]: Quaternion, v: Vector3): Vector3 {
  const t = cross([x, y, z], v).map((value) => 2 * value) as unknown as Vector3;
  return add(add(v, [w * t[0], w * t[1], w * t[2]]), cross([x, y, z], t));
}

function cross(a: Vector3, b: Vector3): Vector3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
