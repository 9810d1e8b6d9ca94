import { type Adjacency, distance } from "lpdeform-client/mesh/adjacency";
import { vertexNormals } from "lpdeform-client/mesh/normals";

/** From this turn on, within the size that is asked for, a place counts wholly as a fold: 45 degrees. */
const wholeTurn = Math.PI / 4;

/**
 * How much each vertex lies in a fold, 0 to 1: by how far the surface turns there within `size`, a length; flat places have 0. The
 * edges of folds are soft. `faces`: those of the adjacency. `groups`: for each vertex the one whose neighbours it has, if copies count
 * as one.
 */
export function foldsOf(
  positions: Float32Array,
  faces: Uint32Array,
  adjacency: Adjacency,
  size: number,
  groups?: Uint32Array,
): Float32Array {
  const { starts, neighbours } = adjacency;
  const normals = vertexNormals(positions, faces);
  const count = positions.length / 3;
  const sharp = new Float32Array(count);
  for (let v = 0; v < count; ++v) {
    let sum = 0;
    for (let k = starts[v]!; k < starts[v + 1]!; ++k) {
      const other = neighbours[k]!;
      const far = distance(positions, v, other);
      if (far > 0) sum += angleBetween(normals, v, other) / far;
    }
    const edges = starts[v + 1]! - starts[v]!;
    const share = edges > 0 ? Math.min((sum / edges) * (size / wholeTurn), 1) : 0;
    sharp[v] = share * share * (3 - 2 * share);
  }
  const soft = new Float32Array(count);
  for (let v = 0; v < count; ++v) {
    const one = groups?.[v] ?? v;
    let sum = sharp[one]!;
    for (let k = starts[one]!; k < starts[one + 1]!; ++k) sum += sharp[neighbours[k]!]!;
    soft[v] = sum / (1 + starts[one + 1]! - starts[one]!);
  }
  return soft;
}

function angleBetween(normals: Float32Array, a: number, b: number): number {
  let [dot, aa, bb] = [0, 0, 0];
  for (let axis = 0; axis < 3; ++axis) {
    const [x, y] = [normals[3 * a + axis]!, normals[3 * b + axis]!];
    dot += x * y;
    aa += x * x;
    bb += y * y;
  }
  const length = Math.sqrt(aa * bb);
  return length > 0 ? Math.acos(Math.min(Math.max(dot / length, -1), 1)) : 0;
}
