/** A triangle mesh as flat arrays, in the order of its file. The arrays do not change. */
export interface Mesh {
  name: string;
  /** x, y, z of each vertex, as drawn. */
  positions: Float32Array;
  /** The exact positions of the file if float32 rounds some of them; the server gets these. */
  exact?: Float64Array;
  /** Three vertices per triangle, counter-clockwise seen from outside. */
  faces: Uint32Array;
  /**
   * The number of corners of each face of the file, if some are not triangles: a polygon of n corners is a fan of n - 2
   * triangles about its first corner.
   */
  corners?: Uint32Array;
  /** Other contents of the file, in words: "texture coordinates". */
  beside?: readonly string[];
  /** What of a glTF's scene stays as it is, such as lines, and corners left over, one sentence each. */
  notices?: readonly string[];
  /** The OBJ file itself, so that its other contents can be saved with it. */
  obj?: Uint8Array;
  /** Files that were opened with an OBJ, by name: its MTL and images. */
  materials?: Readonly<Record<string, Blob>>;
  /** The GLB file itself, for the same. */
  gltf?: Uint8Array;
  /** The PLY file itself, if it has other contents, for the same. */
  ply?: Uint8Array;
}

/** A mesh to be written, in the precision of its numbers. */
export interface WrittenMesh extends Pick<Mesh, "corners"> {
  positions: Float32Array | Float64Array;
  faces: Uint32Array;
}

/** The faces of the file, polygon by polygon. */
export function* polygonsOf({ faces, corners }: Pick<Mesh, "faces" | "corners">): Generator<number[]> {
  for (let at = 0, face = 0; at < faces.length; ++face) {
    const count = corners?.[face] ?? 3;
    const polygon = [faces[at]!, faces[at + 1]!];
    for (let k = 2; k < count; ++k, at += 3) polygon.push(faces[at + 2]!);
    yield polygon;
  }
}

export type Vector3 = readonly [number, number, number];

export interface Bounds {
  min: Vector3;
  max: Vector3;
  center: Vector3;
  diagonal: number;
}

/** The bounds of all positions, or of those that faces use. */
export function boundsOf(positions: Float32Array | Float64Array, faces?: Uint32Array): Bounds {
  const min: [number, number, number] = [Infinity, Infinity, Infinity];
  const max: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  const count = faces?.length ?? positions.length / 3;
  for (let k = 0; k < count; ++k) {
    const vertex = faces ? faces[k]! : k;
    for (let axis = 0; axis < 3; ++axis) {
      const value = positions[3 * vertex + axis]!;
      if (value < min[axis]!) min[axis] = value;
      if (value > max[axis]!) max[axis] = value;
    }
  }
  if (count === 0) return { min: [0, 0, 0], max: [0, 0, 0], center: [0, 0, 0], diagonal: 1 };
  const center = min.map((low, axis) => (low + max[axis]!) / 2) as unknown as Vector3;
  return { min, max, center, diagonal: Math.hypot(max[0] - min[0], max[1] - min[1], max[2] - min[2]) || 1 };
}

/** Whether vertices are where the mesh has them, to within the precision of 16-bit frames. */
export function isAtRest(positions: Float32Array, rest: Float32Array, vertices?: readonly number[]): boolean {
  const step = boundsOf(rest).diagonal / 65535;
  const isSame = (at: number) => Math.abs(positions[at]! - rest[at]!) <= step;
  if (!vertices) return rest.every((_, at) => isSame(at));
  return vertices.every((vertex) => [0, 1, 2].every((axis) => isSame(3 * vertex + axis)));
}

/** The mean of some vertices. */
export function centroid(positions: Float32Array, vertices: ArrayLike<number>): Vector3 {
  let x = 0;
  let y = 0;
  let z = 0;
  for (let k = 0; k < vertices.length; ++k) {
    const at = 3 * vertices[k]!;
    x += positions[at]!;
    y += positions[at + 1]!;
    z += positions[at + 2]!;
  }
  const count = Math.max(vertices.length, 1);
  return [x / count, y / count, z / count];
}
