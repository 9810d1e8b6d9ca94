import type { SurfacePoint } from "lpdeform-client";

/** Places on a surface, however it is deformed: three vertices for each place, and their weights. */
export interface Places {
  corners: number[];
  weights: number[];
}

/** `faces`: of the mesh that the points are on. */
export function placesOf(vertices: readonly number[], points: readonly SurfacePoint[] | undefined, faces: Uint32Array): Places {
  const corners = vertices.flatMap((vertex) => [vertex, vertex, vertex]);
  const weights = vertices.flatMap(() => [1, 0, 0]);
  for (const { face, barycentric } of points ?? []) {
    corners.push(...faces.subarray(3 * face, 3 * face + 3));
    weights.push(...barycentric);
  }
  return { corners, weights };
}

/** Writes x, y, z of each place to `out`. */
export function follow<Out extends Float32Array | Float64Array = Float32Array>(
  { corners, weights }: Places,
  positions: Float32Array | Float64Array,
  out: Out = new Float32Array(corners.length) as Out,
): Out {
  for (let k = 0; k < corners.length; k += 3) {
    const [a, b, c] = [3 * corners[k]!, 3 * corners[k + 1]!, 3 * corners[k + 2]!];
    const [u, v, w] = [weights[k]!, weights[k + 1]!, weights[k + 2]!];
    for (let axis = 0; axis < 3; ++axis) {
      out[k + axis] = u * positions[a + axis]! + v * positions[b + axis]! + w * positions[c + axis]!;
    }
  }
  return out;
}
