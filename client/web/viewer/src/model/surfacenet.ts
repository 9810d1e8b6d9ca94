import { adjacencyOf } from "lpdeform-client/mesh/adjacency";
import type { Mesh, Vector3 } from "lpdeform-client/mesh/mesh";

export type Field = (x: number, y: number, z: number) => number;

/**
 * The surface where a field is 0 ("surface nets"); the field is negative inside. There is a vertex in each cell that the
 * surface crosses, and a square for each edge that it crosses. The mesh is then evened out by relaxation within the surface.
 * `resolution`: cells along x.
 */
export function surfaceNet(field: Field, low: Vector3, high: Vector3, resolution: number): Mesh {
  const step = (high[0] - low[0]) / resolution;
  const [nx, ny, nz] = [0, 1, 2].map((axis) => Math.ceil((high[axis]! - low[axis]!) / step) + 1) as [number, number, number];
  const values = new Float32Array(nx * ny * nz);
  for (let z = 0, k = 0; z < nz; ++z) {
    for (let y = 0; y < ny; ++y) {
      for (let x = 0; x < nx; ++x, ++k) values[k] = field(low[0] + x * step, low[1] + y * step, low[2] + z * step);
    }
  }
  const cells = new Map<number, number>();
  const positions: number[] = [];
  const faces: number[] = [];
  const strides = [1, nx, nx * ny] as const;
  const cellVertex = (cell: number) => {
    let vertex = cells.get(cell);
    if (vertex === undefined) {
      vertex = cells.size;
      cells.set(cell, vertex);
      const grid = [cell % nx, Math.floor(cell / nx) % ny, Math.floor(cell / (nx * ny))];
      const middle = crossing(values, cell, strides);
      for (let axis = 0; axis < 3; ++axis) positions.push(low[axis]! + (grid[axis]! + middle[axis]!) * step);
    }
    return vertex;
  };
  for (let z = 1, k; z + 1 < nz; ++z) {
    for (let y = 1; y + 1 < ny; ++y) {
      for (let x = 1; x + 1 < nx; ++x) {
        k = x + nx * (y + ny * z);
        for (let axis = 0; axis < 3; ++axis) {
          const isInside = values[k]! < 0;
          if (isInside === values[k + strides[axis]!]! < 0) continue;
          const u = strides[(axis + 1) % 3]!;
          const v = strides[(axis + 2) % 3]!;
          const around = [k, k - u, k - u - v, k - v].map(cellVertex);
          const [a, b, c, d] = (isInside ? around : around.reverse()) as [number, number, number, number];
          faces.push(a, b, c, a, c, d);
        }
      }
    }
  }
  const mesh = { name: "surface", positions: Float32Array.from(positions), faces: Uint32Array.from(faces) };
  relax(mesh, field, step);
  return mesh;
}

/** The mean of the points where the edges of a cell cross the surface, within the cell. */
function crossing(values: Float32Array, cell: number, strides: readonly [number, number, number]): number[] {
  const sum = [0, 0, 0];
  let count = 0;
  for (let axis = 0; axis < 3; ++axis) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    for (let corner = 0; corner < 4; ++corner) {
      const start = cell + (corner & 1) * strides[u]! + (corner >> 1) * strides[v]!;
      const a = values[start]!;
      const b = values[start + strides[axis]!]!;
      if (a < 0 === b < 0) continue;
      sum[axis]! += a / (a - b);
      sum[u]! += corner & 1;
      sum[v]! += corner >> 1;
      ++count;
    }
  }
  return sum.map((value) => value / count);
}

/** Moves each vertex several times to the mean of its neighbours and back onto the surface. */
function relax({ positions, faces }: Mesh, field: Field, step: number): void {
  const { starts, neighbours } = adjacencyOf(positions.length / 3, faces);
  const next = new Float32Array(positions.length);
  const small = 0.05 * step;
  for (let round = 0; round < 12; ++round) {
    for (let v = 0; v + 1 < starts.length; ++v) {
      const degree = starts[v + 1]! - starts[v]!;
      const mean = [0, 0, 0];
      for (let k = starts[v]!; k < starts[v + 1]!; ++k) {
        for (let axis = 0; axis < 3; ++axis) mean[axis]! += positions[3 * neighbours[k]! + axis]! / degree;
      }
      const [x, y, z] = mean as [number, number, number];
      const value = field(x, y, z);
      const gradient = [
        (field(x + small, y, z) - value) / small,
        (field(x, y + small, z) - value) / small,
        (field(x, y, z + small) - value) / small,
      ];
      const squared = gradient.reduce((sum, part) => sum + part * part, 0) || 1;
      for (let axis = 0; axis < 3; ++axis) next[3 * v + axis] = mean[axis]! - (value * gradient[axis]!) / squared;
    }
    positions.set(next);
  }
}
