import { describe, expect, it } from "vitest";
import { adjacencyOf } from "lpdeform-client/mesh/adjacency";
import { emptyDocument } from "../src/model/document.js";
import { type Brush, paintSoftly, strengthAt } from "../src/model/soft_paint.js";

/** Vertices 0 to 4 in a strip; each is a neighbour of the next two. */
const count = 5;
const adjacency = adjacencyOf(count, Uint32Array.from([0, 1, 2, 1, 3, 2, 2, 3, 4]));
const document = { ...emptyDocument, p: 2 };
const stroke = (...strengths: number[]) => new Map(strengths.map((strength, vertex) => [vertex, strength] as const));
const paint = (made: typeof document, brush: Brush, ...strengths: number[]) =>
  paintSoftly(made, stroke(...strengths), brush, count, adjacency);
const p = (mode: Brush["mode"], value = 8): Brush => ({ field: "p", mode, value });

describe("a brush", () => {
  it("works wholly everywhere if it is hard, and less and less towards its edge if it is soft", () => {
    expect([0, 0.5, 1].map((share) => strengthAt(share, 0))).toEqual([1, 1, 1]);
    expect([0, 0.5, 0.75, 1, 1.2].map((share) => strengthAt(share, 0.5))).toEqual([1, 1, 0.5, 0, 0]);
    const fall = Array.from({ length: 11 }, (_, k) => strengthAt(k / 10, 1));
    expect(fall).toEqual([...fall].sort((a, b) => b - a));
    expect([fall[0], fall[5], fall[10]]).toEqual([1, 0.5, 0]);
  });
});

describe("painting", () => {
  it("brings the value on, blended by logarithms with the slider's p, and leaves the rest to the slider", () => {
    const { paintedP, isAutomatic } = paint({ ...document, isAutomatic: true }, p("set"), 1, 0.5, 0);
    expect([...paintedP!]).toEqual([8, 4, NaN, NaN, NaN]);
    expect(isAutomatic).toBe(false);
  });

  it("blends with what is painted already", () => {
    const once = paint(document, { field: "stiffness", mode: "set", value: 100 }, 1, 1);
    const twice = paint(once, { field: "stiffness", mode: "set", value: 1 }, 0.5, 0);
    expect(twice.stiffness![0]).toBeCloseTo(10, 5);
    expect([...twice.stiffness!].slice(1)).toEqual([100, 1, 1, 1]);
  });

  it("erases, and nothing is painted once everything is erased", () => {
    const painted = paint(document, p("set"), 1, 1);
    const half = paint(painted, p("erase"), 1, 0.5, 1);
    expect([...half.paintedP!]).toEqual([NaN, 4, NaN, NaN, NaN]);
    expect("paintedP" in paint(painted, p("erase"), 1, 1)).toBe(false);
    expect(paint(document, p("erase"), 1)).toBe(document);
    const stiff = paint(document, { field: "stiffness", mode: "set", value: 3 }, 1);
    expect("stiffness" in paint(stiff, { field: "stiffness", mode: "erase", value: 0 }, 1)).toBe(false);
  });

  it("evens out towards the neighbours, but does not paint where nothing is painted around", () => {
    const painted = paint(document, p("set"), 1);
    const smooth = paint(painted, p("smooth"), 1, 1, 1, 1, 1);
    expect(smooth.paintedP![0]).toBeCloseTo(2, 6); // both neighbours have the slider's 2
    expect(smooth.paintedP![1]).toBeCloseTo((8 * 2 * 2) ** (1 / 3), 5);
    expect(smooth.paintedP![4]).toBeNaN();
    expect(paint(document, p("smooth"), 1)).toBe(document);
  });

  it("evens out copies of a vertex as the vertex itself", () => {
    const split = adjacencyOf(count + 1, Uint32Array.from([0, 1, 2, 1, 3, 2, 2, 3, 4]));
    const groups = Uint32Array.from([0, 1, 2, 3, 4, 0]);
    const both = new Map([
      [0, 1],
      [5, 1],
    ]);
    const painted = paintSoftly(document, both, p("set"), count + 1, split, groups);
    const { paintedP } = paintSoftly(painted, both, p("smooth"), count + 1, split, groups);
    expect(paintedP![5]).toBe(paintedP![0]);
    expect(paintedP![5]).toBeLessThan(8);
  });

  it("does not change the document that it begins with", () => {
    const painted = paint(document, p("set"), 1);
    paint(painted, p("erase"), 1, 1);
    expect(painted.paintedP![0]).toBe(8);
  });
});
