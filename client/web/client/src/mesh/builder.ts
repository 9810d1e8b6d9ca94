import type { Mesh } from "./mesh.js";
import { FileFault } from "./fault.js";

/** Squares of distances then stay within the range of float32. */
const mostCoordinate = 1e18;

/** Where in a file something stands, or what says so if it is asked for. */
export type Where = string | (() => string);

const told = (where: Where) => (typeof where === "string" ? where : where());

/** Assembles a mesh; polygons become fans of triangles. */
export class MeshBuilder {
  readonly positions: number[] = [];
  readonly faces: number[] = [];
  readonly #corners: number[] = [];
  readonly #beside = new Set<string>();

  /** `most`: the largest number of vertices, and of triangles, that a page can handle. */
  constructor(readonly most = 5_000_000) {}

  get vertexCount(): number {
    return this.positions.length / 3;
  }

  vertex(x: number, y: number, z: number, where: Where): void {
    if (!Number.isFinite(x + y + z)) throw new FileFault(`${told(where)}: a vertex has no three finite coordinates.`);
    if (Math.max(Math.abs(x), Math.abs(y), Math.abs(z)) > mostCoordinate) {
      throw new FileFault(`${told(where)}: a vertex lies farther out than ${mostCoordinate}, which is not drawn.`);
    }
    this.#checkCount(this.vertexCount + 1, "vertices", where);
    this.positions.push(x, y, z);
  }

  polygon(corners: readonly number[], where: Where): void {
    if (corners.length < 3) throw new FileFault(`${told(where)}: a face has ${corners.length} corners.`);
    for (let k = 2; k < corners.length; ++k) this.faces.push(corners[0]!, corners[k - 1]!, corners[k]!);
    this.#corners.push(corners.length);
    this.#checkCount(this.faces.length / 3, "triangles", where);
  }

  /** The file has something that a mesh here cannot hold, described in words. */
  leftAside(what: string): void {
    this.#beside.add(what);
  }

  /** The polygon to which a corner of the triangles belongs. */
  #polygonOf(corner: number): number {
    let [polygon, end] = [0, 0];
    while ((end += 3 * (this.#corners[polygon]! - 2)) <= corner) ++polygon;
    return polygon;
  }

  #checkCount(count: number, what: string, where: Where): void {
    if (count <= this.most) return;
    throw new FileFault(`${told(where)}: this page takes ${this.most.toLocaleString("en")} ${what} at most.`);
  }

  /** `faceAt`: how to name a polygon of the file, by its index from 0; without it, by that index. */
  finish(name: string, faceAt = (polygon: number) => `Face ${polygon} of ${name}`): Mesh {
    if (this.vertexCount === 0) throw new FileFault(`${name} has no vertices.`);
    if (this.faces.length === 0) throw new FileFault(`${name} has no faces: a cloud of points cannot be deformed.`);
    for (let k = 0; k < this.faces.length; ++k) {
      const vertex = this.faces[k]!;
      if (Number.isInteger(vertex) && vertex >= 0 && vertex < this.vertexCount) continue;
      const has = Number.isInteger(vertex) ? ` has vertex ${vertex}` : " has a corner that is no whole number";
      throw new FileFault(
        `${faceAt(this.#polygonOf(k))}${has}; there are ${this.vertexCount} vertices, counted from 0.`,
      );
    }
    const faces = Uint32Array.from(this.faces);
    const positions = Float32Array.from(this.positions);
    const isExact = this.positions.every((value, k) => value === positions[k]);
    const hasPolygons = this.#corners.some((count) => count !== 3);
    return {
      name,
      positions,
      faces,
      ...(!isExact && { exact: Float64Array.from(this.positions) }),
      ...(hasPolygons && { corners: Uint32Array.from(this.#corners) }),
      ...(this.#beside.size > 0 && { beside: [...this.#beside] }),
    };
  }
}
