import { anchorOfHandle, changeHandle, type Document, type Handle, handleOf, shifted } from "./document.js";
import { kindOf } from "./hold_kinds.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { add, anchorOf, conjugate, noScale, type Pose, product, rotate, scaled, subtract, times } from "./pose.js";
import type { View } from "./view.js";

const axes: readonly Vector3[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

type Selection = Pick<View, "selected" | "alsoSelected">;

/** The handles that are selected: first the one that the panel shows, then those that move together with it. */
export function selectionOf(document: Document, { selected, alsoSelected }: Selection): Handle[] {
  const first = handleOf(document, selected);
  if (!first) return [];
  const others = alsoSelected.filter((name) => name !== selected).map((name) => handleOf(document, name));
  return [first, ...others.filter((one) => one !== undefined)];
}

/** The selection with the handle added, or without it if it is in it. */
export function toggled({ selected, alsoSelected }: Selection, name: string): Selection {
  if (selected === undefined) return { selected: name, alsoSelected: [] };
  if (selected === name) return { selected: alsoSelected[0], alsoSelected: alsoSelected.slice(1) };
  const isIn = alsoSelected.includes(name);
  return { selected, alsoSelected: isIn ? alsoSelected.filter((one) => one !== name) : [...alsoSelected, name] };
}

/** The selection whose first is this handle: the same handles if it is one of them, otherwise it alone. */
export function selecting({ selected, alsoSelected }: Selection, name: string): Selection {
  const all = selected === undefined ? [] : [selected, ...alsoSelected];
  return { selected: name, alsoSelected: all.includes(name) ? all.filter((one) => one !== name) : [] };
}

/** Those of the handles that can be moved: not those that are locked, or free to go anywhere. */
export function movableOf(handles: readonly Handle[]): Handle[] {
  return handles.filter(({ isLocked, hold }) => !isLocked && !kindOf(hold).isTurnedOnly);
}

/** Moves handles by this much from where they are here, if they can be moved. */
export function shiftedTogether(document: Document, handles: readonly Handle[], by: Vector3): Document {
  return movableOf(handles).reduce((result, handle) => changeHandle(result, handle.name, shifted(handle, by)), document);
}

/**
 * Moves the first of the handles to the pose, and the others as if all were one body; those that are locked stay. If the body becomes
 * larger in one direction only, a handle that is turned otherwise becomes larger along its own axes by as much as these do.
 */
export function posedTogether(document: Document, [first, ...others]: readonly Handle[], pose: Pose): Document {
  if (!first) return document;
  const turn = product(pose.rotation, conjugate(first.pose.rotation));
  const [from, to] = [anchorOf(first.pose), anchorOf(pose)];
  const grown = (pose.scale ?? noScale).map((value, k) => value / (first.pose.scale ?? noScale)[k]!) as [
    number,
    number,
    number,
  ];
  const stretched = (by: Vector3) => rotate(pose.rotation, times(grown, rotate(conjugate(first.pose.rotation), by)));
  const carried = (point: Vector3) => add(to, stretched(subtract(point, from)));
  let result = changeHandle(document, first.name, { pose });
  for (const handle of others) {
    if (handle.isLocked) continue;
    const { name, targets, pose: old } = handle;
    if (targets) {
      const points = Array.from(
        { length: targets.length / 3 },
        (_, k) => targets.slice(3 * k, 3 * k + 3) as unknown as Vector3,
      );
      result = changeHandle(result, name, { targets: points.flatMap((point) => [...carried(point)]) });
    } else {
      const translation = subtract(carried(anchorOfHandle(handle)), old.center);
      const moved = { ...old, rotation: product(turn, old.rotation), translation };
      const factors = axes.map((axis) => Math.hypot(...stretched(rotate(old.rotation, axis)))) as [number, number, number];
      const isScaled = grown.some((value) => value !== 1);
      result = changeHandle(result, name, { pose: isScaled ? scaled(moved, times(factors, old.scale ?? noScale)) : moved });
    }
  }
  return result;
}
