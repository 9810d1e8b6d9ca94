import { boundsOf, type Mesh } from "./mesh.js";
import { Pairs } from "./pairs.js";

/**
 * Vertices on open borders that are in the same place. Files of game engines have them where texture coordinates or normals
 * change along a seam. The surface holds together only if such vertices count as one.
 */
export class Seams {
  /** How many vertices are copies of an earlier one. */
  readonly copyCount: number;
  #members: Map<number, number[]> | undefined;

  /**
   * `groups`: for each vertex the first vertex in the same place, which may be the vertex itself. `faces`: those of the mesh, with
   * the first vertex of each place.
   */
  constructor(
    readonly groups: Uint32Array,
    readonly faces: Uint32Array,
  ) {
    let copyCount = 0;
    for (let vertex = 0; vertex < groups.length; ++vertex) if (groups[vertex] !== vertex) ++copyCount;
    this.copyCount = copyCount;
  }

  static of(groups: Uint32Array, meshFaces: Uint32Array): Seams {
    return new Seams(
      groups,
      meshFaces.map((vertex) => groups[vertex]!),
    );
  }

  /** The vertices and all their copies, in order. */
  withCopies(vertices: readonly number[]): number[] {
    const members = (this.#members ??= this.#findMembers());
    const all = vertices.flatMap((vertex) => members.get(this.groups[vertex]!) ?? [vertex]);
    return [...new Set(all)];
  }

  /** For the first vertex of a place all that are there, where there are several. */
  #findMembers(): Map<number, number[]> {
    const found = new Map<number, number[]>();
    this.groups.forEach((first, vertex) => {
      if (first === vertex) return;
      const members = found.get(first);
      if (members) members.push(vertex);
      else found.set(first, [first, vertex]);
    });
    return found;
  }
}

/**
 * Undefined if no vertices on borders are in the same place. `tolerance`: how far apart they may be, as a share of the diagonal; what
 * lies between two of them is joined to both.
 */
export function seamsOf(mesh: Mesh, tolerance: number): Seams | undefined {
  const positions = mesh.exact ?? mesh.positions;
  const border = borderVertices(mesh.faces);
  if (border.length === 0) return undefined;
  const groups = Uint32Array.from({ length: positions.length / 3 }, (_, vertex) => vertex);
  const first = (vertex: number) => {
    while (groups[vertex] !== vertex) vertex = groups[vertex] = groups[groups[vertex]!]!;
    return vertex;
  };
  let isAny = false;
  const { diagonal } = boundsOf(mesh.positions, mesh.faces);
  forEachInOnePlace(positions, border, tolerance * diagonal, cellShare * diagonal, (a, b) => {
    const [low, high] = [first(a), first(b)].sort((one, other) => one - other) as [number, number];
    groups[high] = low;
    isAny = true;
  });
  if (!isAny) return undefined;
  for (let vertex = 0; vertex < groups.length; ++vertex) groups[vertex] = first(vertex);
  return Seams.of(groups, mesh.faces);
}

/** The vertices of edges that belong to one face only, ascending. */
function borderVertices(faces: Uint32Array): number[] {
  const counts = new Pairs(faces.length); // 1, or 2 for more
  const forEachEdge = (visit: (low: number, high: number) => void) => {
    for (let corner = 0; corner < faces.length; ++corner) {
      const [a, b] = [faces[corner]!, faces[corner % 3 === 2 ? corner - 2 : corner + 1]!];
      visit(Math.min(a, b), Math.max(a, b));
    }
  };
  forEachEdge((low, high) => counts.set(low, high, counts.get(low, high) < 0 ? 1 : 2));
  const border = new Set<number>();
  forEachEdge((low, high) => {
    if (counts.get(low, high) === 1) border.add(low).add(high);
  });
  return [...border].sort((a, b) => a - b);
}

type Numbers = Float32Array | Float64Array;

/** The size of cells, as a share of the diagonal: such a cell seldom holds two places. */
const cellShare = 1e-4;

/** Visits every pair that is at most `distance` apart, using cells of space that are larger than that. */
function forEachInOnePlace(
  positions: Numbers,
  vertices: readonly number[],
  distance: number,
  leastSize: number,
  found: (a: number, b: number) => void,
): void {
  const size = Math.max(2 * distance, leastSize);
  const cells = new Map<string, number[]>();
  for (const vertex of vertices) {
    let isThere = false; // exactly the same place: one vertex stands for all of them
    for (const other of cellsNear(positions, vertex, size, distance).flatMap((cell) => cells.get(cell) ?? [])) {
      const far = distanceBetween(positions, vertex, other);
      if (far <= distance) found(other, vertex);
      isThere ||= far === 0;
    }
    if (isThere) continue;
    const [own] = cellsNear(positions, vertex, size, 0) as [string];
    const inCell = cells.get(own);
    if (inCell) inCell.push(vertex);
    else cells.set(own, [vertex]);
  }
}

/** The cells that may hold something within `reach` of the vertex. */
function cellsNear(positions: Numbers, vertex: number, size: number, reach: number): string[] {
  let cells = [""];
  for (let axis = 0; axis < 3; ++axis) {
    const value = positions[3 * vertex + axis]!;
    const along = new Set([Math.floor((value - reach) / size), Math.floor((value + reach) / size)]);
    cells = cells.flatMap((cell) => [...along].map((step) => `${cell} ${step}`));
  }
  return cells;
}

function distanceBetween(positions: Numbers, a: number, b: number): number {
  return Math.hypot(...[0, 1, 2].map((axis) => positions[3 * a + axis]! - positions[3 * b + axis]!));
}
