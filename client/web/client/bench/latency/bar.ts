import type { Handle, Mesh } from "../../src/index.js";

/** The bar of tests/bench/live/native_drag.cc: 1 x 1 x 5, about so many vertices, and handles that hold its ends. */
export function bar(vertexCount: number): { mesh: Mesh; handles: Record<"base" | "top", Handle> } {
  const cells = Math.max(1, Math.floor(Math.sqrt(vertexCount / 22)));
  const counts = [cells, cells, 5 * cells] as const;
  const vertices: number[] = [];
  const faces: number[] = [];
  const known = new Map<string, number>();
  const at = (corner: readonly number[]): number => {
    const key = corner.join();
    if (!known.has(key)) {
      known.set(key, vertices.length / 3);
      vertices.push(...corner.map((k) => k / cells));
    }
    return known.get(key)!;
  };
  for (const axis of [0, 1, 2] as const) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3] as [0 | 1 | 2, 0 | 1 | 2];
    for (const end of [0, counts[axis]]) {
      const corner = (i: number, j: number) => {
        const place = [0, 0, 0];
        [place[axis], place[u], place[v]] = [end, i, j];
        return at(place);
      };
      for (let i = 0; i < counts[u]; ++i) {
        for (let j = 0; j < counts[v]; ++j) {
          const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
          faces.push(...(end === 0 ? [a, c, b, a, d, c] : [a, b, c, a, c, d]));
        }
      }
    }
  }
  const endAt = (height: number): Handle => {
    const all = Array.from({ length: vertices.length / 3 }, (_, k) => k);
    return { vertices: all.filter((k) => Math.abs(vertices[3 * k + 2]! - height) < 0.01) };
  };
  return { mesh: { vertices: new Float32Array(vertices), faces }, handles: { base: endAt(0), top: endAt(5) } };
}
