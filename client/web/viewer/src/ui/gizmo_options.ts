import type { App } from "../app/app.js";
import type { Symmetry } from "../model/mirror.js";
import { gridStep, scaleStep, type Snapping, turnStep } from "../model/snap.js";
import type { GizmoAxes } from "../model/view.js";
import { short } from "../model/words.js";
import { el } from "./dom.js";

const axes: Readonly<Record<GizmoAxes, string>> = { world: "Mesh’s axes", local: "Handle’s axes", view: "Picture’s axes" };

/** Along which axes the gizmo works, and what a drag keeps to. */
export function gizmoOptions(app: App): HTMLElement {
  const axesChoice = el("select", {
    title:
      "The axes of arrows and rings: of the mesh, of the handle as it is turned, or of the picture (X). Cubes have those of the handle",
    aria: { label: "Axes of arrows and rings" },
  });
  for (const [value, text] of Object.entries(axes)) axesChoice.append(el("option", { value, textContent: text }));
  axesChoice.addEventListener("change", () => app.view.set({ axes: axesChoice.value as GizmoAxes }));
  const snapping = el("select", {
    title: `A grid: steps of the movement from rest, of ${turnStep} degrees, and of ${scaleStep} of a scale. Vertices: of the original shape, and of other handles, where the surface is dragged (M)`,
    aria: { label: "What a drag keeps to" },
  });
  const grid = el("option", { value: "grid" });
  snapping.append(
    el("option", { value: "none", textContent: "No snapping" }),
    grid,
    el("option", { value: "vertices", textContent: "Snap to vertices" }),
  );
  snapping.addEventListener("change", () => app.view.set({ snapping: snapping.value as Snapping }));
  app.facts.watch(
    ({ mesh }) => [mesh],
    () => (grid.textContent = `Grid of ${short(gridStep(app.diagonal))}`),
  );
  app.view.watchAll((view) => {
    axesChoice.value = view.gizmo === "scale" ? "local" : view.axes;
    axesChoice.disabled = view.gizmo === "scale";
    snapping.value = view.snapping;
  });
  return el("div", { className: "moving" }, axesChoice, snapping);
}

/** Across which plane work is done on both sides. */
export function symmetryChoice(app: App): HTMLElement {
  const select = el("select", {
    title: "Selecting, painting and moving handles on both sides of a plane through the mesh's middle (Y)",
    aria: { label: "Symmetry" },
  });
  select.append(el("option", { value: "none", textContent: "No symmetry" }));
  for (const axis of ["x", "y", "z"]) select.append(el("option", { value: axis, textContent: `Symmetric across ${axis}` }));
  select.addEventListener("change", () => app.setSymmetry(select.value as Symmetry));
  app.view.watchAll(({ symmetry }) => (select.value = symmetry));
  return select;
}
