import { describe, expect, it } from "vitest";
import { adjacencyOf } from "lpdeform-client/mesh/adjacency";
import { addHandle, changeHandle, type Document, emptyDocument, handleOf, removeHandle } from "../src/model/document.js";
import { boundsOf, type Vector3 } from "lpdeform-client/mesh/mesh";
import { Mirror } from "../src/model/mirror.js";
import { apply, quaternionOf } from "../src/model/pose.js";
import { partnerOf, symmetric } from "../src/model/symmetric.js";

// A grid of 5 x 3 vertices, 2 apart in x and 1 in y: x = 3 to 11, so x = 7 is the plane.
const columns = 5;
const place = (vertex: number): Vector3 => [3 + 2 * (vertex % columns), Math.floor(vertex / columns), 0.25];
const positions = Float32Array.from(Array.from({ length: 15 }, (_, vertex) => [...place(vertex)]).flat());
const faces = new Uint32Array(
  [0, 1].flatMap((row) =>
    [0, 1, 2, 3].flatMap((column) => {
      const a = row * columns + column;
      return [a, a + 1, a + columns + 1, a, a + columns + 1, a + columns];
    }),
  ),
);
const mirror = new Mirror({ positions }, boundsOf(positions), 0, 1.5, adjacencyOf(15, faces));
const left = addHandle(emptyDocument, [0, 5], positions, { name: "left" });
const both = addHandle(addHandle(left, [9, 4], positions, { name: "right" }), [2, 7], positions, { name: "middle" });
const pose = {
  ...handleOf(both, "left")!.pose,
  rotation: quaternionOf([1, 2, 3], 0.7),
  translation: [0.3, -0.2, 0.5] as const,
};
const change = (document: Document, name: string, part: object, leading: string[] = []) =>
  symmetric(document, changeHandle(document, name, part), mirror, leading);

function expectClose(a: Vector3, b: Vector3): void {
  a.forEach((value, axis) => expect(value).toBeCloseTo(b[axis]!, 10));
}

describe("a mirror", () => {
  it("finds the vertices on the other side, and those on the plane where they are", () => {
    expect([0, 1, 2, 8, 14].map((vertex) => mirror.imageOf(vertex))).toEqual([4, 3, 2, 6, 10]);
    expect([...mirror.imagesOf([0, 5])]).toEqual([
      [4, 0],
      [9, 5],
    ]);
  });

  it("has no image for what has nothing on its other side", () => {
    const lonely = Float32Array.from([...positions, -20, 0, 0]);
    const other = new Mirror({ positions: lonely }, boundsOf(positions), 0, 1.5, adjacencyOf(16, faces));
    expect(other.imageOf(15)).toBeUndefined();
    expect(other.imageOf(0)).toBe(4);
  });

  it("takes every vertex of a side that is finer", () => {
    const finer = Float32Array.from([0, 0, 0, 10, 0, 0, 10, 0.4, 0, 10, -0.4, 0]);
    const joined = adjacencyOf(4, new Uint32Array([1, 2, 3]));
    const uneven = new Mirror({ positions: finer }, boundsOf(finer), 0, 1, joined);
    expect([...uneven.imagesOf([0]).keys()].sort()).toEqual([1, 2, 3]);
  });
});

