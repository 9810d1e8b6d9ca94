import { describe, expect, it } from "vitest";
import { addHandle, changeHandle, emptyDocument, handleOf, removeHandle } from "../src/model/document.js";
import { atPose, between, keyPoseOf, played } from "../src/model/key_poses.js";
import { quaternionOf } from "../src/model/pose.js";

const rest = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 2, 0]);
const first = addHandle(addHandle({ ...emptyDocument, p: 1 }, [0], rest, { name: "a" }), [1], rest, { name: "b" });
const turned = { rotation: quaternionOf([0, 0, 1], Math.PI / 2), translation: [2, 0, 0], center: [0, 0, 0] } as const;
const last = { ...changeHandle(first, "a", { pose: turned }), p: 4 };
const [from, to] = [keyPoseOf(first), keyPoseOf(last)];

describe("poses", () => {
  it("have names that are free", () => {
    const one = { ...first, keyPoses: [keyPoseOf(first)] };
    expect([from.name, keyPoseOf(one).name]).toEqual(["Pose 1", "Pose 2"]);
    expect(keyPoseOf({ ...one, keyPoses: [{ ...from, name: "Pose 2" }] }).name).toBe("Pose 1");
  });

  it("come back, where the handles are still there", () => {
    expect(atPose(first, to)).toEqual(last);
    const without = removeHandle(first, "a");
    expect(atPose(without, to).handles).toEqual(without.handles);
  });

  it("are halfway in between, p by its logarithm", () => {
    const { p, handles } = between(first, from, to, 0.5);
    expect(p).toBeCloseTo(2, 12);
    expect(handles[0]!.pose.translation).toEqual([1, 0, 0]);
    expect(handles[0]!.pose.rotation[2]).toBeCloseTo(Math.sin(Math.PI / 8), 12);
    expect(handles[1]).toEqual(first.handles[1]);
  });

  it("turn by the shorter way", () => {
    const far = { ...turned, rotation: quaternionOf([0, 0, 1], (3 * Math.PI) / 2) };
    const { handles } = between(first, from, keyPoseOf(changeHandle(first, "a", { pose: far })), 0.5);
    const { rotation } = handles[0]!.pose;
    expect(Math.abs(rotation[3])).toBeCloseTo(Math.cos(Math.PI / 8), 12); // a quarter back, not three quarters on
    expect(rotation[2] * rotation[3]).toBeLessThan(0);
  });

  it("of places of vertices are in between place by place, and left alone where the vertices are others", () => {
    const held = changeHandle(first, "a", { targets: [0, 0, 0] });
    const moved = keyPoseOf(changeHandle(first, "a", { targets: [4, 0, 2] }));
    expect(handleOf(between(held, keyPoseOf(held), moved, 0.25), "a")!.targets).toEqual([1, 0, 0.5]);
    const more = changeHandle(held, "a", { targets: [0, 0, 0, 1, 1, 1] });
    expect(handleOf(between(more, keyPoseOf(held), moved, 0.5), "a")!.targets).toHaveLength(6);
  });

  it("are played one after the other, and end", () => {
    const document = { ...first, keyPoses: [from, to, from] };
    const x = (seconds: number) => handleOf(played(document, seconds, 2)!, "a")!.pose.translation[0];
    expect([x(0), x(1), x(2), x(3)]).toEqual([0, 1, 2, 1]);
    expect(played(document, 4, 2)).toBeUndefined();
    expect(played(first, 0, 2)).toBeUndefined();
  });
});
