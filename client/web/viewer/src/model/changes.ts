import type { FieldValue, Handle as WireHandle, HandleChange, Motion, Settings, Update } from "lpdeform-client";
import { type Document, emptyDocument, type Handle, pField } from "./document.js";
import { kindOf } from "./hold_kinds.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { toMotion } from "./pose.js";
import { targetsOf } from "./targets.js";

/** A pane of the split view: each has its own p. */
export type Side = "first" | "second";

type RestMesh = Pick<Mesh, "positions" | "exact" | "faces">;

/** The update that takes a session from `before` to `after`; undefined if they are the same for it. */
export function changes(before: Document, after: Document, mesh: RestMesh, side: Side = "first"): Update | undefined {
  const handles = handleChanges(before.handles, after.handles, mesh);
  const settings = settingChanges(before, after, side);
  if (Object.keys(handles).length === 0 && Object.keys(settings).length === 0) return undefined;
  return { handles, settings };
}

/** The state in which every session begins. */
export const newSession: Document = { ...emptyDocument, p: NaN, secondP: NaN };

function handleChanges(before: readonly Handle[], after: readonly Handle[], mesh: RestMesh): Record<string, HandleChange> {
  const changed = new Map<string, HandleChange>();
  if (before === after) return {};
  const old = new Map(before.map((handle) => [handle.name, handle]));
  for (const handle of after) {
    const known = old.get(handle.name);
    old.delete(handle.name);
    if (known === handle) continue;
    if (!known || !isHeldAlike(known, handle)) changed.set(handle.name, { set: toWire(handle, mesh) });
    else if (known.pose !== handle.pose || known.targets !== handle.targets) {
      changed.set(handle.name, { move: motionOf(handle, mesh) });
    }
  }
  for (const name of old.keys()) changed.set(name, { remove: true });
  return Object.fromEntries(changed); // works for any name, also "__proto__"
}

function isHeldAlike(a: Handle, b: Handle): boolean {
  return a.vertices === b.vertices && a.points === b.points && a.hold === b.hold && a.footprint === b.footprint;
}

/** A server takes rigid motions and places. A handle that is held by its direction alone cannot be larger. */
function motionOf(handle: Handle, mesh: RestMesh): Motion {
  const { targets, pose, hold } = handle;
  if (targets) return { targets };
  return pose.scale && !kindOf(hold).isTurnedOnly ? { targets: targetsOf(handle, mesh) } : toMotion(pose);
}

function toWire(handle: Handle, mesh: RestMesh): WireHandle {
  return {
    ...(handle.points ? { points: handle.points } : { vertices: handle.vertices }),
    motion: motionOf(handle, mesh),
    hold: handle.hold,
    footprint: handle.footprint,
  };
}

function settingChanges(before: Document, after: Document, side: Side): Settings {
  const settings: Settings = {};
  const [oldP, newP] = side === "first" ? [before.p, after.p] : [before.secondP, after.secondP];
  const isRepainted = before.paintedP !== after.paintedP || before.isAutomatic !== after.isAutomatic;
  if (isRepainted || (oldP !== newP && !after.isAutomatic)) settings.p = pOf(after, newP);
  if (before.stiffness !== after.stiffness || before.isAutomatic !== after.isAutomatic) {
    settings.stiffness = after.isAutomatic ? { automatic: 1 } : (after.stiffness ?? 1);
  }
  if (before.region !== after.region) settings.region = after.region ?? [];
  return settings;
}

function pOf(document: Document, p: number): FieldValue {
  if (document.isAutomatic) return { automatic: 1 };
  return pField(document, p) ?? p;
}

/** p of the energy as a whole: the slider's, even if parts are painted; 2 if the server finds p by itself. */
export function exponent({ isAutomatic, p, secondP }: Document, side: Side): number {
  return isAutomatic ? 2 : side === "first" ? p : secondP;
}
