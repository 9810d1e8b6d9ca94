import { changeHandle, handleOf, removeHandle } from "../model/document.js";
import { steppedP } from "../model/exponent.js";
import { kindOf } from "../model/hold_kinds.js";
import type { Symmetry } from "../model/mirror.js";
import { gridStep, scaleStep, type Snapping, turnStep } from "../model/snap.js";
import { noScale, scaled, turned } from "../model/pose.js";
import type { PaintMode } from "../model/soft_paint.js";
import { posedTogether, selectionOf, shiftedTogether } from "../model/together.js";
import { colourings, type GizmoAxes, type Tool } from "../model/view.js";
import type { App } from "./app.js";
import type { Files } from "./files.js";

const tools: readonly Tool[] = ["move", "brush", "lasso", "box", "paint"];
const snappings: readonly Snapping[] = ["none", "grid", "vertices"];
const symmetries: readonly Symmetry[] = ["none", "x", "y", "z"];
const paintModes: readonly PaintMode[] = ["set", "erase", "smooth"];
const allAxes: readonly GizmoAxes[] = ["world", "local", "view"];
const nudges: Record<string, readonly [number, number, number]> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, 1],
  PageDown: [0, 0, -1],
};

/** Right and up. */
const arrows: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};
const zooms: Record<string, number> = { "+": 1 / 1.15, "=": 1 / 1.15, "-": 1.15 };
/** Keys that repeat while they are held; keys that switch something do not. */
const steps = new Set(["[", "]", ",", "."]);
const turnRadians = Math.PI / 24;
/** Share of the mesh's diagonal, or of a turn about an axis; a tenth of it with Shift. */
const nudgeShare = 0.01;
const nudgeRadians = Math.PI / 60;
const nudgeFactor = 0.05;
/** Share of the picture's height. */
const shiftShare = 0.05;

/** Keys, unless the user is typing text. ui/help.ts lists them. */
export function startShortcuts(app: App, files: Files, help: HTMLDialogElement): void {
  // Escape reverts what is under way, and has no other effect then. One listener, because the pictures share
  // the gesture.
  window.addEventListener("keydown", (event) => {
    if (event.code === "Escape" && app.cancelAll()) event.stopImmediatePropagation();
  });
  window.addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    if (
      document.querySelector("dialog:modal") ||
      target.matches("input:not([type=range]):not([type=checkbox]), select, textarea, [role=menuitem]")
    )
      return;
    const isHandled =
      event.ctrlKey || event.metaKey ? withControl(app, files, event) : !event.altKey && alone(app, files, help, event, target);
    if (isHandled) event.preventDefault();
  });
}

function withControl(app: App, files: Files, event: KeyboardEvent): boolean {
  const { key, shiftKey } = event;
  if (key in arrows) return !(event.target as HTMLElement).matches("input") && turnOrShift(app, event);
  const letter = key.toLowerCase();
  if (letter === "z" && !shiftKey) app.undo();
  else if ((letter === "z" && shiftKey) || letter === "y") app.redo();
  else if (letter === "a" && !shiftKey) selectAll(app);
  else if (letter === "s" && !shiftKey) event.repeat || void files.saveProject();
  else return false;
  return true;
}

function alone(app: App, files: Files, help: HTMLDialogElement, event: KeyboardEvent, target: HTMLElement): boolean {
  const { view } = app;
  const { key } = event;
  const isOnPicture = target.matches("canvas");
  if (key.length === 1 && !view.now.hasSingleKeys && !(isOnPicture && key in zooms)) return false;
  const tool = tools[Number(key) - 1];
  if (tool) view.set({ tool });
  else if (key in zooms) app.changeView((stage) => stage.approach(zooms[key]!));
  else if (key in nudges && !target.matches("input, button")) {
    return nudge(app, nudges[key]!, event) || (key in arrows && view.now.selected === undefined && turnOrShift(app, event));
  } else {
    const act = actions(app, files, help, event)[key.length === 1 ? key.toLowerCase() : key];
    if (!act) return false;
    if (!event.repeat || steps.has(key)) act();
  }
  return true;
}

