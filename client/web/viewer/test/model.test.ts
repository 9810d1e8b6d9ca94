import { cornersOf, linesOf, trianglesOf, within } from "../src/model/pointed.js";
import { describe, expect, it } from "vitest";
import { adjacencyOf, meanEdge } from "lpdeform-client/mesh/adjacency";
import { isAlike } from "../src/model/alike.js";
import { colourIn } from "../src/model/palettes.js";
import { fitPose } from "../src/model/fit.js";
import { emptyDocument, paint } from "../src/model/document.js";
import { stepsToKeep } from "../src/model/kept_steps.js";
import { History } from "../src/model/history.js";
import { boundsOf } from "lpdeform-client/mesh/mesh";
import { follow, placesOf } from "../src/model/places.js";
import { add, anchorOf, apply, axisAngle, quaternionOf, subtract, toMotion, turned, type Pose } from "../src/model/pose.js";
import { raycast } from "../src/model/raycast.js";
import { boxPolygon, dab, facing, insidePolygon, project } from "../src/model/selection.js";
import { energyStatistics, histogram, percentile } from "lpdeform-client/mesh/statistics";

/** 4 by 4 vertices, one apart, in the plane z = 0. */
const grid = (() => {
  const positions = new Float32Array(48);
  const faces: number[] = [];
  for (let v = 0; v < 16; ++v) {
    positions.set([v % 4, v >> 2, 0], 3 * v);
    if (v % 4 < 3 && v < 12) faces.push(v, v + 1, v + 4, v + 1, v + 5, v + 4);
  }
  return { positions, faces: Uint32Array.from(faces) };
})();
const adjacency = adjacencyOf(16, grid.faces);

it("places on the surface are vertices, and points inside faces by their weights", () => {
  const places = placesOf([6], [{ face: 1, barycentric: [0.5, 0.25, 0.25] }], grid.faces);
  const bent = grid.positions.map((value, k) => (k % 3 === 2 ? grid.positions[k - 2]! : value)); // z = x
  // Face 1 has the vertices 1, 5 and 4.
  expect([...follow(places, bent)]).toEqual([2, 1, 2, 0.75, 0.5, 0.75]);
});

it("the bounds of a mesh leave out what no face uses", () => {
  const positions = Float32Array.of(0, 0, 0, 2, 0, 0, 0, 1, 0, 9, 9, 9);
  expect(boundsOf(positions, Uint32Array.of(0, 1, 2))).toMatchObject({ max: [2, 1, 0], center: [1, 0.5, 0] });
  expect(boundsOf(positions).max).toEqual([9, 9, 9]);
});

describe("selection", () => {
  it("reaches what hangs together within the radius, and no further", () => {
    const found = dab(grid.positions, adjacency, 5, [1, 1, 0], 1);
    expect(found.sort((a, b) => a - b)).toEqual([1, 4, 5, 6, 9]);
    expect(dab(grid.positions, adjacency, 5, [1, 1, 0], 0)).toEqual([5]);
  });

  it("does not reach another piece close by", () => {
    const positions = Float32Array.from([...grid.positions, ...grid.positions.map((value, k) => (k % 3 === 2 ? 0.01 : value))]);
    const two = adjacencyOf(32, Uint32Array.from([...grid.faces, ...grid.faces.map((vertex) => vertex + 16)]));
    expect(dab(positions, two, 5, [1, 1, 0], 1).every((vertex) => vertex < 16)).toBe(true);
  });

  it("projects as the camera sees it, and leaves out what is behind", () => {
    const lookAlongZ = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, 0, 0]; // w = -z
    const screen = project(Float32Array.of(0, 0, -1, 1, 1, -1, 0, 0, 1), lookAlongZ, 200, 100);
    expect([...screen]).toEqual([100, 50, 200, 0, NaN, NaN]);
  });

  it("takes what lies inside of a polygon, also one with a dent", () => {
    const screen = Float32Array.of(1, 1, 5, 1, 5, 4.5, 9, 9, NaN, NaN);
    expect(insidePolygon(screen, boxPolygon(8, 8, 0, 0))).toEqual([0, 1, 2]);
    expect(insidePolygon(screen, [0, 0, 10, 0, 5, 4, 0, 10])).toEqual([0, 1]);
  });

  it("tells what faces the eye", () => {
    const normals = Float32Array.of(0, 0, 1, 0, 0, -1);
    expect(facing([0, 1], new Float32Array(6), normals, [0, 0, 5])).toEqual([0]);
  });
});

describe("a ray", () => {
  it("meets the nearest face and names its nearest corner", () => {
    const hit = raycast(grid.positions, grid.faces, [1.1, 1.2, 5], [0, 0, -1])!;
    expect(hit.vertex).toBe(5);
    expect(hit.distance).toBeCloseTo(5, 6);
    expect(hit.point[2]).toBeCloseTo(0, 6);
  });

  it("passes beside the surface", () => {
    expect(raycast(grid.positions, grid.faces, [-1, 1, 5], [0, 0, -1])).toBeUndefined();
  });
});

