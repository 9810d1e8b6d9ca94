import { derivedOf } from "lpdeform-client/mesh/derived";
import { foldsOf } from "../model/folds.js";
import { paintSoftly } from "../model/soft_paint.js";
import type { Workbench } from "./workbench.js";

/** Without a size of the brush: so many edges. */
const fewEdges = 4;

/** Paints the brush's value where the surface folds at rest within the brush's size, as one step. */
export function paintFolds(work: Workbench): void {
  const { mesh, seams, adjacency, diagonal } = work;
  const { paintField: field, paintP, paintStiffness, radius } = work.view.now;
  const size = radius > 0 ? radius * diagonal : fewEdges * derivedOf(mesh).edge;
  const folds = foldsOf(mesh.positions, seams?.faces ?? mesh.faces, adjacency, size, seams?.groups);
  const strengths = new Map<number, number>();
  folds.forEach((fold, vertex) => fold > 0.01 && strengths.set(vertex, fold));
  if (strengths.size === 0)
    return work.notify("The surface has no folds of the brush's size: a larger brush finds wider ones.");
  const brush = { field, mode: "set", value: field === "p" ? paintP : paintStiffness } as const;
  work.change(paintSoftly(work.document, strengths, brush, folds.length, adjacency, seams?.groups));
  work.view.set({ colourBy: field });
}
