import type { Hold } from "lpdeform-client";
import type { App } from "../app/app.js";
import { pressing } from "../app/touch.js";
import { changeHandle, type Handle, handleOf } from "../model/document.js";
import { type HoldKind, holdKinds, kindOf } from "../model/hold_kinds.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { atRest, isAtRest } from "../model/pose.js";
import { short } from "../model/words.js";
import { el } from "./dom.js";
import { icon } from "./icons.js";
import { slider } from "./controls.js";
import { type HandleRow, handleRow } from "./handle_row.js";
import { poseFields } from "./pose_fields.js";

/** The handles with their names and colours, and the settings of the selected handle. */
export function handlesPanel(app: App): HTMLElement {
  const list = el("ul", { className: "handles" });
  const none = el("li", { className: "empty" }, `None yet: ${pressing()} the surface.`);
  const rows: HandleRow[] = [];
  const details = el("div", { className: "details" });
  let shown = "";
  const show = () => {
    const { handles } = app.document;
    const { selected, alsoSelected } = app.view.now;
    const isTogether = (name: string) => alsoSelected.includes(name) || (name === selected && alsoSelected.length > 0);
    const now = JSON.stringify([
      selected,
      alsoSelected,
      handles.map(({ name, colour, vertices, isLocked, hold, footprint, pose }) => [
        name,
        colour,
        vertices.length,
        isLocked,
        hold,
        footprint,
        isAtRest(pose),
      ]),
    ]);
    if (now === shown || details.contains(document.activeElement)) {
      if (now === shown || isSliding(details)) return;
    }
    shown = now;
    while (rows.length < handles.length) {
      rows.push(handleRow(app));
      list.append(rows.at(-1)!.element);
    }
    handles.forEach((handle, k) => rows[k]!.show(handle, handle.name === selected, isTogether(handle.name)));
    for (const { element } of rows.splice(handles.length)) {
      const isFocused = element.contains(document.activeElement);
      element.remove();
      if (isFocused) rows.at(-1)?.element.querySelector<HTMLElement>("button:last-child")?.focus();
    }
    none.remove();
    if (handles.length === 0) list.append(none);
    const handle = handleOf(app.document, selected);
    renew(details, handle ? detailsOf(app, handle) : []);
  };
  app.facts.watch(({ document }) => [document.handles], show);
  app.view.watchAll(show);
  details.addEventListener("change", () => queueMicrotask(show));
  return el("div", {}, list, poseFields(app), details);
}

/** Moves the focus to the control with the same name. */
function renew(details: HTMLElement, parts: readonly Node[]): void {
  const { activeElement } = document;
  const label = details.contains(activeElement) ? activeElement!.getAttribute("aria-label") : undefined;
  details.replaceChildren(...parts);
  if (label) details.querySelector<HTMLElement>(`[aria-label="${label}"]`)?.focus();
}

/** A slider that is being dragged, or whose key is held, must stay. */
function isSliding(details: HTMLElement): boolean {
  return details.querySelector("input[type=range]:is(:active, .held)") !== null;
}

const axes = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] } as const;

function detailsOf(app: App, handle: Handle): Node[] {
  const { name, hold, pose } = handle;
  const change = (part: Partial<Handle>) => app.change(changeHandle(app.document, name, part));
  const kind = el("select", { aria: { label: "How it is held" } });
  for (const { label, fresh, takesPoints } of Object.values<HoldKind>(holdKinds)) {
    if (handle.points && !takesPoints) continue;
    kind.append(el("option", { value: fresh.kind, textContent: label, selected: fresh.kind === hold.kind }));
  }
  kind.addEventListener("change", () => {
    const { fresh, isTurnedOnly } = holdKinds[kind.value as Hold["kind"]];
    change({ hold: fresh });
    if (isTurnedOnly) app.view.set({ gizmo: "rotate" });
  });
  const parts: Node[] = [el("label", { className: "pair" }, el("span", {}, "Held"), kind)];
  const { weight, direction } = kindOf(hold);
  if (weight) parts.push(weightSlider(app, name, weight.of(hold), weight.with));
  if (direction) parts.push(directionChoice(app, name, direction.label, direction.of(hold), direction.with));
  if (handle.vertices.length <= 12) parts.push(footprint(app, handle));
  const back = el(
    "button",
    { type: "button", className: "plain", disabled: isAtRest(pose) && !handle.targets, aria: { label: "Back to rest" } },
    icon("reset"),
    "Back to rest",
  );
  back.addEventListener("click", () => {
    const { targets: _, ...rest } = handle;
    const handles = app.document.handles.map((one) => (one.name === name ? { ...rest, pose: atRest(pose.center) } : one));
    app.change({ ...app.document, handles });
  });
  parts.push(back);
  return parts;
}

/** On a logarithmic scale, 0.001 to 1e6. */
function weightSlider(app: App, name: string, now: number, holdWith: (weight: number) => Hold): HTMLElement {
  const set = (power: number) => changeHandle(app.document, name, { hold: holdWith(Number((10 ** power).toPrecision(2))) });
  const { element, show } = slider(
    "Weight",
    -3,
    6,
    0.1,
    (power) => {
      app.during(set(power), performance.now());
      show(power, short(Number((10 ** power).toPrecision(2))));
    },
    () => app.endGesture(),
  );
  show(Math.log10(Math.max(now, 1e-3)), short(now));
  return element;
}

function directionChoice(
  app: App,
  name: string,
  label: string,
  now: Vector3,
  holdWith: (direction: Vector3) => Hold,
): HTMLElement {
  const select = el("select", { aria: { label: "Direction" } });
  const known = Object.entries(axes).find(([, axis]) => axis.every((value, k) => value === now[k]));
  for (const axis of Object.keys(axes))
    select.append(el("option", { value: axis, textContent: axis, selected: axis === known?.[0] }));
  if (!known) select.append(el("option", { value: "", textContent: now.map(short).join(", "), selected: true }));
  select.addEventListener("change", () => {
    app.change(changeHandle(app.document, name, { hold: holdWith(axes[select.value as keyof typeof axes]) }));
  });
  return el("label", { className: "pair" }, el("span", {}, label), select);
}

/** In mean edge lengths of the mesh. */
function footprint(app: App, { name, footprint: radius }: Handle): HTMLElement {
  const edges = radius / app.edge;
  const text = (value: number) => (value === 0 ? "none" : `${short(value)} edges`);
  const { element, show } = slider(
    "Footprint",
    0,
    12,
    0.5,
    (value) => {
      app.during(changeHandle(app.document, name, { footprint: value * app.edge }), performance.now());
      show(value, text(value));
    },
    () => app.endGesture(),
  );
  show(edges, text(Number(edges.toPrecision(2))));
  element.title = "The surroundings move along nearly rigidly: against spikes at handles with few vertices";
  return element;
}
