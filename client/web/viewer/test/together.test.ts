import { describe, expect, it } from "vitest";
import { addHandle, anchorOfHandle, changeHandle, emptyDocument, handleOf } from "../src/model/document.js";
import { quaternionOf, scaled } from "../src/model/pose.js";
import { posedTogether, selecting, selectionOf, shiftedTogether, toggled } from "../src/model/together.js";

const rest = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 2, 0, 5, 5, 5]);
const document = [0, 1, 2, 3].reduce(
  (made, vertex) => addHandle(made, [vertex], rest, { name: "abcd"[vertex]! }),
  emptyDocument,
);
const all = document.handles;
const anchor = (made: typeof document, name: string) => anchorOfHandle(handleOf(made, name)!);

describe("a selection", () => {
  it("grows and shrinks, and is never without the handle that the panel shows", () => {
    const none = { selected: undefined, alsoSelected: [] };
    const one = toggled(none, "a");
    expect(one).toEqual({ selected: "a", alsoSelected: [] });
    const three = toggled(toggled(one, "b"), "c");
    expect(selectionOf(document, three).map(({ name }) => name)).toEqual(["a", "b", "c"]);
    expect(toggled(three, "b")).toEqual({ selected: "a", alsoSelected: ["c"] });
    expect(toggled(three, "a")).toEqual({ selected: "b", alsoSelected: ["c"] });
    expect(toggled(one, "a")).toEqual(none);
  });

  it("stays where one of it is taken, and is another where another is", () => {
    const two = { selected: "a", alsoSelected: ["b"] };
    expect(selecting(two, "b")).toEqual({ selected: "b", alsoSelected: ["a"] });
    expect(selecting(two, "c")).toEqual({ selected: "c", alsoSelected: [] });
  });

  it("leaves out what is gone", () => {
    expect(selectionOf(document, { selected: "a", alsoSelected: ["gone", "a", "d"] }).map(({ name }) => name)).toEqual([
      "a",
      "d",
    ]);
    expect(selectionOf(document, { selected: "gone", alsoSelected: ["a"] })).toEqual([]);
  });
});

describe("several handles", () => {
  it("are shifted by the same, but for locked ones and those held by their direction alone", () => {
    const locked = changeHandle(changeHandle(document, "b", { isLocked: true }), "c", {
      hold: { kind: "orientation", weight: 1 },
    });
    const moved = shiftedTogether(locked, locked.handles, [1, 2, 3]);
    expect(["a", "b", "c", "d"].map((name) => handleOf(moved, name)!.pose.translation)).toEqual([
      [1, 2, 3],
      [0, 0, 0],
      [0, 0, 0],
      [1, 2, 3],
    ]);
  });

  it("turn about the first as one body, points with places of their own as well", () => {
    const targets = changeHandle(document, "c", { targets: [0, 2, 0] });
    const pose = { ...all[0]!.pose, rotation: quaternionOf([0, 0, 1], Math.PI / 2), translation: [10, 0, 0] } as const;
    const turned = posedTogether(targets, targets.handles.slice(0, 3), pose);
    const expectAt = (name: string, place: readonly number[]) =>
      anchor(turned, name).forEach((value, axis) => expect(value).toBeCloseTo(place[axis]!, 12));
    expectAt("a", [10, 0, 0]);
    expectAt("b", [10, 1, 0]);
    expectAt("c", [8, 0, 0]);
    expectAt("d", [5, 5, 5]);
    expect(handleOf(turned, "b")!.pose.rotation[2]).toBeCloseTo(Math.SQRT1_2, 12);
    expect(posedTogether(document, [], pose)).toBe(document);
  });

  it("grow about the first as one body, along its axes; those that are turned by as much as their own axes do", () => {
    const turned = changeHandle(document, "b", { pose: { ...all[1]!.pose, rotation: quaternionOf([0, 0, 1], Math.PI / 2) } });
    const pose = scaled(all[0]!.pose, [3, 2, 1]);
    const grown = posedTogether(turned, turned.handles.slice(0, 3), pose);
    expect([anchor(grown, "b"), anchor(grown, "c")]).toEqual([
      [3, 0, 0],
      [0, 4, 0],
    ]);
    const scaleOf = (name: string) => handleOf(grown, name)!.pose.scale?.map((value) => Number(value.toFixed(12)));
    expect([scaleOf("a"), scaleOf("b"), scaleOf("c"), scaleOf("d")]).toEqual([[3, 2, 1], [2, 3, 1], [3, 2, 1], undefined]);
    const back = posedTogether(grown, grown.handles.slice(0, 3), all[0]!.pose);
    expect(anchor(back, "c").map((value) => value + 0)).toEqual([0, 2, 0]);
    expect(handleOf(back, "c")!.pose.scale).toBeUndefined();
  });
});
