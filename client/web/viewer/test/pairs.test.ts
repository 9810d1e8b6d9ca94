import { expect, it } from "vitest";
import { Pairs } from "lpdeform-client/mesh/pairs";

it("pairs have numbers as a map has them, whatever falls on the same place", () => {
  const count = 5000;
  const pairs = new Pairs(count);
  const map = new Map<string, number>();
  let state = 1;
  const next = (most: number) => (state = (Math.imul(state, 1103515245) + 12345) >>> 0) % most;
  for (let k = 0; k < count; ++k) {
    const [a, b] = [next(60) * 2 ** 20, next(60)];
    expect(pairs.set(a, b, k)).toBe(!map.has(`${a} ${b}`));
    map.set(`${a} ${b}`, k);
  }
  expect(pairs.size).toBe(map.size);
  for (const [key, value] of map) expect(pairs.get(...(key.split(" ").map(Number) as [number, number]))).toBe(value);
  expect(pairs.get(1, 1)).toBe(-1);
  expect(new Pairs(0).get(0, 0)).toBe(-1);
});
