import { distance } from "lpdeform-client/mesh/adjacency";
import type { Mesh } from "lpdeform-client/mesh/mesh";

/** The least length of the edges whose ends are in different places. Infinity if there are none. */
export function leastEdge({ positions, faces }: Pick<Mesh, "positions" | "faces">): number {
  let least = Infinity;
  for (let corner = 0; corner < faces.length; ++corner) {
    const next = corner % 3 === 2 ? corner - 2 : corner + 1;
    const length = distance(positions, faces[corner]!, faces[next]!);
    if (length > 0) least = Math.min(least, length);
  }
  return least;
}
