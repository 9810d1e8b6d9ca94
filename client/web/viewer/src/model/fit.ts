import { centroid } from "lpdeform-client/mesh/mesh";
import { atRest, type Pose, type Quaternion } from "./pose.js";

/** The rigid motion that best takes the vertices from `rest` to `current` (Horn's quaternion). */
export function fitPose(rest: Float32Array, current: Float32Array, vertices: readonly number[]): Pose {
  const center = centroid(rest, vertices);
  if (rest === current) return atRest(center);
  const to = centroid(current, vertices);
  const s = new Float64Array(9);
  for (const vertex of vertices) {
    for (let i = 0; i < 3; ++i) {
      for (let j = 0; j < 3; ++j) {
        s[3 * i + j]! += (rest[3 * vertex + i]! - center[i]!) * (current[3 * vertex + j]! - to[j]!);
      }
    }
  }
  const [xx, xy, xz, yx, yy, yz, zx, zy, zz] = s as unknown as [
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
  ];
  // In the order w, x, y, z; the rotation is the eigenvector of the largest eigenvalue.
  const n = [
    [xx + yy + zz, yz - zy, zx - xz, xy - yx],
    [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, yy - xx - zz, yz + zy],
    [xy - yx, zx + xz, yz + zy, zz - xx - yy],
  ];
  return {
    center,
    translation: [to[0] - center[0], to[1] - center[1], to[2] - center[2]],
    rotation: isLine(rest, center, vertices) ? [0, 0, 0, 1] : largestEigenvector(n),
  };
}

/** By repeated squaring of the shifted matrix, which makes that direction outgrow the others. */
function largestEigenvector(n: number[][]): Quaternion {
  const shift = Math.max(...n.map((row) => row.reduce((sum, value) => sum + Math.abs(value), 0)));
  let power = n.map((row, i) => row.map((value, j) => value + (i === j ? shift : 0)));
  for (let round = 0; round < 40; ++round) {
    const product = power.map((row) => row.map((_, j) => row.reduce((sum, value, k) => sum + value * power[k]![j]!, 0)));
    const largest = Math.max(...product.flat().map(Math.abs)) || 1;
    power = product.map((row) => row.map((value) => value / largest));
  }
  const [w, x, y, z] = power.reduce((best, row) => (Math.hypot(...row) > Math.hypot(...best) ? row : best)) as [
    number,
    number,
    number,
    number,
  ];
  const length = Math.hypot(w, x, y, z) * (w < 0 ? -1 : 1);
  return length === 0 ? [0, 0, 0, 1] : [x / length, y / length, z / length, w / length];
}

/** Vertices on a line, or fewer than three, do not determine the turn about it. */
function isLine(rest: Float32Array, center: readonly number[], vertices: readonly number[]): boolean {
  const offsets = vertices.map((v) => [0, 1, 2].map((axis) => rest[3 * v + axis]! - center[axis]!));
  const longest = offsets.reduce((best, one) => (Math.hypot(...one) > Math.hypot(...best) ? one : best), [0, 0, 0]) as [
    number,
    number,
    number,
  ];
  const length = Math.hypot(...longest);
  return offsets.every(([x, y, z]) => {
    const across = [y! * longest[2] - z! * longest[1], z! * longest[0] - x! * longest[2], x! * longest[1] - y! * longest[0]];
    return Math.hypot(...across) <= 1e-3 * length * length;
  });
}
