import { type Bounds, type Mesh, type Vector3 } from "lpdeform-client/mesh/mesh";
import type { Adjacency } from "lpdeform-client/mesh/adjacency";

/** The plane across which work is done on both sides: by the axis that it cuts, through the middle of the mesh. */
export type Symmetry = "none" | "x" | "y" | "z";

export type MirrorAxis = 0 | 1 | 2;

export const mirrorAxes: Readonly<Record<Exclude<Symmetry, "none">, MirrorAxis>> = { x: 0, y: 1, z: 2 };

const unknown = -2;
const none = -1;

/** Finds for vertices of a mesh at rest those on the other side of a plane through the middle of its bounding box. */
export class Mirror {
  readonly #positions: Float32Array;
  readonly #middle: number;
  /** Also the size of the cells. */
  readonly #reach: number;
  readonly #images: Int32Array;
  /** Vertices by their cells' hashes: those of hash h are #order from #starts[h] to #starts[h + 1]. */
  readonly #starts: Uint32Array;
  readonly #order: Uint32Array;

  /** `reach`: how far from the reflection of a vertex its image may be; above 0. */
  constructor(
    { positions }: Pick<Mesh, "positions">,
    { center }: Pick<Bounds, "center">,
    readonly axis: MirrorAxis,
    reach: number,
    readonly adjacency: Adjacency,
  ) {
    const count = positions.length / 3;
    this.#positions = positions;
    this.#middle = center[axis];
    this.#reach = reach;
    this.#images = new Int32Array(count).fill(unknown);
    const hashes = new Uint32Array(count);
    const hashCount = 2 ** Math.ceil(Math.log2(count + 1));
    this.#starts = new Uint32Array(hashCount + 1);
    for (let vertex = 0, at = 0; vertex < count; ++vertex, at += 3) {
      const hash = this.#hash(this.#cell(positions[at]!), this.#cell(positions[at + 1]!), this.#cell(positions[at + 2]!));
      hashes[vertex] = hash;
      ++this.#starts[hash + 1]!;
    }
    for (let hash = 0; hash < hashCount; ++hash) this.#starts[hash + 1]! += this.#starts[hash]!;
    const next = this.#starts.slice();
    this.#order = new Uint32Array(count);
    for (let vertex = 0; vertex < count; ++vertex) this.#order[next[hashes[vertex]!]!++] = vertex;
  }

  #cell(value: number): number {
    return Math.floor(value / this.#reach);
  }

  #hash(x: number, y: number, z: number): number {
    const mixed = Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791);
    return (mixed >>> 0) & (this.#starts.length - 2);
  }

  /** The point on the other side. */
  reflected(point: Vector3): Vector3 {
    const other = [...point] as [number, number, number];
    other[this.axis] = 2 * this.#middle - other[this.axis];
    return other;
  }

  /** Where a vertex is at rest. */
  placeOf(vertex: number): Vector3 {
    const [x, y, z] = this.#positions.subarray(3 * vertex, 3 * vertex + 3);
    return [x!, y!, z!];
  }

  /** The vector as seen in the mirror. */
  turned(vector: Vector3): Vector3 {
    const other = [...vector] as [number, number, number];
    other[this.axis] = -other[this.axis] || 0;
    return other;
  }

  /** The vertex that is nearest to the vertex's reflection; undefined if none is near. */
  imageOf(vertex: number): number | undefined {
    if (this.#images[vertex] === unknown) this.#images[vertex] = this.#find(vertex);
    const image = this.#images[vertex]!;
    return image === none ? undefined : image;
  }

  #find(vertex: number): number {
    const p = this.#positions;
    const [x, y, z] = this.reflected([p[3 * vertex]!, p[3 * vertex + 1]!, p[3 * vertex + 2]!]);
    const [cx, cy, cz] = [this.#cell(x), this.#cell(y), this.#cell(z)];
    let [nearest, least] = [none, this.#reach * this.#reach];
    for (let neighbour = 0; neighbour < 27; ++neighbour) {
      const dx = (neighbour % 3) - 1;
      const dy = (Math.floor(neighbour / 3) % 3) - 1;
      const dz = Math.floor(neighbour / 9) - 1;
      const hash = this.#hash(cx + dx, cy + dy, cz + dz);
      for (let k = this.#starts[hash]!; k < this.#starts[hash + 1]!; ++k) {
        const at = 3 * this.#order[k]!;
        const far = (p[at]! - x) ** 2 + (p[at + 1]! - y) ** 2 + (p[at + 2]! - z) ** 2;
        if (far < least || (far === least && nearest === none)) [nearest, least] = [at / 3, far];
      }
    }
    return nearest;
  }

  /**
   * The vertices on the other side, and for each of them one of `vertices` that it is the image of. If the mesh is finer there, the
   * images' neighbours belong to them as well, where their own images are among `vertices`.
   */
  imagesOf(vertices: readonly number[]): Map<number, number> {
    const images = new Map<number, number>();
    const own = new Set(vertices);
    for (const vertex of vertices) {
      const image = this.imageOf(vertex);
      if (image !== undefined) images.set(image, vertex);
    }
    const { starts, neighbours } = this.adjacency;
    for (const image of [...images.keys()]) {
      for (let k = starts[image]!; k < starts[image + 1]!; ++k) {
        const beside = neighbours[k]!;
        if (images.has(beside)) continue;
        const back = this.imageOf(beside);
        if (back !== undefined && own.has(back)) images.set(beside, back);
      }
    }
    return images;
  }
}
