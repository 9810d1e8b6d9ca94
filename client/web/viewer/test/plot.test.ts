import { afterEach, expect, it, vi } from "vitest";
import { plotLines } from "../src/ui/plot.js";

afterEach(() => vi.unstubAllGlobals());

/** What is drawn: where lines go, and the boxes of words, of 10 pixels' height. */
function draw(height: number, energies: readonly number[]) {
  const points: [number, number][] = [];
  const words: { text: string; top: number; bottom: number }[] = [];
  const context = {
    lineTo: (x: number, y: number) => points.push([x, y]),
    fillText: (text: string, _: number, y: number) => words.push({ text, top: y - 9, bottom: y + 2 }),
    measureText: (text: string) => ({ width: 6 * text.length }),
  };
  const quiet = new Proxy(context, { get: (known, name) => known[name as "lineTo"] ?? (() => undefined), set: () => true });
  vi.stubGlobal("devicePixelRatio", 1);
  vi.stubGlobal("getComputedStyle", () => ({ getPropertyValue: () => "" }));
  const canvas = { clientWidth: 250, clientHeight: height, getContext: () => quiet } as unknown as HTMLCanvasElement;
  plotLines(canvas, [{ x: energies.map((_, k) => k), y: energies }], [], String);
  return { points, words };
}

it.each([
  ["linear", [3, 2, 2, 3]],
  ["logarithmic", [1000, 1, 1, 1000]],
])("lines do not run through the words of a %s axis", (_, energies) => {
  const { points, words } = draw(90, energies);
  expect([points.length, words.length]).toEqual([4, 2]);
  for (const [, y] of points) for (const { top, bottom } of words) expect(y < top || y > bottom).toBe(true);
  const heights = points.map(([, y]) => y);
  expect(Math.max(...heights) - Math.min(...heights)).toBeGreaterThan(40);
});
