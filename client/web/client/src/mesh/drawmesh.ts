import type { DrawnAt } from "../types.js";
import type { Drawn } from "./drawn.js";
import { addNormals } from "./normals.js";

/** `positions`: of the mesh's vertices. */
export function drawnAt(positions: Float32Array, drawn: Drawn): DrawnAt {
  const length = 3 * drawn.source.length;
  const at = { positions: new Float32Array(length), normals: new Float32Array(length) };
  drawInto(at, positions, drawn);
  return at;
}

/** drawnAt() into arrays that are there: two passes over flat arrays. */
export function drawInto(at: DrawnAt, positions: Float32Array, { source, indices }: Drawn): void {
  const { positions: drawn } = at;
  for (let k = 0; k < source.length; ++k) {
    const from = 3 * source[k]!;
    drawn[3 * k] = positions[from]!;
    drawn[3 * k + 1] = positions[from + 1]!;
    drawn[3 * k + 2] = positions[from + 2]!;
  }
  addNormals(drawn, indices, at.normals);
}

/** Spreads one value per vertex of the mesh to the drawn vertices. */
export function spread(values: Float32Array, { source }: Drawn, into: Float32Array): void {
  for (let k = 0; k < source.length; ++k) into[k] = values[source[k]!]!;
}
