import { describe, expect, it } from "vitest";
import { triangulated } from "../src/io/triangulate.js";

type Place = readonly [number, number];

/** In a plane that is askew in space, far from the origin. */
const lifted = (ring: readonly Place[]) =>
  ring.flatMap(([x, y]) => [100 + 0.8 * x - 0.36 * y, 200 + 0.48 * y + 0.6 * x, 300 + 0.8 * y]);
const turnOf = ([a, b, c]: readonly Place[]) => (b![0] - a![0]) * (c![1] - a![1]) - (b![1] - a![1]) * (c![0] - a![0]);
const areaOf = (ring: readonly Place[]) =>
  ring.reduce((sum, [x, y], k) => sum + (x * ring[(k + 1) % ring.length]![1] - y * ring[(k + 1) % ring.length]![0]) / 2, 0);

function trianglesOf(rings: readonly (readonly Place[])[]): Place[][] | undefined {
  const all = rings.flat();
  const corners = triangulated(
    lifted(all),
    rings.map(({ length }) => length),
  );
  if (!corners) return undefined;
  return Array.from({ length: corners.length / 3 }, (_, k) => corners.slice(3 * k, 3 * k + 3).map((corner) => all[corner]!));
}

/** The rings have these triangles, which turn as the outline does, cover all but the holes, and leave out no corner. */
function expectWhole(rings: readonly (readonly Place[])[]): void {
  const triangles = trianglesOf(rings)!;
  const [outline, ...holes] = rings.map(areaOf);
  const sign = Math.sign(outline!);
  for (const one of triangles) expect(sign * turnOf(one)).toBeGreaterThanOrEqual(-1e-9);
  const covered = triangles.reduce((sum, one) => sum + Math.abs(turnOf(one)) / 2, 0);
  expect(covered).toBeCloseTo(Math.abs(outline!) - holes.reduce((sum, hole) => sum + Math.abs(hole), 0), 9);
  expect(triangles.length).toBe(rings.flat().length - 2 + 2 * holes.length);
  const used = new Set(triangles.flat());
  for (const place of rings.flat()) expect(used.has(place)).toBe(true);
}

const square = (x: number, y: number, size: number): Place[] => [
  [x, y],
  [x + size, y],
  [x + size, y + size],
  [x, y + size],
];
const circle = (count: number, radius = 1): Place[] =>
  Array.from({ length: count }, (_, k) => [
    radius * Math.cos((2 * Math.PI * k) / count),
    radius * Math.sin((2 * Math.PI * k) / count),
  ]);
const letter: Place[] = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]; // prettier-ignore
const onBorders: Place[] = [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 3], [2, 3], [1.5, 3], [0, 3], [0, 1]]; // prettier-ignore

describe("a polygon in space", () => {
  it.each<[string, Place[][]]>([
    ["is one triangle", [square(0, 0, 1).slice(1)]],
    ["has a corner that points inwards, at each place of the four", [[[0, 0], [1, 0.9], [2, 0], [1, 3]]]], // prettier-ignore
    ["is hollow", [letter]],
    ["has corners on straight borders", [onBorders]],
    ["has many corners", [circle(500)]],
    ["has a hole", [square(0, 0, 4), square(1, 1, 1)]],
    ["has two holes, in a hollow outline", [letter, square(0.25, 0.25, 0.5), square(0.25, 2.25, 0.5)]],
    ["has a hole with corners on straight borders", [square(-1, -1, 5), onBorders]],
    ["has a hole that touches the outline", [square(0, 0, 4), [[0, 2], [1, 1], [2, 2], [1, 3]]]], // prettier-ignore
  ])("that %s is covered by triangles, however its rings turn and begin", (_, rings) => {
    for (let way = 0; way < 2 ** rings.length; ++way) {
      const turned = rings.map((ring, k) => ((way >> k) & 1 ? [...ring].reverse() : ring));
      for (let first = 0; first < Math.min(rings[0]!.length, 12); ++first) {
        expectWhole(turned.map((ring) => [...ring.slice(first), ...ring.slice(0, first)]));
      }
    }
  });

  it("that ends where it begins has a triangle for the corner that is there twice", () => {
    const closed: Place[] = [...letter, [0, 0]];
    expectWhole([closed]);
  });

  it.each<[string, Place[][]]>([
    ["lies outside", [square(0, 0, 4), square(5, 5, 1)]],
    ["lies outside, at the left", [square(0, 0, 4), square(-5, 1, 1)]],
    ["crosses the outline", [square(0, 0, 4), square(3, 3, 2)]],
    ["is the outline", [square(0, 0, 4), square(0, 0, 4)]],
    ["is larger than the outline", [square(0, 0, 4), square(-1, -1, 6)]],
    ["crosses another one", [square(0, 0, 4), square(1, 1, 1), square(1.5, 1.5, 1)]],
    ["lies in another one", [square(0, 0, 9), square(1, 1, 5), square(2, 2, 1)]],
    ["lies in an outline without area", [[[0, 0], [1, 0], [2, 0], [3, 0]], square(0, 0, 1)]], // prettier-ignore
  ])("is refused with a hole that %s", (_, rings) => {
    expect(trianglesOf(rings)).toBeUndefined();
  });

  it("that crosses itself, or has no area, becomes a fan", () => {
    const star = [0, 2, 4, 1, 3].map((k) => circle(5)[k]!);
    const line: Place[] = [0, 1, 2, 3, 4].map((x) => [x, 2 * x]);
    const point: Place[] = Array.from({ length: 5 }, () => [1, 1]);
    for (const ring of [star, line, point]) {
      expect(triangulated(lifted(ring), [5])).toEqual([0, 1, 2, 0, 2, 3, 0, 3, 4]);
    }
  });
});
