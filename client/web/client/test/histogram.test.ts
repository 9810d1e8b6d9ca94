import { expect, test } from "vitest";
import { Histogram } from "../bench/histogram.js";

function of(...values: number[]): Histogram {
  const histogram = new Histogram();
  values.forEach((value) => histogram.record(value));
  return histogram;
}

test("values are told apart to three digits over all magnitudes", () => {
  for (let value = 1; value < 1e12; value = Math.ceil(value * 1.37)) {
    const [[largest]] = of(value).buckets() as [[number, number]];
    expect(largest).toBeGreaterThanOrEqual(value);
    expect(largest - value).toBeLessThan(Math.max(1, value / 1000));
  }
});

test("percentiles are those of the sorted values", () => {
  const histogram = of(...Array.from({ length: 1000 }, (_, k) => k + 1));
  expect([0, 50, 75, 99, 100].map((percent) => histogram.percentile(percent))).toEqual([1, 500, 750, 990, 1000]);
  expect(histogram.mean).toBe(500.5);
  expect(of().percentile(50)).toBe(0);
});

test("adding is as recording all", () => {
  const sum = of(3, 5_000_000);
  sum.add(of(7, 70_000));
  const all = of(3, 5_000_000, 7, 70_000);
  expect([sum.buckets(), sum.count, sum.max, sum.mean]).toEqual([all.buckets(), all.count, all.max, all.mean]);
});
