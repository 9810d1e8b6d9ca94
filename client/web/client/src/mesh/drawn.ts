import type { Mesh } from "./mesh.js";
import { findNormal, normal } from "./normals.js";
import { Pairs } from "./pairs.js";

/** The vertices to draw for a mesh: split where faces meet at an edge that is sharp at rest, so that hard edges stay hard. */
export interface Drawn {
  /** The mesh's vertex for each drawn vertex. */
  source: Uint32Array;
  /** Three drawn vertices per face. */
  indices: Uint32Array;
  /**
   * `indices` without the faces that a later face lies over with the same vertices in the same turn. If there are none, it is `indices`
   * itself.
   */
  once: Uint32Array;
  /** Whether every edge has a face on either side. */
  isClosed: boolean;
}

/** Corners around a vertex belong together if they are joined by edges that are not sharp. */
export function drawnOf({ positions, faces }: Pick<Mesh, "positions" | "faces">, sharpDegrees = 40): Drawn {
  const leastCosine = Math.cos((sharpDegrees * Math.PI) / 180);
  const normals = faceNormals(positions, faces);
  const parents = Uint32Array.from({ length: faces.length }, (_, corner) => corner);
  const root = (corner: number) => {
    while (parents[corner] !== corner) corner = parents[corner] = parents[parents[corner]!]!;
    return corner;
  };
  const join = (a: number, b: number) => (parents[root(a)] = root(b));
  const edges = new Pairs(faces.length); // for a directed edge: the corner at which it begins
  for (let corner = 0; corner < faces.length; ++corner) edges.set(faces[corner]!, faces[nextCorner(corner)]!, corner);
  let isClosed = edges.size === faces.length;
  for (let corner = 0; corner < faces.length; ++corner) {
    const next = nextCorner(corner);
    const other = edges.get(faces[next]!, faces[corner]!);
    if (other < 0) isClosed = false;
    if (other < 0 || other > corner) continue;
    const [f, g] = [3 * Math.floor(corner / 3), 3 * Math.floor(other / 3)];
    const cosine = normals[f]! * normals[g]! + normals[f + 1]! * normals[g + 1]! + normals[f + 2]! * normals[g + 2]!;
    if (cosine < leastCosine) continue;
    join(corner, nextCorner(other));
    join(next, other);
  }
  const drawn = new Int32Array(faces.length).fill(-1);
  const source: number[] = [];
  const indices = new Uint32Array(faces.length);
  for (let corner = 0; corner < faces.length; ++corner) {
    const top = root(corner);
    if (drawn[top]! < 0) {
      drawn[top] = source.length;
      source.push(faces[corner]!);
    }
    indices[corner] = drawn[top]!;
  }
  const isRepeated = edges.size < faces.length; // else no two faces have a directed edge in common
  return { source: Uint32Array.from(source), indices, once: isRepeated ? onceOf(indices, faces) : indices, isClosed };
}

/** The corners in `indices` of faces that no later one is like. */
function onceOf(indices: Uint32Array, faces: Uint32Array): Uint32Array {
  const edges = new Pairs(faces.length / 3); // for the edge from a face's least vertex: the last such face
  const known = new Pairs(faces.length / 3); // for that face and the third vertex: any face
  const once = new Uint32Array(indices.length);
  let begin = indices.length;
  for (let face = faces.length / 3 - 1; face >= 0; --face) {
    let least = 3 * face;
    for (const corner of [3 * face + 1, 3 * face + 2]) if (faces[corner]! < faces[least]!) least = corner;
    const next = nextCorner(least);
    const [a, b, c] = [faces[least]!, faces[next]!, faces[nextCorner(next)]!];
    if (edges.get(a, b) < 0) edges.set(a, b, face);
    if (!known.set(edges.get(a, b), c, face)) continue;
    begin -= 3;
    once.set(indices.subarray(3 * face, 3 * face + 3), begin);
  }
  return begin === 0 ? indices : once.slice(begin);
}

function nextCorner(corner: number): number {
  return corner % 3 === 2 ? corner - 2 : corner + 1;
}

function faceNormals(positions: Float32Array, faces: Uint32Array): Float32Array {
  const normals = new Float32Array(faces.length);
  for (let f = 0; f < faces.length; f += 3) {
    findNormal(positions, 3 * faces[f]!, 3 * faces[f + 1]!, 3 * faces[f + 2]!);
    const length = Math.hypot(normal[0]!, normal[1]!, normal[2]!) || 1;
    for (let axis = 0; axis < 3; ++axis) normals[f + axis] = normal[axis]! / length;
  }
  return normals;
}
