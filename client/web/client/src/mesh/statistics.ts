import type { EnergyStatistics } from "../types.js";

const binCount = 4096;
const bins = new Uint32Array(binCount);
const sums = new Float64Array(binCount);

/**
 * Uses bins, in two passes and without sorting, so it is fast enough for every frame. Percentile and share are off by at most
 * one of 4096 bins.
 */
export function energyStatistics(energies: Float32Array): EnergyStatistics {
  let max = 0;
  let total = 0;
  for (let k = 0; k < energies.length; ++k) {
    const energy = energies[k]!;
    if (energy > max) max = energy;
    total += energy;
  }
  if (!(max > 0)) return { max: 0, red: 0, top5Share: 0 };
  bins.fill(0);
  sums.fill(0);
  // In square roots, because most energies are far below the largest.
  const scale = (binCount - 1) / Math.sqrt(max);
  for (let k = 0; k < energies.length; ++k) {
    const energy = energies[k]!;
    const bin = (Math.sqrt(energy) * scale) | 0;
    ++bins[bin]!;
    sums[bin]! += energy;
  }
  const top = Math.ceil(energies.length / 20);
  let left = top;
  let share = 0;
  let bin = binCount - 1;
  for (; bin >= 0 && left > bins[bin]!; --bin) {
    left -= bins[bin]!;
    share += sums[bin]!;
  }
  const within = bins[bin]! > 0 ? sums[bin]! / bins[bin]! : 0;
  const percentile = bin > 0 ? ((bin + 0.5) / scale) ** 2 : 0;
  return { max, red: percentile > 0 ? Math.min(percentile, max) : max, top5Share: (share + left * within) / total };
}

/** How many energies lie in each of `count` equal bins from 0 to `max`; larger ones count in the last bin. */
export function histogram(energies: Float32Array, max: number, count: number): Uint32Array {
  const counts = new Uint32Array(count);
  const scale = max > 0 ? count / max : 0;
  for (let k = 0; k < energies.length; ++k) ++counts[Math.min((energies[k]! * scale) | 0, count - 1)]!;
  return counts;
}

/** The value that this share of the numbers does not exceed; NaN without numbers. */
export function percentile(numbers: readonly number[], share: number): number {
  if (numbers.length === 0) return NaN;
  const sorted = Float64Array.from(numbers).sort();
  return sorted[Math.max(Math.ceil(share * sorted.length) - 1, 0)]!;
}
