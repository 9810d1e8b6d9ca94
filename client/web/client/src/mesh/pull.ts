import { type Adjacency, distance } from "./adjacency.js";

/**
 * How far each vertex goes along with some vertices that are pulled, before the server says: 1 where they are, 0 where others are
 * held and where nothing connects, and in between by the distances along edges, smoothly.
 */
export function pullOf(
  positions: Float32Array,
  adjacency: Adjacency,
  pulled: ArrayLike<number>,
  held: ArrayLike<number>,
): Float32Array {
  const near = distances(positions, adjacency, pulled);
  const far = distances(positions, adjacency, held);
  return near.map((own, vertex) => {
    if (own === Infinity || far[vertex] === 0) return 0;
    if (far[vertex] === Infinity) return 1;
    const share = far[vertex]! / (own + far[vertex]!);
    return share * share * (3 - 2 * share);
  });
}

/** From the nearest of some vertices along edges; infinite where none is connected. */
function distances(
  positions: Float32Array,
  { starts, neighbours }: Adjacency,
  from: ArrayLike<number>,
): Float32Array<ArrayBuffer> {
  const count = starts.length - 1;
  const found = new Float32Array(count).fill(Infinity);
  // A ring of vertices that have come nearer, each at most once: from one wave to the next few come nearer again.
  const ring = new Uint32Array(count + 1);
  const isWaiting = new Uint8Array(count);
  let [head, tail] = [0, 0];
  const come = (vertex: number, far: number) => {
    if (!(far < found[vertex]!)) return;
    found[vertex] = far;
    if (isWaiting[vertex]) return;
    isWaiting[vertex] = 1;
    ring[tail] = vertex;
    tail = tail === count ? 0 : tail + 1;
  };
  for (let k = 0; k < from.length; ++k) come(from[k]!, 0);
  while (head !== tail) {
    const vertex = ring[head]!;
    head = head === count ? 0 : head + 1;
    isWaiting[vertex] = 0;
    for (let k = starts[vertex]!; k < starts[vertex + 1]!; ++k) {
      const next = neighbours[k]!;
      come(next, Math.fround(found[vertex]! + distance(positions, vertex, next)));
    }
  }
  return found;
}
