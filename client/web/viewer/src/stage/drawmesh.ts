import type { Mesh } from "../model/mesh.js";
import { Pairs } from "../model/pairs.js";

/**
 * The vertices to draw for a mesh. They are split where faces meet at an edge that is sharp at rest, so that hard edges stay
 * hard and smooth edges smooth. Made once per mesh; a frame is then two passes over flat arrays.
 */
export class DrawMesh {
  /** The mesh's vertex for each drawn vertex. */
  readonly source: Uint32Array;
  readonly indices: Uint32Array;
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  /** Whether every edge has a face on either side. */
  readonly isClosed: boolean;

  constructor(
    readonly mesh: Mesh,
    sharpDegrees = 40,
  ) {
    const { source, indices, isClosed } = split(mesh, Math.cos((sharpDegrees * Math.PI) / 180));
    this.isClosed = isClosed;
    this.source = source;
    this.indices = indices;
    this.positions = new Float32Array(3 * source.length);
    this.normals = new Float32Array(3 * source.length);
    this.take(mesh.positions);
  }

  /** Takes positions of the mesh's vertices; normals are those of the faces, weighted by area. */
  take(positions: Float32Array): void {
    const { source, positions: drawn } = this;
    for (let k = 0; k < source.length; ++k) {
      const from = 3 * source[k]!;
      drawn[3 * k] = positions[from]!;
      drawn[3 * k + 1] = positions[from + 1]!;
      drawn[3 * k + 2] = positions[from + 2]!;
    }
    addNormals(drawn, this.indices, this.normals);
  }

  /** Spreads one value per vertex of the mesh to the drawn vertices. */
  spread(values: Float32Array, into: Float32Array): void {
    const { source } = this;
    for (let k = 0; k < source.length; ++k) into[k] = values[source[k]!]!;
  }
}

/** The normal of the last face. */
const normal = new Float64Array(3);

/** Of a length of twice the area. `a`, `b` and `c`: where the corners begin in the positions. */
function findNormal(positions: Float32Array, a: number, b: number, c: number): void {
  const ax = positions[a]!;
  const ay = positions[a + 1]!;
  const az = positions[a + 2]!;
  const ux = positions[b]! - ax;
  const uy = positions[b + 1]! - ay;
  const uz = positions[b + 2]! - az;
  const vx = positions[c]! - ax;
  const vy = positions[c + 1]! - ay;
  const vz = positions[c + 2]! - az;
  normal[0] = uy * vz - uz * vy;
  normal[1] = uz * vx - ux * vz;
  normal[2] = ux * vy - uy * vx;
}

/** Not of length 1; the shader normalises them. */
function addNormals(positions: Float32Array, faces: Uint32Array, normals: Float32Array): void {
  normals.fill(0);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f]!;
    const b = 3 * faces[f + 1]!;
    const c = 3 * faces[f + 2]!;
    findNormal(positions, a, b, c);
    const x = normal[0]!;
    const y = normal[1]!;
    const z = normal[2]!;
    normals[a]! += x;
    normals[a + 1]! += y;
    normals[a + 2]! += z;
    normals[b]! += x;
    normals[b + 1]! += y;
    normals[b + 2]! += z;
    normals[c]! += x;
    normals[c + 1]! += y;
    normals[c + 2]! += z;
  }
}

/** Normals of the mesh's own vertices, for picking. */
export function vertexNormals(positions: Float32Array, faces: Uint32Array): Float32Array {
  const normals = new Float32Array(positions.length);
  addNormals(positions, faces, normals);
  return normals;
}

/** Corners around a vertex belong together if they are joined by edges that are not sharp. */
function split({ positions, faces }: Mesh, leastCosine: number): Pick<DrawMesh, "source" | "indices" | "isClosed"> {
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
  return { source: Uint32Array.from(source), indices, isClosed };
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
