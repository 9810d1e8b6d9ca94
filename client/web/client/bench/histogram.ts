const bits = 11; // of what is told apart
const exact = 2 ** bits; // below, every value has its own bucket
const half = exact / 2;

function bucketOf(value: number): number {
  if (value < exact) return value;
  const shift = Math.floor(Math.log2(value)) + 1 - bits;
  return exact + (shift - 1) * half + (Math.floor(value / 2 ** shift) - half);
}

function largestOf(bucket: number): number {
  if (bucket < exact) return bucket;
  const above = bucket - exact;
  const shift = Math.floor(above / half) + 1;
  return ((above % half) + half + 1) * 2 ** shift - 1;
}

/**
 * Counts of durations in whole microseconds, to three significant digits over all magnitudes, in the way of HdrHistogram: the
 * buckets are those of `lpdeform load`.
 */
export class Histogram {
  readonly #counts = new Map<number, number>();
  count = 0;
  max = 0;
  #sum = 0;

  record(microseconds: number): void {
    const value = Math.max(0, Math.floor(microseconds));
    const bucket = bucketOf(value);
    this.#counts.set(bucket, (this.#counts.get(bucket) ?? 0) + 1);
    this.count += 1;
    this.max = Math.max(this.max, value);
    this.#sum += value;
  }

  add(other: Histogram): void {
    for (const [bucket, count] of other.#counts) this.#counts.set(bucket, (this.#counts.get(bucket) ?? 0) + count);
    this.count += other.count;
    this.max = Math.max(this.max, other.max);
    this.#sum += other.#sum;
  }

  get mean(): number {
    return this.count === 0 ? 0 : this.#sum / this.count;
  }

  /** The smallest value, to within its bucket, that `percent` of all are no larger than; 0 where there is none. */
  percentile(percent: number): number {
    const wanted = Math.max(1, Math.ceil((percent / 100) * this.count));
    let seen = 0;
    for (const [largest, count] of this.buckets()) {
      seen += count;
      if (seen >= wanted) return Math.min(largest, this.max);
    }
    return 0;
  }

  /** The buckets that are not empty: the largest value of each, and how many it has. */
  buckets(): [number, number][] {
    const filled = [...this.#counts].sort(([a], [b]) => a - b);
    return filled.map(([bucket, count]) => [largestOf(bucket), count]);
  }
}
