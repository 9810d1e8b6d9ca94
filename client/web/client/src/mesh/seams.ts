import { LpdeformError } from "../errors.js";
import { type Adjacency, distance } from "./adjacency.js";
import { boundsOf, type Mesh } from "./mesh.js";
import { Pairs } from "./pairs.js";

/**
 * Vertices that are in the same place. Files of game engines have them where texture coordinates or normals
 * change along a seam. The surface holds together only if such vertices count as one.
 */
export class Seams {
  #members: Map<number, number[]> | undefined;

  /**
   * `groups`: for each vertex the first vertex in the same place, which may be the vertex itself. `faces`: those of the mesh, with
   * the first vertex of each place. `copyCount`: how many vertices are copies of an earlier one.
   */
  constructor(
    readonly groups: Uint32Array,
    readonly faces: Uint32Array,
    readonly copyCount = copiesIn(groups),
  ) {}

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

function copiesIn(groups: Uint32Array): number {
  let count = 0;
  for (let vertex = 0; vertex < groups.length; ++vertex) if (groups[vertex] !== vertex) ++count;
  return count;
}

/** The server's own tolerance, and the largest at which it takes groups. */
export const usualTolerance = 1e-6;

/**
 * Undefined if no two vertices are in the same place. `tolerance`: how far apart they may be, as a share of the diagonal. Up to
 * usualTolerance, vertices on open borders are looked at, and each is at most so far from the first of its place, as servers want it
 * of groups. Above, servers find the places themselves, and this finds the same: all vertices are looked at, and what lies
 * between two of them is joined to both. Throws an LpdeformError (WELD_TOO_DENSE) where a server would.
 */
export function seamsOf(mesh: Mesh, tolerance: number): Seams | undefined {
  const positions = mesh.exact ?? mesh.positions;
  const groups = Uint32Array.from({ length: positions.length / 3 }, (_, vertex) => vertex);
  const isAny =
    tolerance > usualTolerance ? joinAll(positions, tolerance, groups) : joinBorders(mesh, tolerance, groups);
  return isAny ? Seams.of(groups, mesh.faces) : undefined;
}

/** What lies near is within this share of the diagonal, and of the mean edge. */
const [nearDiagonal, nearEdge] = [1e-3, 0.1];

/** Among about how many vertices ways are looked for from one to those that lie near it. Beyond, they count as apart. */
const mostOnTheWay = 1000;

/**
 * How many vertices on open borders lie near others there to which no way leads along edges nearby: the surface looks whole there, and
 * tears. `faces`: the mesh's, welded or not; `edge`: the mean edge.
 */
export function looseVertices(mesh: Mesh, faces: Uint32Array, { starts, neighbours }: Adjacency, edge: number): number {
  const positions = mesh.exact ?? mesh.positions;
  const border = borderVertices(faces);
  const { diagonal } = boundsOf(positions, faces);
  const near = Math.min(nearDiagonal * diagonal, nearEdge * edge);
  const places = new Places(positions, near, cellShare * diagonal);
  const joinedTo = (vertex: number) => {
    const joined = new Set([vertex]);
    for (const one of joined) {
      if (joined.size > mostOnTheWay) break;
      for (const next of neighbours.subarray(starts[one]!, starts[one + 1]!)) {
        if (distance(positions, vertex, next) <= 2 * near) joined.add(next);
      }
    }
    return joined;
  };
  const loose = new Set<number>();
  for (const vertex of border) {
    if (places.distances > mostDistances * border.length) break; // that many are near each other
    const others = places.near(vertex);
    const joined = others.length > 0 ? joinedTo(vertex) : undefined;
    for (const other of others) if (!joined!.has(other)) loose.add(vertex).add(other);
    places.add(vertex);
  }
  return loose.size;
}

type Numbers = Float32Array | Float64Array;

function joinBorders(mesh: Mesh, tolerance: number, groups: Uint32Array): boolean {
  const positions = mesh.exact ?? mesh.positions;
  const border = borderVertices(mesh.faces);
  if (border.length === 0) return false;
  const { diagonal } = boundsOf(positions, mesh.faces);
  const places = new Places(positions, tolerance * diagonal, cellShare * diagonal);
  let isAny = false;
  for (const vertex of border) {
    const [first] = places.near(vertex).sort((a, b) => a - b);
    if (first === undefined) places.add(vertex);
    else {
      groups[vertex] = first;
      isAny = true;
    }
  }
  return isAny;
}

function joinAll(positions: Numbers, tolerance: number, groups: Uint32Array): boolean {
  const { diagonal } = boundsOf(positions);
  const places = new Places(positions, tolerance * diagonal, 0);
  const first = (vertex: number) => {
    while (groups[vertex] !== vertex) vertex = groups[vertex] = groups[groups[vertex]!]!;
    return vertex;
  };
  let isAny = false;
  for (let vertex = 0; vertex < groups.length; ++vertex) {
    const near = places.near(vertex);
    for (const other of near) {
      const [a, b] = [first(vertex), first(other)];
      groups[Math.max(a, b)] = Math.min(a, b);
    }
    isAny ||= near.length > 0;
    if (!near.some((other) => distance(positions, vertex, other) === 0)) places.add(vertex);
    if (places.distances > mostDistances * groups.length) throw tooDense(tolerance);
  }
  for (let vertex = 0; vertex < groups.length; ++vertex) groups[vertex] = first(vertex);
  return isAny;
}

/** As servers have it, for each vertex. */
const mostDistances = 1000;

function tooDense(tolerance: number): LpdeformError {
  return new LpdeformError(
    "invalid_argument",
    `Too many different vertices lie within ${tolerance} of the diagonal of each other to be welded by position.`,
    { reason: "WELD_TOO_DENSE", element: "weld tolerance", limit: `tolerance < ${tolerance}` },
  );
}

/** By faces, which are asked for more than once. */
const borders = new WeakMap<Uint32Array, readonly number[]>();

/** The vertices of edges that belong to one face only, ascending. */
function borderVertices(faces: Uint32Array): readonly number[] {
  const before = borders.get(faces);
  if (before) return before;
  const border = findBorder(faces);
  borders.set(faces, border);
  return border;
}

function findBorder(faces: Uint32Array): number[] {
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

/** The least size of cells, as a share of the diagonal: such a cell seldom holds two places of a border. */
const cellShare = 1e-4;

/** Vertices in cells of space that are larger than `distance`. Cells share slots of a table; what is far away is left out by its distance. */
class Places {
  /** How many distances were computed. */
  distances = 0;
  readonly #size: number;
  readonly #newest: Int32Array; // for each slot
  readonly #before: Int32Array; // for each vertex: the one added before it to its slot

  constructor(
    readonly positions: Numbers,
    readonly distance: number,
    leastSize: number,
  ) {
    const count = positions.length / 3;
    this.#size = Math.max(2 * distance, leastSize);
    this.#newest = new Int32Array(2 ** Math.ceil(Math.log2(2 * count + 1))).fill(-1);
    this.#before = new Int32Array(count);
  }

  add(vertex: number): void {
    const [slot] = this.#slotsNear(vertex, 0) as [number];
    this.#before[vertex] = this.#newest[slot]!;
    this.#newest[slot] = vertex;
  }

  /** Those added that are at most `distance` from the vertex; some of them may be there twice. */
  near(vertex: number): number[] {
    const found: number[] = [];
    for (const slot of this.#slotsNear(vertex, this.distance)) {
      for (let other = this.#newest[slot]!; other >= 0; other = this.#before[other]!, ++this.distances) {
        if (distance(this.positions, vertex, other) <= this.distance) found.push(other);
      }
    }
    return found;
  }

  /** The slots of the cells that may hold something within `reach` of the vertex. */
  #slotsNear(vertex: number, reach: number): number[] {
    const slots: number[] = [];
    const [xs, ys, zs] = [0, 1, 2].map((axis) => this.#cellsAlong(this.positions[3 * vertex + axis]!, reach));
    for (const x of xs!) {
      for (const y of ys!) {
        for (const z of zs!) {
          const mixed = Math.imul(x, 0x9e3779b1) ^ Math.imul(y, 0x85ebca6b) ^ Math.imul(z, 0xc2b2ae35);
          slots.push((mixed ^ (mixed >>> 15)) & (this.#newest.length - 1));
        }
      }
    }
    return slots;
  }

  #cellsAlong(value: number, reach: number): number[] {
    const low = Math.floor((value - reach) / this.#size);
    const high = Math.floor((value + reach) / this.#size);
    return low === high ? [low] : [low, high];
  }
}
