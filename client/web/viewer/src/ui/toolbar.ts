import type { App } from "../app/app.js";
import { paintFolds } from "../app/paint_folds.js";
import { withoutPaint } from "../model/document.js";
import { leastP, mostP } from "../model/exponent.js";
import { nothing } from "../model/pointed.js";
import type { PaintMode } from "../model/soft_paint.js";
import type { GizmoMode, StrokeMode, Tool } from "../model/view.js";
import { short } from "../model/words.js";
import { choice, el, measured, toggle } from "./dom.js";
import { button, slider } from "./controls.js";
import { gizmoOptions, symmetryChoice } from "./gizmo_options.js";
import { type IconName, icon } from "./icons.js";

const tools: readonly (readonly [Tool, IconName, string, string])[] = [
  ["move", "move", "Move", "Drag a handle; click the surface for a new one; drag beside it to turn the view (1)"],
  ["brush", "brush", "Brush", "Paint a handle onto the surface (2)"],
  ["lasso", "lasso", "Lasso", "Draw around vertices (3)"],
  ["box", "box", "Box", "Draw a box around vertices (4)"],
  ["paint", "paint", "p brush", "Paint p or stiffness onto the surface (5)"],
];

/** The tools, at the left edge, or in the bar of a telephone that is held upright. */
export function toolRail(app: App): HTMLElement {
  const buttons = tools.map(([tool, picture, label, title]) => {
    const element = el(
      "button",
      { type: "button", className: "tool", title, data: { tool }, aria: { label } },
      icon(picture),
      el("span", {}, label),
    );
    element.addEventListener("click", () => app.view.set({ tool, isPanelOpen: app.view.now.isPanelOpen }));
    return element;
  });
  app.view.watchAll(({ tool }) => {
    for (const element of buttons) element.setAttribute("aria-pressed", String(element.dataset["tool"] === tool));
    if (tool !== "brush" && tool !== "paint") app.facts.set({ pointedOut: nothing });
  });
  const fit = button("fit", "Show all of it (F)", () => app.fit());
  return el("nav", { className: "rail", aria: { label: "Tools" } }, ...buttons, el("hr"), fit);
}

/** The settings of the chosen tool. */
export function toolOptions(app: App): HTMLElement {
  const mode = choice<StrokeMode>(
    "What a stroke does",
    [
      ["new", "New"],
      ["add", "Add"],
      ["release", "Release"],
    ],
    (chosen) => app.view.set({ mode: chosen }),
  );
  const gizmo = choice<GizmoMode>(
    "Arrows, rings or cubes",
    [
      ["translate", "Move"],
      ["rotate", "Turn"],
      ["scale", "Scale"],
    ],
    (chosen) => app.view.set({ gizmo: chosen }),
  );
  const field = choice<"p" | "stiffness">(
    "What is painted",
    [
      ["p", "p"],
      ["stiffness", "Stiffness"],
    ],
    (chosen) => app.view.set({ paintField: chosen, colourBy: chosen }),
  );
  const painting = choice<PaintMode>(
    "What painting does",
    [
      ["set", "Paint"],
      ["erase", "Erase"],
      ["smooth", "Smooth"],
    ],
    (paintMode) => app.view.set({ paintMode }),
  );
  painting.element.title = "Bring the value on, take what is painted away, or even it out (E)";
  const soft = slider("Soft", 0, 1, 0.05, (softness) => app.view.set({ softness }));
  soft.element.title = "How much of the brush, from its edge, works less and less";
  const size = slider("Size", 0, 0.25, 0.005, (radius) => app.view.set({ radius }));
  const p = slider("p", leastP, mostP, 0.1, (paintP) => app.view.set({ paintP }));
  const stiffness = slider("Stiffness", -2, 2, 0.05, (power) =>
    app.view.set({ paintStiffness: Number((10 ** power).toPrecision(2)) }),
  );
  const through = toggle(
    "Back side, too",
    app.view.now.isThrough,
    (isThrough) => app.view.set({ isThrough }),
    "Also vertices that face away",
  );
  const clear = el("button", { type: "button", className: "plain", textContent: "Clear painting" });
  clear.addEventListener("click", () => app.change(withoutPaint(app.document)));
  const folds = el("button", { type: "button", className: "plain", textContent: "Paint folds" });
  folds.title = "Bring the value on where the surface bends within the brush's size, less and less towards flat places";
  folds.addEventListener("click", () => paintFolds(app));
  const moving = gizmoOptions(app);
  const element = el(
    "div",
    { className: "options" },
    gizmo.element,
    moving,
    mode.element,
    field.element,
    painting.element,
    size.element,
    soft.element,
    p.element,
    stiffness.element,
    through.element,
    symmetryChoice(app),
    folds,
    clear,
  );

  app.facts.watch(
    ({ document: { paintedP, stiffness } }) => [!paintedP && !stiffness],
    ([isClear]) => (clear.disabled = isClear),
  );
  app.view.watchAll((view) => {
    const { tool } = view;
    mode.show(view.mode);
    gizmo.show(view.gizmo);
    field.show(view.paintField);
    painting.show(view.paintMode);
    soft.show(view.softness, `${Math.round(100 * view.softness)} %`);
    size.show(view.radius, view.radius === 0 ? "1 vertex" : `${short(100 * view.radius)} %`);
    p.show(view.paintP, short(view.paintP));
    stiffness.show(Math.log10(view.paintStiffness), short(view.paintStiffness));
    gizmo.element.hidden = moving.hidden = tool !== "move";
    mode.element.hidden = tool === "paint" || tool === "move";
    field.element.hidden = painting.element.hidden = soft.element.hidden = clear.hidden = tool !== "paint";
    folds.hidden = tool !== "paint" || view.paintMode !== "set";
    size.element.hidden = tool === "lasso" || tool === "box";
    p.element.hidden = tool !== "paint" || view.paintField !== "p" || view.paintMode !== "set";
    stiffness.element.hidden = tool !== "paint" || view.paintField !== "stiffness" || view.paintMode !== "set";
    through.element.hidden = tool !== "lasso" && tool !== "box";
    through.input.checked = view.isThrough;
  });
  return measured(element, "--options-height");
}
