/** The neighbours of each vertex: those of v are neighbours[starts[v]] to neighbours[starts[v + 1] - 1]. */
export interface Adjacency {
  starts: Uint32Array;
  neighbours: Uint32Array;
}

export function adjacencyOf(vertexCount: number, faces: Uint32Array): Adjacency {
  const counts = new Uint32Array(vertexCount + 1);
  for (const vertex of faces) counts[vertex + 1]! += 2;
  for (let v = 0; v < vertexCount; ++v) counts[v + 1]! += counts[v]!;
  const filled = counts.slice();
  const all = new Uint32Array(2 * faces.length);
  for (let f = 0; f < faces.length; f += 3) {
    for (let corner = 0; corner < 3; ++corner) {
      const vertex = faces[f + corner]!;
      all[filled[vertex]!++] = faces[f + ((corner + 1) % 3)]!;
      all[filled[vertex]!++] = faces[f + ((corner + 2) % 3)]!;
    }
  }
  return withoutRepeats(vertexCount, counts, all);
}

function withoutRepeats(vertexCount: number, starts: Uint32Array, all: Uint32Array): Adjacency {
  const kept = new Uint32Array(vertexCount + 1);
  let end = 0;
  for (let v = 0; v < vertexCount; ++v) {
    const own = all.subarray(starts[v]!, starts[v + 1]!).sort();
    let last = -1;
    for (const neighbour of own.slice()) {
      if (neighbour === last || neighbour === v) continue;
      all[end++] = last = neighbour;
    }
    kept[v + 1] = end;
  }
  return { starts: kept, neighbours: all.slice(0, end) };
}

/** The mean length of the edges. */
export function meanEdge({ starts, neighbours }: Adjacency, positions: Float32Array): number {
  let sum = 0;
  for (let v = 0; v + 1 < starts.length; ++v) {
    for (let k = starts[v]!; k < starts[v + 1]!; ++k) sum += distance(positions, v, neighbours[k]!);
  }
  return neighbours.length > 0 ? sum / neighbours.length : 0;
}

/** 0 if there are no edges. */
export function shortestEdge({ starts, neighbours }: Adjacency, positions: Float32Array): number {
  let least = Infinity;
  for (let v = 0; v + 1 < starts.length; ++v) {
    for (let k = starts[v]!; k < starts[v + 1]!; ++k) least = Math.min(least, distance(positions, v, neighbours[k]!));
  }
  return neighbours.length > 0 ? least : 0;
}

export function distance(positions: Float32Array | Float64Array, a: number, b: number): number {
  const dx = positions[3 * a]! - positions[3 * b]!;
  const dy = positions[3 * a + 1]! - positions[3 * b + 1]!;
  const dz = positions[3 * a + 2]! - positions[3 * b + 2]!;
  return Math.sqrt(dx * dx + dy * dy + dz * dz);
}
