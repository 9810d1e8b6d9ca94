import type { Vector3 } from "lpdeform-client/mesh/mesh";
import type { Quaternion } from "./pose.js";

/** The rotation by these degrees about x, then about y, then about z, axes that do not turn along. */
export function fromEuler([x, y, z]: Vector3): Quaternion {
  const [cx, sx] = halfOf(x);
  const [cy, sy] = halfOf(y);
  const [cz, sz] = halfOf(z);
  return [sx * cy * cz - cx * sy * sz, cx * sy * cz + sx * cy * sz, cx * cy * sz - sx * sy * cz, cx * cy * cz + sx * sy * sz];
}

/** The degrees of fromEuler(): x and z from -180 to 180, y from -90 to 90. At y = 90 and -90 they are not unique, and x is 0. */
export function toEuler([x, y, z, w]: Quaternion): Vector3 {
  const sine = 2 * (w * y - z * x);
  if (Math.abs(sine) > 1 - 1e-10) {
    const about = 2 * Math.atan2(z, w);
    return [0, Math.sign(sine) * 90, degrees(Math.atan2(Math.sin(about), Math.cos(about)))];
  }
  return [
    degrees(Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))),
    degrees(Math.asin(sine)),
    degrees(Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))),
  ];
}

/** Cosine and sine of half of the angle. */
function halfOf(angle: number): readonly [number, number] {
  const half = (angle * Math.PI) / 360;
  return [Math.cos(half), Math.sin(half)];
}

function degrees(radians: number): number {
  return (radians * 180) / Math.PI;
}
