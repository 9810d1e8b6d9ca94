import type { Handle } from "./document.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { follow, placesOf } from "./places.js";
import { apply } from "./pose.js";

/** x, y, z of where the handle's pose takes each of its vertices or points. */
export function targetsOf({ vertices, points, pose }: Handle, mesh: Pick<Mesh, "positions" | "exact" | "faces">): Float64Array {
  const { corners, weights } = placesOf(vertices, points, mesh.faces);
  const targets = follow({ corners, weights }, mesh.exact ?? mesh.positions, new Float64Array(corners.length));
  for (let k = 0; k < targets.length; k += 3) {
    targets.set(apply(pose, [targets[k]!, targets[k + 1]!, targets[k + 2]!]), k);
  }
  return targets;
}
