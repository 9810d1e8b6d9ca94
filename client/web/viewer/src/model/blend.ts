/** A surface as it is drawn. */
export interface Shape {
  readonly positions: Float32Array;
  readonly distortion: Float32Array;
}

/** The values of p that are prepared, in the order in which they are solved: from 2 down, and then up. */
export const blendPs: readonly number[] = [2, 1.75, 1.5, 1.25, 1.1, 1, 2.5, 3, 4, 6, 8, 12];

/** A shape, and the prepared values of p that it is between; they are the same if it is one of those. */
export interface Blended {
  shape: Shape;
  low: number;
  high: number;
}

/**
 * The shape at p: one of `shapes`, or interpolated by the logarithm of p between its two neighbours. Beyond the least and the
 * largest p it is the shape there. Undefined without shapes.
 */
export function blended(shapes: ReadonlyMap<number, Shape>, p: number): Blended | undefined {
  const known = [...shapes.keys()].sort((a, b) => a - b);
  if (known.length === 0) return undefined;
  const low = known.findLast((one) => one <= p) ?? known[0]!;
  const high = known.find((one) => one >= p) ?? known.at(-1)!;
  const [a, b] = [shapes.get(low)!, shapes.get(high)!];
  if (low >= high) return { shape: shapes.get(Math.min(Math.max(p, known[0]!), known.at(-1)!))!, low: high, high };
  const share = Math.log(p / low) / Math.log(high / low);
  const mix = (from: Float32Array, to: Float32Array) => from.map((value, k) => value + share * (to[k]! - value));
  return { shape: { positions: mix(a.positions, b.positions), distortion: mix(a.distortion, b.distortion) }, low, high };
}
