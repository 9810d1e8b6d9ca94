import { boundsOf, type Mesh } from "./mesh.js";
import { Pairs } from "./pairs.js";

/** In shares of the diagonal: what is no farther apart is in one place, as the server has it by default. */
const samePlace = 1e-6;

/**
 * Vertices on open borders that are in one place: files of engines have them where texture coordinates or normals change along a
 * seam. The surface hangs together only where they are taken for one.
 */
export class Seams {
  /** Vertices that are copies of one before them. */
  readonly copyCount: number;
  /** The mesh's, by the first vertex of each place. */
  readonly faces: Uint32Array;
  readonly #members = new Map<number, number[]>();

  /** `groups`: the first vertex that is where the vertex is; itself where it is alone. */
  constructor(
    readonly groups: Uint32Array,
    faces: Uint32Array,
  ) {
    this.faces = faces.map((vertex) => groups[vertex]!);
    let copyCount = 0;
    groups.forEach((first, vertex) => {
      if (first === vertex) return;
      ++copyCount;
      const members = this.#members.get(first);
      if (members) members.push(vertex);
      else this.#members.set(first, [first, vertex]);
    });
    this.copyCount = copyCount;
  }

  /** The vertices with all that are where they are, in their order. */
  withCopies(vertices: readonly number[]): number[] {
    const all = vertices.flatMap((vertex) => this.#members.get(this.groups[vertex]!) ?? [vertex]);
    return [...new Set(all)];
  }
}

/** Nothing where no vertices on borders are in one place. */
export function seamsOf(mesh: Mesh): Seams | undefined {
  const positions = mesh.exact ?? mesh.positions;
  const border = borderVertices(mesh.faces);
  if (border.length === 0) return undefined;
  const groups = Uint32Array.from({ length: positions.length / 3 }, (_, vertex) => vertex);
  const first = (vertex: number) => {
    while (groups[vertex] !== vertex) vertex = groups[vertex] = groups[groups[vertex]!]!;
    return vertex;
  };
  let isAny = false;
  forEachInOnePlace(positions, border, samePlace * boundsOf(mesh.positions, mesh.faces).diagonal, (a, b) => {
    const [low, high] = [first(a), first(b)].sort((one, other) => one - other) as [number, number];
    groups[high] = low;
    isAny = true;
  });
  if (!isAny) return undefined;
  for (let vertex = 0; vertex < groups.length; ++vertex) groups[vertex] = first(vertex);
  return new Seams(groups, mesh.faces);
}

/** Of edges that one face has, rising. */
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

/** Every pair at most `distance` apart, found by cells of space that are much larger than that and yet hardly hold two places. */
function forEachInOnePlace(
  positions: Numbers,
  vertices: readonly number[],
  distance: number,
  found: (a: number, b: number) => void,
): void {
  const size = 1000 * distance;
  const cells = new Map<string, number[]>();
  for (const vertex of vertices) {
    let isThere = false; // exactly: then one of them stands for both, however many there are
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

/** Those that something within `reach` of the vertex may be in. */
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
