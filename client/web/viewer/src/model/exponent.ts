/** The range of the slider of p. */
export const [leastP, mostP] = [1, 12];

/** `p` plus a step, rounded to hundredths and within the slider's range. */
export function steppedP(p: number, step: number): number {
  return Math.round(Math.min(Math.max(p + step, leastP), mostP) * 100) / 100;
}
