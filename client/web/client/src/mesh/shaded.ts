import type { Shaded } from "../types.js";
import type { Derived } from "./derived.js";
import { drawnAt, spread } from "./drawmesh.js";
import { blockBoxes } from "./face_blocks.js";
import type { Mesh } from "./mesh.js";
import { energyStatistics } from "./statistics.js";

/** Positions of a mesh's vertices, and their distortion, which may be empty. */
export interface Surface {
  readonly positions: Float32Array;
  readonly distortion: Float32Array;
}

/** What is drawn of a surface of the mesh, in new arrays. */
export function shadedOf({ positions, distortion }: Surface, mesh: Pick<Mesh, "faces">, derived: Derived): Shaded {
  const { drawn } = derived.shown;
  const values = new Float32Array(distortion.length > 0 ? drawn.source.length : 0);
  if (values.length > 0) spread(distortion, drawn, values);
  return {
    ...drawnAt(positions, drawn),
    distortion: values,
    statistics: energyStatistics(distortion),
    boxes: blockBoxes(positions, mesh.faces, derived.order),
  };
}
