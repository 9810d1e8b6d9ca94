import { expect, it } from "vitest";
import { axisViews, directionOf, viewAfter } from "../src/model/axis_views.js";

it.each([false, true])("views along the axes are six, across each other, and follow each other (y up: %s)", (isYUp) => {
  const directions = axisViews.map((view) => directionOf(view, isYUp));
  expect(new Set(directions.map(String)).size).toBe(6);
  expect(directionOf("top", isYUp)).toEqual(isYUp ? [0, 1, 0] : [0, 0, 1]);
  expect(directionOf("front", isYUp)).toEqual(isYUp ? [0, 0, 1] : [0, -1, 0]);
  axisViews.forEach((view, k) => {
    const [x, y, z] = directionOf(view, isYUp);
    expect(viewAfter([7 * x, 7 * y, 7 * z], isYUp)).toBe(axisViews[(k + 1) % 6]);
  });
});

it("the first follows any other view", () => {
  expect(viewAfter([1, -1, 0.4], false)).toBe("front");
  expect(viewAfter([0, 0, 0], false)).toBe("front");
});
