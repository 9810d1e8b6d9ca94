import type { Handle, Mesh } from "../../src/index.js";

/** A flat grid of n by n vertices, one apart, and handles that hold its left edge and its right one. */
export function grid(n: number): { mesh: Mesh; handles: Record<"left" | "right", Handle> } {
  const vertices = new Float32Array(3 * n * n);
  const faces: number[] = [];
  const left: number[] = [];
  const right: number[] = [];
  for (let row = 0; row < n; ++row) {
    left.push(row * n);
    right.push(row * n + n - 1);
    for (let column = 0; column < n; ++column) {
      const vertex = row * n + column;
      vertices.set([column, row, 0], 3 * vertex);
      if (row + 1 === n || column + 1 === n) continue;
      faces.push(vertex, vertex + 1, vertex + n, vertex + 1, vertex + n + 1, vertex + n);
    }
  }
  return { mesh: { vertices, faces }, handles: { left: { vertices: left }, right: { vertices: right } } };
}