describe("symmetric work", () => {
  it("knows which handles are partners", () => {
    const partner = (name: string) => partnerOf(both.handles, handleOf(both, name)!, mirror)?.name;
    expect(["left", "right", "middle"].map(partner)).toEqual(["right", "left", "middle"]);
    expect(partnerOf(left.handles, left.handles[0]!, mirror)).toBeUndefined();
  });

  it("moves the partner to the reflection of where the handle moves each point", () => {
    const after = change(both, "left", { pose });
    const other = handleOf(after, "right")!.pose;
    expect(other.center).toEqual(handleOf(both, "right")!.pose.center);
    for (const vertex of [0, 5]) {
      const image = place(mirror.imageOf(vertex)!);
      expectClose(apply(other, image), mirror.reflected(apply(pose, place(vertex))));
    }
    expect(handleOf(after, "middle")).toBe(handleOf(both, "middle"));
  });

  it("keeps a handle that is its own partner on the plane", () => {
    const own = handleOf(both, "middle")!.pose;
    const moved = { ...own, rotation: quaternionOf([1, 1, 0], 1), translation: [1, 2, 3] as const };
    const after = handleOf(change(both, "middle", { pose: moved }), "middle")!.pose;
    expect(after.translation).toEqual([0, 2, 3]);
    expect(after.rotation.slice(1, 3)).toEqual([0, 0]);
    expect(Math.hypot(...after.rotation)).toBeCloseTo(1, 12);
  });

  it("does not move a handle on the plane that is only locked", () => {
    const off = changeHandle(both, "middle", { pose: { ...handleOf(both, "middle")!.pose, translation: [1, 2, 3] } });
    const after = handleOf(change(off, "middle", { isLocked: true }), "middle")!;
    expect(after).toMatchObject({ isLocked: true, pose: { translation: [1, 2, 3] } });
  });

  it("lets the selected one of two partners count that have both changed", () => {
    const own = { ...handleOf(both, "right")!.pose, translation: [5, 5, 5] as const };
    const after = symmetric(both, changeHandle(changeHandle(both, "left", { pose }), "right", { pose: own }), mirror, [
      "right",
    ]);
    expect(handleOf(after, "right")!.pose).toBe(own);
    expectClose(handleOf(after, "left")!.pose.translation, [-5, 5, 5]);
  });

  it("reflects places of their own vertex by vertex, whatever the partner had", () => {
    const targets = [1, 2, 3, 4, 5, 6]; // of the vertices 0 and 5
    const after = handleOf(change(both, "left", { targets }), "right")!;
    expect(after.vertices).toEqual([9, 4]);
    expect(after.targets).toEqual([10, 5, 6, 13, 2, 3]); // of the images of 5 and of 0
    // A partner that was given places follows a pose as a whole.
    const placed = changeHandle(both, "right", { targets: [1, 1, 1, 2, 2, 2] });
    const posed = handleOf(change(placed, "left", { pose }), "right")!;
    expect(posed.targets).toBeUndefined();
    for (const vertex of [0, 5]) {
      expectClose(apply(posed.pose, place(mirror.imageOf(vertex)!)), mirror.reflected(apply(pose, place(vertex))));
    }
    // What has no image among the handle's vertices stays where it is.
    const larger = changeHandle(both, "right", { vertices: [9, 4, 14] });
    const partly = handleOf(symmetric(larger, changeHandle(larger, "left", { targets }), mirror, []), "right")!;
    expect(partly.targets!.slice(6)).toEqual([...place(14)]);
    const locked = changeHandle(both, "right", { isLocked: true });
    expect(handleOf(change(locked, "left", { targets }), "right")!.targets).toBeUndefined();
  });

  it("makes places of a handle on the plane alike on both sides", () => {
    const across = addHandle(emptyDocument, [1, 3], positions, { name: "across" });
    const after = handleOf(change(across, "across", { targets: [0, 1, 2, 10, 3, 4] }), "across")!;
    expect(after.targets).toEqual([2, 2, 3, 12, 2, 3]);
  });

  it("holds, locks and deletes on both sides, and does not move what is locked there", () => {
    const held = change(both, "left", { hold: { kind: "planeLock", normal: [1, 2, 0] }, isLocked: true });
    expect(handleOf(held, "right")).toMatchObject({ hold: { kind: "planeLock", normal: [-1, 2, 0] }, isLocked: true });
    const locked = changeHandle(both, "right", { isLocked: true });
    expect(handleOf(change(locked, "left", { pose }), "right")).toMatchObject(handleOf(locked, "right")!);
    const names = (document: Document) => document.handles.map(({ name }) => name);
    expect(names(symmetric(both, removeHandle(both, "left"), mirror, []))).toEqual(["middle"]);
    expect(names(change(both, "left", { name: "arm" }))).toEqual(["arm", "right", "middle"]);
  });
});