function actions(app: App, files: Files, help: HTMLDialogElement, event: KeyboardEvent): Record<string, () => void> {
  const { view } = app;
  const { now } = view;
  const stepP = (step: number) => {
    const p = steppedP(app.document.p, step);
    if (p !== app.document.p || app.document.isAutomatic) app.byKey({ ...app.document, p, isAutomatic: false }, event);
  };
  return {
    "?": () => help.showModal(),
    "[": () => view.set({ radius: Math.max(now.radius - 0.01, 0) }),
    "]": () => view.set({ radius: Math.min(now.radius + 0.01, 0.25) }),
    ",": () => stepP(-0.1),
    ".": () => stepP(0.1),
    a: () => app.change({ ...app.document, isAutomatic: !app.document.isAutomatic }),
    b: () => app.lookAlongNext(),
    c: () =>
      view.set({
        colourBy: after(
          colourings.filter((one) => one !== "texture" || app.isTextured),
          now.colourBy,
        ),
      }),
    d: () => view.set({ isDark: !now.isDark }),
    f: () => app.fit(),
    g: () => view.set({ ghost: !now.ghost }),
    i: () => view.set({ isPanelOpen: !now.isPanelOpen }),
    k: () => app.keepPose(),
    l: () => toggleLock(app),
    m: () => view.set({ snapping: after(snappings, now.snapping) }),
    n: () => selectNext(app),
    o: () => files.choose(),
    p: () => app.togglePin(),
    r: () => view.set({ gizmo: "rotate", tool: "move" }),
    q: () => view.set({ isParallel: !now.isParallel }),
    s: () => view.set({ isSplit: !now.isSplit }),
    t: () => view.set({ gizmo: "translate", tool: "move" }),
    z: () => view.set({ gizmo: "scale", tool: "move" }),
    x: () => {
      if (now.gizmo === "scale") app.notify("Cubes have the handle’s axes.");
      else view.set({ axes: after(allAxes, now.axes) });
    },
    e: () => view.set({ paintMode: now.tool === "paint" ? after(paintModes, now.paintMode) : now.paintMode, tool: "paint" }),
    v: () => view.set({ hasReadout: !now.hasReadout }),
    y: () => app.setSymmetry(after(symmetries, now.symmetry)),
    w: () => view.set({ wireframe: !now.wireframe }),
    Delete: () => removeSelected(app),
    Backspace: () => removeSelected(app),
    Escape: () => view.set({ selected: undefined }),
  };
}

/** The next of the values, and the first after the last. */
function after<Value>(values: readonly Value[], value: Value): Value {
  return values[(values.indexOf(value) + 1) % values.length]!;
}

function turnOrShift(app: App, { key, shiftKey }: KeyboardEvent): boolean {
  const [right, up] = arrows[key]!;
  app.changeView((stage) =>
    shiftKey ? stage.shift(shiftShare * right, shiftShare * up) : stage.turn(turnRadians * right, turnRadians * up),
  );
  return true;
}

function removeSelected(app: App): void {
  const names = selectionOf(app.document, app.view.now).map(({ name }) => name);
  if (names.length > 0) app.change(names.reduce(removeHandle, app.document));
}

function toggleLock(app: App): void {
  const handle = handleOf(app.document, app.view.now.selected);
  if (handle) app.change(changeHandle(app.document, handle.name, { isLocked: !handle.isLocked }));
}

/** All but the locked ones. */
function selectAll(app: App): void {
  const [selected, ...alsoSelected] = app.document.handles.filter(({ isLocked }) => !isLocked).map(({ name }) => name);
  app.view.set({ selected, alsoSelected, tool: "move" });
  const count = selected === undefined ? 0 : 1 + alsoSelected.length;
  if (count > 1) app.notify(`${count} handles are selected: they move together.`);
}

function selectNext(app: App): void {
  const { handles } = app.document;
  const at = handles.findIndex(({ name }) => name === app.view.now.selected);
  if (handles.length > 0) app.view.set({ selected: handles[(at + 1) % handles.length]!.name, tool: "move" });
}

/**
 * Moves along the mesh's axes by a hundredth of its diagonal; rotates by three degrees if the handle has rings; scales by a
 * twentieth if it has cubes. On a grid, by its steps.
 */
function nudge(app: App, direction: readonly [number, number, number], event: KeyboardEvent): boolean {
  const selection = selectionOf(app.document, app.view.now);
  const [handle] = selection;
  if (!handle) return false;
  const isOnGrid = app.view.now.snapping === "grid";
  const share = event.shiftKey && !isOnGrid ? 0.1 : 1;
  const isTurn = app.view.now.gizmo === "rotate" && !handle.isLocked;
  const isScale = app.view.now.gizmo === "scale" && !handle.isLocked && !kindOf(handle.hold).isTurnedOnly;
  if (isScale && !handle.targets) {
    const by = isOnGrid ? scaleStep : share * nudgeFactor;
    const scale = (handle.pose.scale ?? noScale).map((value, k) => value + by * direction[k]!) as [number, number, number];
    app.byKey(posedTogether(app.document, selection, scaled(handle.pose, scale)), event);
  } else if (isTurn && !handle.targets) {
    const pose = turned(handle.pose, direction, isOnGrid ? (turnStep * Math.PI) / 180 : share * nudgeRadians);
    app.byKey(posedTogether(app.document, selection, pose), event);
  } else if (!isTurn && !isScale && app.canShift(handle)) {
    const step = isOnGrid ? gridStep(app.diagonal) : share * nudgeShare * app.diagonal;
    const [x, y, z] = direction;
    app.byKey(shiftedTogether(app.document, selection, [step * x, step * y, step * z]), event);
  }
  return true;
}
