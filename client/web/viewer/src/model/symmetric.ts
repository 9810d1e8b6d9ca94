import { changeHandle, type Document, type Handle, removeHandle } from "./document.js";
import { kindOf } from "./hold_kinds.js";
import type { Mirror } from "./mirror.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { about, apply, type Pose, type Quaternion } from "./pose.js";

/** So many vertices of a handle say where its partner is. */
const samples = 64;

const sets = new WeakMap<readonly number[], ReadonlySet<number>>();

function setOf(vertices: readonly number[]): ReadonlySet<number> {
  const known = sets.get(vertices) ?? new Set(vertices);
  sets.set(vertices, known);
  return known;
}

/** The handle that holds most of the handle's image: another one, or the handle itself if it lies on the plane. */
export function partnerOf(handles: readonly Handle[], { vertices }: Handle, mirror: Mirror): Handle | undefined {
  const step = Math.max(1, Math.floor(vertices.length / samples));
  const sample = vertices.filter((_, k) => k % step === 0);
  const images = sample.map((vertex) => mirror.imageOf(vertex)).filter((image) => image !== undefined);
  return handles.find((handle) => {
    const held = setOf(handle.vertices);
    return 2 * images.filter((image) => held.has(image)).length > sample.length;
  });
}

/**
 * The document with what has changed since `before` done on the other side, too. If both of two partners have changed, the one
 * that comes first in `leading` counts. A handle on the plane stays on it when it is moved.
 */
export function symmetric(before: Document, after: Document, mirror: Mirror, leading: readonly string[]): Document {
  if (before.handles === after.handles) return after;
  const old = new Map(before.handles.map((handle) => [handle.name, handle]));
  const rank = ({ name }: Handle) => (leading.includes(name) ? leading.indexOf(name) : leading.length);
  const changed = after.handles.filter((handle) => old.has(handle.name) && old.get(handle.name) !== handle);
  const done = new Set<string>();
  let result = after;
  for (const handle of changed.sort((a, b) => rank(a) - rank(b))) {
    const partner = partnerOf(after.handles, handle, mirror);
    if (!partner || done.has(handle.name)) continue;
    done.add(partner.name);
    const before = old.get(handle.name)!;
    const change = partner === handle ? onPlane(before, handle, mirror) : imageOf(before, handle, partner, mirror);
    result = changeHandle(result, partner.name, change);
  }
  return withoutPartners(before, result, mirror);
}

/** What is deleted on one side is deleted on the other. */
function withoutPartners(before: Document, after: Document, mirror: Mirror): Document {
  const isLeft = (old: Handle) => after.handles.some(({ name, vertices }) => name === old.name || vertices === old.vertices);
  const partners = before.handles.filter((old) => !isLeft(old)).map((old) => partnerOf(before.handles, old, mirror));
  return partners.reduce((result, partner) => (partner ? removeHandle(result, partner.name) : result), after);
}

/** What has changed of a handle, for its partner. */
function imageOf(old: Handle, now: Handle, partner: Handle, mirror: Mirror): Partial<Handle> {
  const hasMoved = old.pose !== now.pose || old.targets !== now.targets;
  return {
    ...(hasMoved && !partner.isLocked && movedAs(now, partner, mirror)),
    ...(old.hold !== now.hold && { hold: mirroredHold(now, mirror) }),
    ...(old.footprint !== now.footprint && { footprint: now.footprint }),
    ...(old.isLocked !== now.isLocked && { isLocked: now.isLocked }),
  };
}

/** Places of their own count for vertices. Points inside faces have no images. */
function movedAs(now: Handle, partner: Handle, mirror: Mirror): Partial<Handle> {
  const { targets, pose } = now;
  if (!targets)
    return { pose: about(mirrored(pose, mirror), partner.pose.center), ...(partner.targets && { targets: undefined }) };
  if (now.points || partner.points) return {};
  const reflected = reflections(now.vertices, targets, mirror);
  return {
    targets: partner.vertices.flatMap((vertex, k) => [...(reflected(vertex) ?? placeNow(partner, vertex, k, mirror))]),
  };
}

/** For a vertex the reflection of the place of its image, if its image is one of these. */
function reflections(
  vertices: readonly number[],
  targets: readonly number[],
  mirror: Mirror,
): (vertex: number) => Vector3 | undefined {
  const numbers = new Map(vertices.map((vertex, k) => [vertex, k]));
  return (vertex) => {
    const at = numbers.get(mirror.imageOf(vertex) ?? -1);
    return at === undefined ? undefined : mirror.reflected(placeAt(targets, at));
  };
}

function placeNow({ targets, pose }: Handle, vertex: number, k: number, mirror: Mirror): Vector3 {
  return targets ? placeAt(targets, k) : apply(pose, mirror.placeOf(vertex));
}

function placeAt(targets: readonly number[], k: number): Vector3 {
  return [targets[3 * k]!, targets[3 * k + 1]!, targets[3 * k + 2]!];
}

function mirroredHold({ hold }: Handle, mirror: Mirror): Handle["hold"] {
  const { direction } = kindOf(hold);
  return direction ? direction.with(mirror.turned(direction.of(hold))) : hold;
}

/** The pose as seen in the mirror. */
function mirrored({ rotation, translation, center, ...scale }: Pose, mirror: Mirror): Pose {
  const [x, y, z, w] = rotation;
  const [mx, my, mz] = mirror.turned([x, y, z]);
  return {
    ...scale,
    rotation: [-mx || 0, -my || 0, -mz || 0, w], // an axis of rotation is turned round, too
    translation: mirror.turned(translation),
    center: mirror.reflected(center),
  };
}

/** A new pose without what would leave the plane: movement across it, and turns about axes in it. Places become alike on both sides. */
function onPlane(old: Handle, { pose, targets, vertices, points }: Handle, mirror: Mirror): Partial<Handle> {
  const { axis } = mirror;
  if (targets) {
    if (targets === old.targets || points) return {};
    const reflected = reflections(vertices, targets, mirror);
    const evened = vertices.flatMap((vertex, k) => {
      const own = placeAt(targets, k);
      return (reflected(vertex) ?? own).map((value, axis) => (value + own[axis]!) / 2);
    });
    return { targets: evened };
  }
  if (pose === old.pose) return {};
  const translation = pose.translation.map((value, k) => (k === axis ? 0 : value)) as unknown as Pose["translation"];
  const length = Math.hypot(pose.rotation[axis], pose.rotation[3]);
  const rotation = pose.rotation.map((value, k) => (k === axis || k === 3 ? value / length : 0)) as unknown as Quaternion;
  return { pose: { ...pose, translation, rotation: length > 1e-9 ? rotation : [0, 0, 0, 1] } };
}
