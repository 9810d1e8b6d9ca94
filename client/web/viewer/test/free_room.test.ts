import { expect, it } from "vitest";
import { type Box, freeRoom } from "../src/model/free_room.js";

const box = (left: number, top: number, right: number, bottom: number) => ({ left, top, right, bottom });
const page = box(0, 0, 100, 80);
const area = ({ left, top, right, bottom }: Box) => Math.max(right - left, 0) * Math.max(bottom - top, 0);

it("what nothing covers is free, all of it", () => {
  expect(freeRoom(page, [], area)).toEqual(page);
  expect(freeRoom(page, [box(100, 0, 200, 80), box(0, -10, 100, 0)], area)).toEqual(page);
});

it.each([
  [[box(0, 0, 20, 50)], box(20, 0, 100, 80)],
  [[box(80, 10, 100, 70)], box(0, 0, 80, 80)],
  [[box(40, 0, 95, 10)], box(0, 10, 100, 80)],
  [[box(30, 65, 70, 75)], box(0, 0, 100, 65)],
])("of what %j covers, the side is cut off that costs least", (covers, free) => {
  expect(freeRoom(page, covers, area)).toEqual(free);
});

it("a cover that the cut for another has taken away costs nothing more, in whatever order they come", () => {
  const covers = [box(0, 70, 20, 80), box(0, 0, 20, 50), box(90, 0, 100, 8)];
  for (const order of [covers, [...covers].reverse()]) expect(freeRoom(page, order, area)).toEqual(box(20, 8, 100, 80));
});

it("where all is covered, nothing is left", () => {
  expect(freeRoom(page, [box(-1, -1, 101, 81)], area)).toEqual(box(0, 0, 0, 0));
});

it("what is worth most may be the smaller part", () => {
  const tall = ({ left, top, right, bottom }: Box) => Math.min(4 * (right - left), bottom - top);
  expect(freeRoom(page, [box(0, 0, 60, 20)], area)).toEqual(box(0, 20, 100, 80));
  expect(freeRoom(page, [box(0, 0, 60, 20)], tall)).toEqual(box(60, 0, 100, 80));
});
