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

/** The closed surface of a box of side x side x height cells, and its vertices at either end. */
export function box(side: number, height: number): { mesh: Mesh; bottom: number[]; top: number[] } {
  const cells = [side, side, height] as const;
  const known = new Map<string, number>();
  const vertices: number[] = [];
  const faces: number[] = [];
  const vertexAt = (at: readonly number[]) => {
    const key = at.join();
    if (!known.has(key)) {
      known.set(key, vertices.length / 3);
      vertices.push(...at);
    }
    return known.get(key)!;
  };
  for (const axis of [0, 1, 2] as const) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    for (const end of [0, cells[axis]]) {
      for (let i = 0; i < cells[u]!; ++i) {
        for (let j = 0; j < cells[v]!; ++j) {
          const corners = [
            [0, 0],
            [1, 0],
            [1, 1],
            [0, 1],
          ].map(([di, dj]) => {
            const at = [0, 0, 0];
            [at[axis], at[u], at[v]] = [end, i + di!, j + dj!];
            return vertexAt(at);
          });
          const [a, b, c, d] = (end === 0 ? corners.reverse() : corners) as [number, number, number, number];
          faces.push(a, b, c, a, c, d);
        }
      }
    }
  }
  const at = (z: number) =>
    Array.from({ length: vertices.length / 3 }, (_, k) => k).filter((k) => vertices[3 * k + 2] === z);
  return { mesh: { vertices, faces }, bottom: at(0), top: at(height) };
}
