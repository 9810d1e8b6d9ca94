import { surfaceNet } from "./surfacenet.js";
import type { Mesh, Vector3 } from "lpdeform-client/mesh/mesh";

/** A cone with round ends: from a (radius ra) to b (radius rb). */
interface Limb {
  a: Vector3;
  b: Vector3;
  ra: number;
  rb: number;
}

/** x points forward, y to the left, z up; the feet are near z = 0. */
function limbs(): Limb[] {
  const parts: Limb[] = [
    { a: [-0.24, 0, 0.45], b: [0.02, 0, 0.47], ra: 0.15, rb: 0.135 }, // trunk
    { a: [0.02, 0, 0.47], b: [0.24, 0, 0.48], ra: 0.135, rb: 0.14 },
    { a: [0.28, 0, 0.54], b: [0.46, 0, 0.84], ra: 0.095, rb: 0.066 }, // neck
    { a: [0.47, 0, 0.88], b: [0.66, 0, 0.83], ra: 0.09, rb: 0.055 }, // head
    { a: [-0.32, 0, 0.47], b: [-0.62, 0, 0.4], ra: 0.095, rb: 0.062 }, // tail
    { a: [-0.62, 0, 0.4], b: [-0.93, 0, 0.55], ra: 0.062, rb: 0.044 },
  ];
  for (const side of [-1, 1]) {
    parts.push(
      { a: [0.21, 0.1 * side, 0.42], b: [0.24, 0.15 * side, 0.08], ra: 0.08, rb: 0.056 },
      { a: [0.24, 0.15 * side, 0.065], b: [0.3, 0.155 * side, 0.055], ra: 0.058, rb: 0.048 },
      { a: [-0.23, 0.1 * side, 0.42], b: [-0.27, 0.15 * side, 0.08], ra: 0.09, rb: 0.058 },
      { a: [-0.27, 0.15 * side, 0.065], b: [-0.21, 0.155 * side, 0.055], ra: 0.058, rb: 0.048 },
      { a: [0.46, 0.045 * side, 0.95], b: [0.43, 0.085 * side, 1.03], ra: 0.045, rb: 0.03 }, // ear
    );
  }
  return parts;
}

/** About 0.78 resolution^2 vertices. A closed surface, blended from limbs so that it is smooth everywhere. */
export function creature(resolution: number): Mesh {
  const parts = limbs();
  const width = 0.02;
  const field = (x: number, y: number, z: number) => {
    let sum = 0;
    for (const part of parts) sum += Math.exp(-distanceTo(part, x, y, z) / width);
    return sum > 0 ? -width * Math.log(sum) : 1;
  };
  return { ...surfaceNet(field, [-1.05, -0.3, -0.06], [0.8, 0.3, 1.12], resolution), name: "creature" };
}

function distanceTo({ a, b, ra, rb }: Limb, x: number, y: number, z: number): number {
  const [dx, dy, dz] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
  const [px, py, pz] = [x - a[0], y - a[1], z - a[2]];
  const along = Math.min(Math.max((px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz), 0), 1);
  const [qx, qy, qz] = [px - along * dx, py - along * dy, pz - along * dz];
  return Math.sqrt(qx * qx + qy * qy + qz * qz) - (ra + along * (rb - ra));
}
