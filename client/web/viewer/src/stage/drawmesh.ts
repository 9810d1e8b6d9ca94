import { type Drawn, drawnOf } from "../model/drawn.js";
import type { Mesh } from "../model/mesh.js";
import { addNormals } from "../model/normals.js";

/** Positions and normals of the vertices to draw for a mesh. A frame is two passes over flat arrays. */
export class DrawMesh implements Drawn {
  readonly source: Uint32Array;
  readonly indices: Uint32Array;
  readonly isClosed: boolean;
  positions: Float32Array;
  normals: Float32Array;

  constructor(
    readonly mesh: Pick<Mesh, "positions" | "faces">,
    { source, indices, isClosed }: Drawn = drawnOf(mesh),
  ) {
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
