import type { Adjacency } from "lpdeform-client/mesh/adjacency";

/**
 * The vertices within `radius` of `point` that are connected to `seed` within it, `seed` first. So a brush does not reach
 * through a thin sheet to its other side.
 */
export function dab(
  positions: Float32Array,
  { starts, neighbours }: Adjacency,
  seed: number,
  point: readonly number[],
  radius: number,
): number[] {
  const found = [seed];
  const seen = new Set(found);
  for (let next = 0; next < found.length; ++next) {
    const vertex = found[next]!;
    for (let k = starts[vertex]!; k < starts[vertex + 1]!; ++k) {
      const neighbour = neighbours[k]!;
      if (seen.has(neighbour)) continue;
      seen.add(neighbour);
      const at = 3 * neighbour;
      const dx = positions[at]! - point[0]!;
      const dy = positions[at + 1]! - point[1]!;
      const dz = positions[at + 2]! - point[2]!;
      if (dx * dx + dy * dy + dz * dz <= radius * radius) found.push(neighbour);
    }
  }
  return found;
}

/** Column by column, as in three.js. */
export type Matrix4 = ArrayLike<number>;

/** x and y of each vertex in pixels from the upper left corner; NaN behind the camera. */
export function project(positions: Float32Array, viewProjection: Matrix4, width: number, height: number): Float32Array {
  const m = viewProjection;
  const screen = new Float32Array((positions.length / 3) * 2);
  for (let k = 0, s = 0; k < positions.length; k += 3, s += 2) {
    const x = positions[k]!;
    const y = positions[k + 1]!;
    const z = positions[k + 2]!;
    const w = m[3]! * x + m[7]! * y + m[11]! * z + m[15]!;
    if (w <= 0) {
      screen[s] = screen[s + 1] = NaN;
      continue;
    }
    screen[s] = ((m[0]! * x + m[4]! * y + m[8]! * z + m[12]!) / w + 1) * 0.5 * width;
    screen[s + 1] = (1 - (m[1]! * x + m[5]! * y + m[9]! * z + m[13]!) / w) * 0.5 * height;
  }
  return screen;
}

/** Vertices whose pixels lie in the polygon (x and y in turn; even-odd rule). */
export function insidePolygon(screen: Float32Array, polygon: readonly number[]): number[] {
  const found: number[] = [];
  for (let v = 0; 2 * v < screen.length; ++v) {
    if (isInside(screen[2 * v]!, screen[2 * v + 1]!, polygon)) found.push(v);
  }
  return found;
}

function isInside(x: number, y: number, polygon: readonly number[]): boolean {
  let inside = false;
  for (let k = 0, before = polygon.length - 2; k < polygon.length; before = k, k += 2) {
    const y1 = polygon[k + 1]!;
    const y0 = polygon[before + 1]!;
    if (y1 > y === y0 > y) continue;
    if (x < polygon[k]! + ((y - y1) * (polygon[before]! - polygon[k]!)) / (y0 - y1)) inside = !inside;
  }
  return inside;
}

export function boxPolygon(x0: number, y0: number, x1: number, y1: number): number[] {
  return [x0, y0, x1, y0, x1, y1, x0, y1];
}

/** The vertices whose normals point towards the camera. */
export function facing(
  vertices: readonly number[],
  positions: Float32Array,
  normals: Float32Array,
  eye: readonly number[],
): number[] {
  return vertices.filter((v) => {
    let dot = 0;
    for (let axis = 0; axis < 3; ++axis) dot += normals[3 * v + axis]! * (eye[axis]! - positions[3 * v + axis]!);
    return dot > 0;
  });
}
