import type { Mesh } from "lpdeform-client/mesh/mesh";

/** The boundary of the solid cells among nx x ny x nz unit cells, with two triangles per side and one corner at the origin. */
export function blockSurface(nx: number, ny: number, nz: number, isSolid: (x: number, y: number, z: number) => boolean): Mesh {
  const size = [nx, ny, nz] as const;
  const solid = (cell: readonly number[]) =>
    cell.every((value, axis) => value >= 0 && value < size[axis]!) && isSolid(cell[0]!, cell[1]!, cell[2]!);
  const numbers = new Map<number, number>();
  const positions: number[] = [];
  const faces: number[] = [];
  const vertex = (corner: readonly number[]) => {
    const key = corner[0]! + (nx + 1) * (corner[1]! + (ny + 1) * corner[2]!);
    let number = numbers.get(key);
    if (number === undefined) {
      number = numbers.size;
      numbers.set(key, number);
      positions.push(corner[0]!, corner[1]!, corner[2]!);
    }
    return number;
  };
  for (let z = 0; z < nz; ++z) {
    for (let y = 0; y < ny; ++y) {
      for (let x = 0; x < nx; ++x) {
        if (!solid([x, y, z])) continue;
        for (let axis = 0; axis < 3; ++axis) {
          for (const isFar of [false, true]) {
            const next = [x, y, z];
            next[axis]! += isFar ? 1 : -1;
            if (solid(next)) continue;
            const [a, b, c, d] = cellSide([x, y, z], axis, isFar).map(vertex) as [number, number, number, number];
            // The diagonals alternate, so that no direction is preferred.
            if ((x + y + z) % 2 === 0) faces.push(a, b, c, a, c, d);
            else faces.push(a, b, d, b, c, d);
          }
        }
      }
    }
  }
  return { name: "block", positions: Float32Array.from(positions), faces: Uint32Array.from(faces) };
}

/** The corners of one side of a cell, counter-clockwise from outside. */
function cellSide(cell: readonly number[], axis: number, isFar: boolean): number[][] {
  const [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
  const around = [
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 1],
  ];
  return around.map(([u, v]) => {
    const corner = [...cell];
    corner[axis]! += isFar ? 1 : 0;
    corner[first]! += isFar ? u! : v!;
    corner[second]! += isFar ? v! : u!;
    return corner;
  });
}
