import type { Mesh } from "lpdeform-client/mesh/mesh";

/** An open tube along z, of radius 1 and height `rows`: its first and last column are in one place, as texture coordinates have it. */
export function splitTube(columns: number, rows: number): Mesh {
  const positions: number[] = [];
  const faces: number[] = [];
  for (let row = 0; row <= rows; ++row) {
    for (let column = 0; column <= columns; ++column) {
      const angle = (2 * Math.PI * (column % columns)) / columns;
      positions.push(Math.cos(angle), Math.sin(angle), row);
      if (row === rows || column === columns) continue;
      const [a, b] = [row * (columns + 1) + column, (row + 1) * (columns + 1) + column];
      faces.push(a, a + 1, b + 1, a, b + 1, b);
    }
  }
  return { name: "tube", positions: Float32Array.from(positions), faces: Uint32Array.from(faces) };
}