describe("statistics", () => {
  const energies = Float32Array.from({ length: 1000 }, (_, k) => (k * 37) % 1000);
  const sorted = [...energies].sort((a, b) => b - a);

  it("finds the share of the top twentieth as sorting does", () => {
    const exact = sorted.slice(0, 50).reduce((a, b) => a + b) / sorted.reduce((a, b) => a + b);
    expect(energyStatistics(energies).top5Share).toBeCloseTo(exact, 3);
  });

  it("draws the 95th percentile in red, and the largest where most are 0", () => {
    const { red, max } = energyStatistics(energies);
    expect(Math.abs(red - 950)).toBeLessThan(5); // a bin's width near there
    expect(max).toBe(999);
    expect(energyStatistics(Float32Array.from({ length: 100 }, (_, k) => (k === 7 ? 3 : 0)))).toEqual({
      max: 3,
      red: 3,
      top5Share: 1,
    });
  });

  it("knows no distortion", () => {
    expect(energyStatistics(new Float32Array(10))).toEqual({ max: 0, red: 0, top5Share: 0 });
  });

  it("counts every cell in one bin", () => {
    const counts = histogram(energies, 999, 10);
    expect(counts.reduce((a, b) => a + b)).toBe(1000);
    expect(histogram(Float32Array.of(0, 5, 10, 20), 10, 2)).toEqual(Uint32Array.of(1, 3));
  });

  it("has percentiles of few numbers", () => {
    expect(percentile([3, 1, 2], 0.5)).toBe(2);
    expect(percentile([3, 1, 2], 0.99)).toBe(3);
    expect(percentile([], 0.5)).toBeNaN();
  });
});

describe("poses", () => {
  const turn = quaternionOf([1, 2, 3], 2.5);
  const pose = { rotation: turn, center: [1, 1, 1] as const, translation: [0.5, -1, 2] as const };

  it("come back from the positions that they make", () => {
    const rest = Float32Array.from({ length: 30 }, (_, k) => Math.sin(13 * k));
    const current = Float32Array.from(
      Array.from({ length: 10 }, (_, v) => apply(pose, [rest[3 * v]!, rest[3 * v + 1]!, rest[3 * v + 2]!])).flat(),
    );
    const found = fitPose(rest, current, [0, 2, 3, 5, 9]);
    for (let v = 0; v < 10; ++v) {
      const point = apply(found, [rest[3 * v]!, rest[3 * v + 1]!, rest[3 * v + 2]!]);
      point.forEach((value, axis) => expect(value).toBeCloseTo(current[3 * v + axis]!, 5));
    }
  });

  it("do not turn what has no direction to tell", () => {
    const rest = Float32Array.of(0, 0, 0, 1, 0, 0);
    const current = Float32Array.of(0, 0, 5, 0, 1, 5);
    expect(fitPose(rest, current, [0, 1]).rotation).toEqual([0, 0, 0, 1]);
  });

  it("are turned on the spot about an axis of the mesh, and back", () => {
    const once = turned(pose, [0, 0, 1], Math.PI / 2);
    expect(apply(once, pose.center)).toEqual(apply(pose, pose.center));
    const [before, after] = [pose, once].map((one) => subtract(apply(one, add(pose.center, [1, 2, 3])), anchorOf(one)));
    after!.forEach((value, axis) => expect(value).toBeCloseTo([-before![1]!, before![0]!, before![2]!][axis]!, 12));
    let many: Pose = pose;
    for (let k = 0; k < 1000; ++k) many = turned(many, [1, 0, 0], Math.PI / 60);
    for (let k = 0; k < 1000; ++k) many = turned(many, [1, 0, 0], -Math.PI / 60);
    many.rotation.forEach((value, k) => expect(value).toBeCloseTo(pose.rotation[k]!, 12));
  });

  it("are axis and angle to the server, and nothing at rest", () => {
    const { axis, angle } = axisAngle(turn);
    expect(angle).toBeCloseTo(2.5, 12);
    expect(axis[2] / axis[0]).toBeCloseTo(3, 12);
    expect(toMotion({ ...pose, rotation: [0, 0, 0, 1], translation: [0, 0, 0] })).toBe("fixed");
  });
});

