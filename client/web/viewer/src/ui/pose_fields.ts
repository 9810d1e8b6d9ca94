import type { App } from "../app/app.js";
import { anchorOfHandle, type Document, type Handle, handleOf } from "../model/document.js";
import { fromEuler, toEuler } from "../model/euler.js";
import { kindOf } from "../model/hold_kinds.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { leastScale, mostScale, noScale, scaled, subtract } from "../model/pose.js";
import { posedTogether, selectionOf, shiftedTogether } from "../model/together.js";
import { el } from "./dom.js";
import { type NumberField, numberField } from "./number_field.js";

const axes = ["x", "y", "z"] as const;
/** Share of the mesh's diagonal by which an arrow key moves. */
const stepShare = 0.001;
/** Beyond this, positions are not drawn. */
const farthest = 1e18;

/** The pose of the selected handle in numbers. Handles that are selected together with it follow what is entered, as they follow a drag. */
export function poseFields(app: App): HTMLElement {
  const selected = () => handleOf(app.document, app.view.now.selected);
  const selection = () => selectionOf(app.document, app.view.now);
  const row = (
    name: string,
    title: (axis: string) => string,
    step: () => number,
    range: readonly [number, number] | undefined,
    set: (handle: Handle, axis: number, value: number) => Document,
  ) =>
    axes.map((axis, k) =>
      numberField({
        label: `${name} ${axis}`,
        title: title(axis),
        step,
        ...(range && { range }),
        entered: (value) => withSelected((handle) => app.change(set(handle, k, value))),
        stepped: (value, event) => withSelected((handle) => app.byKey(set(handle, k, value), event)),
        refused: (why) => app.notify(why, true),
      }),
    );
  const withSelected = (act: (handle: Handle) => void) => {
    const handle = selected();
    if (handle) act(handle);
  };
  const moved = row(
    "Moved along",
    (axis) => `How far the handle is moved along ${axis}, in the mesh's unit`,
    () => stepShare * app.diagonal,
    [-farthest, farthest],
    (handle, axis, value) => {
      const by = [0, 0, 0] as [number, number, number];
      by[axis] = value - movementOf(handle)[axis]!;
      return shiftedTogether(app.document, selection(), by);
    },
  );
  const turned = row(
    "Turned about",
    (axis) => `By how many degrees the handle is turned about ${axis}: first about x, then y, then z`,
    () => 1,
    [-360, 360],
    (handle, axis, value) => {
      const angles = [...toEuler(handle.pose.rotation)] as [number, number, number];
      angles[axis] = value;
      return posedTogether(app.document, selection(), { ...handle.pose, rotation: fromEuler(angles) });
    },
  );
  const scaleFields = row(
    "Scaled along",
    (axis) => `How much larger the handle is along its own ${axis} axis; 1: as at rest`,
    () => 0.01,
    [leastScale, mostScale],
    (handle, axis, value) => {
      const scale = [...(handle.pose.scale ?? noScale)] as [number, number, number];
      scale[axis] = value;
      return posedTogether(app.document, selection(), scaled(handle.pose, scale));
    },
  );
  const element = el(
    "div",
    { className: "pose" },
    el("span"),
    ...axes.map((axis) => el("span", { className: "axis-name", textContent: axis })),
    el("span", {}, "Moved"),
    ...moved.map(({ element }) => element),
    el("span", {}, "Turned °"),
    ...turned.map(({ element }) => element),
    el("span", {}, "Scaled"),
    ...scaleFields.map(({ element }) => element),
  );
  const show = () => {
    const handle = selected();
    element.hidden = handle === undefined;
    if (!handle) return;
    const { isLocked, hold, targets, pose } = handle;
    showAll(moved, movementOf(handle), isLocked || kindOf(hold).isTurnedOnly);
    showAll(turned, toEuler(pose.rotation), isLocked || targets !== undefined);
    showAll(scaleFields, pose.scale ?? noScale, isLocked || targets !== undefined || kindOf(hold).isTurnedOnly);
  };
  app.facts.watch(({ document }) => [document.handles], show);
  app.view.watch(({ selected }) => [selected], show);
  return element;
}

/** From where the middle of the handle is at rest. */
function movementOf(handle: Handle): Vector3 {
  return subtract(anchorOfHandle(handle), handle.pose.center);
}

function showAll(fields: readonly NumberField[], values: Vector3, isDisabled: boolean): void {
  fields.forEach(({ element, show }, k) => {
    show(values[k]!);
    element.disabled = isDisabled;
  });
}
