import { boundsOf, type Mesh } from "./mesh.js";

/** How much more of the surface has to be a flat base along one axis than along the other to decide. */
const leastShare = 0.01;
/** How far from the end a base may be, as a share of the extent. */
const baseDepth = 0.01;

/**
 * Whether a mesh from a file has its y axis up rather than z. What stands has a flat base and no such top; if the shape does not
 * say, the file does: programs write OBJ with y up, and the other formats mostly with z up. In glTF y is up.
 */
export function guessYUp({ name, positions, faces }: Pick<Mesh, "name" | "positions" | "faces">): boolean {
  if (/\.(glb|gltf)$/i.test(name)) return true;
  const [y, z] = [baseShare(positions, faces, 1), baseShare(positions, faces, 2)];
  if (Math.abs(y - z) >= leastShare) return y > z;
  return /\.obj$/i.test(name);
}

/** The share of the area that lies flat at the lower end of the axis, less what lies at the upper end; at least 0. */
function baseShare(positions: Float32Array, faces: Uint32Array, axis: 1 | 2): number {
  const { min, max } = boundsOf(positions, faces);
  const depth = baseDepth * (max[axis] - min[axis]);
  let [low, high, all] = [0, 0, 0];
  for (let k = 0; k < faces.length; k += 3) {
    const corners = [faces[k]!, faces[k + 1]!, faces[k + 2]!] as const;
    const area = areaOf(positions, corners);
    const heights = corners.map((corner) => positions[3 * corner + axis]!);
    all += area;
    if (Math.max(...heights) <= min[axis] + depth) low += area;
    if (Math.min(...heights) >= max[axis] - depth) high += area;
  }
  return all > 0 ? Math.max(low - high, 0) / all : 0;
}

function areaOf(positions: Float32Array, [a, b, c]: readonly [number, number, number]): number {
  const along = (from: number, to: number, axis: number) => positions[3 * to + axis]! - positions[3 * from + axis]!;
  const [ux, uy, uz] = [along(a, b, 0), along(a, b, 1), along(a, b, 2)];
  const [vx, vy, vz] = [along(a, c, 0), along(a, c, 1), along(a, c, 2)];
  return Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
}
