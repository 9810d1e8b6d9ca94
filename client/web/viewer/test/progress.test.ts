import { expect, it } from "vitest";
import { Progress } from "../src/model/progress.js";

/** Adds frames whose energies are those of a function of the iteration. */
function solve(progress: Progress, inputSeq: number, iterations: readonly number[], energyAt: (iteration: number) => number) {
  return iterations.map((iteration) => {
    progress.add({ inputSeq, iteration, energy: energyAt(iteration) });
    return progress.left;
  });
}

const steps = (count: number, by = 1) => Array.from({ length: count }, (_, k) => k * by);

it("says what is left of an energy that goes down by a constant factor, whatever its end is", () => {
  for (const end of [0, 5]) {
    const left = solve(new Progress(), 1, steps(40, 2), (k) => end + 3 * 0.93 ** k);
    expect(left[0]).toBe(1);
    for (const k of [10, 20, 39]) expect(left[k]).toBeCloseTo(0.93 ** (2 * k), 2);
  }
});

it("never goes back within a solve, and begins again with the next", () => {
  const progress = new Progress();
  const rough = (k: number) => 1 / (1 + k) + (k % 7 === 0 ? 0.2 : 0);
  const left = solve(progress, 1, steps(60), rough);
  for (let k = 1; k < left.length; ++k) expect(left[k]).toBeLessThanOrEqual(left[k - 1]!);
  expect(left.at(-1)).toBeLessThan(0.7);
  expect(solve(progress, 2, [0], rough)).toEqual([1]);
});

it("stays within 0 and 1 where nothing goes down, and over more frames than it keeps", () => {
  expect(solve(new Progress(), 1, steps(5), () => 3).at(-1)).toBe(1);
  const left = solve(new Progress(), 1, steps(2000), (k) => 0.99 ** k);
  expect(left.every((share) => share >= 0 && share <= 1)).toBe(true);
  expect(left.at(-1)).toBeLessThan(0.001);
});

it("is not taken in by coarse levels, whose frames repeat an energy, nor by the steep beginning after them", () => {
  const progress = new Progress();
  const coarse = [140, 70, 70, 70, 70, 74, 74, 74];
  coarse.forEach((energy, k) => {
    progress.add({ inputSeq: 1, iteration: 20 * k, energy });
    expect(progress.left).toBe(1);
  });
  const [start, end] = [150, 150 + 640];
  const descent = (iteration: number) => 50 + 24 / (1 + (iteration - start) / 8); // goes down ever more slowly
  const still = (iteration: number) => (descent(iteration) - descent(end)) / (74 - descent(end));
  const left: number[] = [];
  for (let iteration = start + 4; iteration < end; iteration += 6) {
    progress.add({ inputSeq: 1, iteration, energy: descent(iteration) });
    left.push(progress.left);
    if (still(iteration) > 0.005) expect(progress.left).toBeGreaterThan(still(iteration) / 5);
  }
  expect(left).toEqual(left.toSorted((a, b) => b - a));
  expect(left.at(-1)).toBeLessThan(0.03);
});
