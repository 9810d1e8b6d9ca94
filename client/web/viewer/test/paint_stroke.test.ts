import { beforeEach, expect, it, vi } from "vitest";
import { adjacencyOf } from "lpdeform-client/mesh/adjacency";
import { PaintStroke } from "../src/app/paint_stroke.js";
import type { Pane } from "../src/app/pane.js";
import type { Workbench } from "../src/app/workbench.js";
import { firstFacts } from "../src/app/facts.js";
import { type Document, emptyDocument } from "../src/model/document.js";
import { History } from "../src/model/history.js";
import { State } from "../src/model/state.js";
import { firstView } from "../src/model/view.js";
import type { PointerAt } from "../src/stage/pointing.js";

vi.mock("../src/stage/software.js", () => ({ isSoftware: false }));

// The places of a large mesh wait for a task of their own.

const count = 20_000;
const mesh = { name: "", positions: new Float32Array(3 * count), faces: Uint32Array.from([0, 1, 2]) };
let history: History<Document>;
let stroke: PaintStroke;

const at = (vertex: number) => ({ hit: { vertex, point: [0, 0, 0] }, time: 0 }) as unknown as PointerAt;
const painted = () => {
  const values = [...(history.present.paintedP ?? [])];
  return values.flatMap((value, vertex) => (Number.isNaN(value) ? [] : [vertex]));
};

beforeEach(() => {
  vi.useFakeTimers();
  history = new History<Document>(emptyDocument);
  const work: Partial<Workbench> = {
    mesh,
    document: emptyDocument,
    adjacency: adjacencyOf(count, mesh.faces),
    seams: undefined,
    mirror: undefined,
    diagonal: 1,
    view: new State({ ...firstView, radius: 0, paintP: 6 }),
    facts: new State(firstFacts),
    during: (document) => history.during(document),
    endGesture: () => history.end(),
    cancelGesture: () => history.cancel(),
  };
  const pane = { stage: { surface: { positions: mesh.positions } } } as unknown as Pane;
  stroke = new PaintStroke(work as Workbench, pane, ({ hit }) => [hit!.vertex], at(0));
  stroke.move(at(7));
});

it("saving paints the places that wait at once, and the stroke goes on", () => {
  expect(painted()).toEqual([]);
  stroke.flush();
  expect(painted()).toEqual([0, 7]);
  stroke.move(at(9));
  vi.runAllTimers();
  expect(painted()).toEqual([0, 7, 9]);
});

it("places that wait when the stroke is cancelled are never painted", () => {
  stroke.cancel();
  vi.runAllTimers();
  stroke.flush();
  expect(painted()).toEqual([]);
});