describe("history", () => {
  it("tells its steps in the middle of a gesture, which goes on", () => {
    const history = new History(0);
    for (const value of [1, 2]) history.push(value);
    history.undo();
    expect(history.stepsSoFar).toEqual({ past: [0], present: 1, future: [2] });
    history.during(5);
    expect(history.stepsSoFar).toEqual({ past: [0, 1], present: 5, future: [] });
    history.during(6);
    history.end();
    expect(history.steps).toEqual({ past: [0, 1], present: 6, future: [] });
  });

  it("is kept as far back as can be written quickly; what steps share counts once", () => {
    const painted = (value: number) => paint(emptyDocument, "stiffness", [0], value, 100);
    const past = [1, 2, 3, 4, 5].map(painted);
    const present = painted(6);
    expect(stepsToKeep({ past, present, future: [] }, 350).past).toEqual(past.slice(2));
    const shared = past.map((_, k) => ({ ...present, p: k }));
    expect(stepsToKeep({ past: shared, present, future: shared }, 0)).toEqual({ past: shared, present, future: shared });
  });

  it("makes one step of a gesture", () => {
    const history = new History(0);
    for (const value of [1, 2, 3]) history.during(value);
    expect(history.settled).toBe(0);
    history.end();
    expect(history.settled).toBe(3);
    history.push(4);
    expect(history.undo() && history.present).toBe(3);
    expect(history.undo() && history.present).toBe(0);
    expect(history.undo()).toBe(false);
    expect(history.redo() && history.redo() && history.present).toBe(4);
    expect(history.redo()).toBe(false);
  });

  it("forgets what was undone when something new is done", () => {
    const history = new History(0);
    history.push(1);
    history.undo();
    history.push(2);
    expect(history.canRedo).toBe(false);
  });

  it("comes back whole after another one", () => {
    const history = new History(0);
    for (const value of [1, 2, 3]) history.push(value);
    history.undo();
    const { steps } = history;
    history.reset(9);
    history.push(10);
    history.restore(steps);
    expect([history.present, history.canUndo, history.canRedo]).toEqual([2, true, true]);
    expect(history.redo() && history.present).toBe(3);
    expect(history.undo() && history.undo() && history.undo() && history.present).toBe(0);
    expect(steps.past).toEqual([0, 1]);
  });

  it("makes no step of a gesture that is cancelled, and keeps what was undone before it", () => {
    const history = new History({ at: 0 });
    const begin = history.present;
    history.push({ at: 1 });
    history.undo();
    history.during({ at: 2 });
    history.cancel();
    expect([history.present, history.canUndo, history.canRedo]).toEqual([begin, false, true]);
    history.cancel();
    expect(history.present).toBe(begin);
  });

  it("makes no step of a gesture that ends where it began, and keeps a bounded number", () => {
    const history = new History<number>(0, Object.is, 3);
    history.during(1);
    history.during(0);
    history.end();
    expect(history.canUndo).toBe(false);
    for (let k = 1; k < 10; ++k) history.push(k);
    let steps = 0;
    while (history.undo()) ++steps;
    expect(steps).toBe(3);
  });

  it("makes no step of a value that is recreated and says the same", () => {
    const made = (p: number, painted: number) => ({
      p,
      handles: [{ name: "a", vertices: [1, 2] }],
      painted: Float32Array.of(NaN, painted),
    });
    const history = new History(made(1, 2), isAlike);
    const begin = history.present;
    history.push(made(1, 2));
    expect([history.present === begin, history.canUndo]).toEqual([true, false]);
    for (const other of [made(2, 2), made(2, 3), { ...made(2, 3), handles: [] }]) {
      history.push(other);
      expect(history.present).toBe(other);
    }
    expect([history.undo(), history.undo(), history.undo(), history.undo()]).toEqual([true, true, true, false]);
    expect(isAlike({ a: undefined }, { b: undefined })).toBe(false);
  });
});

it("has the colours of the command line's pictures", () => {
  expect(colourIn("blueToRed", 0)).toEqual([38, 70, 200]);
  expect(colourIn("blueToRed", 0.5)).toEqual([90, 195, 95]);
  expect(colourIn("blueToRed", 7)).toEqual([215, 40, 35]);
});

it("knows each neighbour once", () => {
  const { starts, neighbours } = adjacency;
  expect([...neighbours.subarray(starts[5], starts[6])].sort((a, b) => a - b)).toEqual([1, 2, 4, 6, 8, 9]);
  expect(meanEdge(adjacency, grid.positions)).toBeGreaterThan(1);
});

describe("what is pointed out", () => {
  const faces = Uint32Array.of(0, 1, 2, 2, 1, 3);
  const pointed = { vertices: [3], edges: [0, 3], faces: [1] };

  it("has its edges and the sides of its faces as lines, and each corner once", () => {
    expect(linesOf(pointed, faces)).toEqual([0, 3, 2, 1, 1, 3, 3, 2]);
    expect(trianglesOf(pointed, faces)).toEqual([2, 1, 3]);
    expect(cornersOf(pointed, faces)).toEqual([3, 0, 2, 1]);
  });

  it("leaves out what the mesh does not have", () => {
    expect(within({ vertices: [3, 4], edges: [0, 4, 1, 2, 3], faces: [2, 0] }, 4, 2)).toEqual({
      vertices: [3],
      edges: [1, 2],
      faces: [0],
    });
  });
});
