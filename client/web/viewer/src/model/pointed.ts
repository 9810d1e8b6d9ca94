/** Elements of the mesh that a brush or a warning highlights. */
export interface PointedOut {
  vertices: readonly number[];
  /** Two vertices per edge. */
  edges: readonly number[];
  faces: readonly number[];
}

export const nothing: PointedOut = { vertices: [], edges: [], faces: [] };

export function ofVertices(vertices: readonly number[]): PointedOut {
  return { ...nothing, vertices };
}

/** Without elements that the mesh does not have. */
export function within({ vertices, edges, faces }: PointedOut, vertexCount: number, faceCount: number): PointedOut {
  return {
    vertices: vertices.filter((vertex) => vertex < vertexCount),
    edges: edges.filter((_, k) => edges[k - (k % 2)]! < vertexCount && (edges[k - (k % 2) + 1] ?? Infinity) < vertexCount),
    faces: faces.filter((face) => face < faceCount),
  };
}

/** Three vertices per highlighted face. */
export function trianglesOf({ faces }: PointedOut, meshFaces: Uint32Array): number[] {
  return faces.flatMap((face) => [...meshFaces.subarray(3 * face, 3 * face + 3)]);
}

/** The highlighted edges and the sides of the highlighted faces: two vertices each. */
export function linesOf(pointed: PointedOut, meshFaces: Uint32Array): number[] {
  const corners = trianglesOf(pointed, meshFaces);
  return [...pointed.edges, ...corners.flatMap((corner, k) => [corner, corners[k % 3 === 2 ? k - 2 : k + 1]!])];
}

/** Every vertex of the elements, once. */
export function cornersOf(pointed: PointedOut, meshFaces: Uint32Array): number[] {
  return [...new Set([...pointed.vertices, ...pointed.edges, ...trianglesOf(pointed, meshFaces)])];
}
