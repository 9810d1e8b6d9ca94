/** What the slider of p goes from and to. */
export const [leastP, mostP] = [1, 10];

/** `p` and a step, to hundredths and within the slider's range. */
export function steppedP(p: number, step: number): number {
  return Math.round(Math.min(Math.max(p + step, leastP), mostP) * 100) / 100;
}
