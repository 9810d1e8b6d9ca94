import type { Hold, SurfacePoint } from "lpdeform-client";
import { groupColours } from "./colours.js";
import { fitPose } from "./fit.js";
import { centroid, type Vector3 } from "lpdeform-client/mesh/mesh";
import { about, add, type Pose } from "./pose.js";

/** A group of vertices, or of points inside faces (from a file), that the user holds. */
export interface Handle {
  readonly name: string;
  readonly colour: string;
  readonly vertices: readonly number[];
  readonly points?: readonly SurfacePoint[];
  readonly pose: Pose;
  /** x, y, z for each vertex or point, instead of the pose; from a file. */
  readonly targets?: readonly number[];
  readonly hold: Hold;
  readonly footprint: number;
  /** Whether it is protected against dragging. */
  readonly isLocked: boolean;
}

/** Where every handle is, and p, to come back to and to play. */
export interface KeyPose {
  readonly name: string;
  readonly p: number;
  readonly handles: readonly Pick<Handle, "name" | "pose" | "targets">[];
}

/** Everything that undo restores and that a server could lose. Immutable. */
export interface Document {
  readonly handles: readonly Handle[];
  readonly p: number;
  /** For the second pane of the split view. */
  readonly secondP: number;
  /** p and stiffness are computed by the server from the shape. */
  readonly isAutomatic: boolean;
  /** One per vertex, NaN where the slider decides. */
  readonly paintedP?: Float32Array;
  /** One per vertex. */
  readonly stiffness?: Float32Array;
  /** Poses to come back to, and to play. */
  readonly keyPoses?: readonly KeyPose[];
  /** The vertices that may move; from a file. */
  readonly region?: readonly number[];
}

export const emptyDocument: Document = { handles: [], p: 1.5, secondP: 6, isAutomatic: false };

export function handleOf(document: Document, name: string | undefined): Handle | undefined {
  return document.handles.find((handle) => handle.name === name);
}

/** The handle of each held vertex. */
export function ownersOf({ handles }: Document): Map<number, Handle> {
  const owners = new Map<number, Handle>();
  for (const handle of handles) for (const vertex of handle.vertices) owners.set(vertex, handle);
  return owners;
}

/** The first free name of the form "Handle 3". */
export function freeName({ handles }: Document, stem = "Handle"): string {
  const taken = new Set(handles.map(({ name }) => name));
  let number = 1;
  while (taken.has(`${stem} ${number}`)) ++number;
  return `${stem} ${number}`;
}

function freeColour({ handles }: Document): string {
  const uses = (colour: string) => handles.filter((handle) => handle.colour === colour).length;
  return groupColours.reduce((best, colour) => (uses(colour) < uses(best) ? colour : best));
}

/**
 * Adds a handle of the vertices that no other handle holds, at their present place. Returns the same document if none is left.
 */
export function addHandle(
  document: Document,
  vertices: readonly number[],
  rest: Float32Array,
  options: Partial<Handle> = {},
  current = rest,
): Document {
  const owners = ownersOf(document);
  const free = vertices.filter((vertex) => !owners.has(vertex));
  if (free.length === 0 && !options.points) return document;
  const handle: Handle = {
    name: freeName(document),
    colour: freeColour(document),
    vertices: free,
    pose: fitPose(rest, current, free),
    hold: { kind: "exact" },
    footprint: 0,
    isLocked: false,
    ...options,
  };
  return { ...document, handles: [...document.handles, handle] };
}

export function changeHandle(document: Document, name: string, change: Partial<Handle>): Document {
  const handles = document.handles.map((handle) => (handle.name === name ? { ...handle, ...change } : handle));
  return { ...document, handles };
}

/** The changes of a handle that is moved by this much from where it is. */
export function shifted({ targets, pose }: Handle, by: Vector3): Partial<Handle> {
  if (targets) return { targets: targets.map((value, k) => value + by[k % 3]!) };
  return { pose: { ...pose, translation: add(pose.translation, by) } };
}

export function removeHandle(document: Document, name: string): Document {
  return { ...document, handles: document.handles.filter((handle) => handle.name !== name) };
}

/** Adds vertices that no handle holds. The handle stays where it is and then turns about its new middle. */
export function extendHandle(document: Document, name: string, vertices: readonly number[], rest: Float32Array): Document {
  const handle = handleOf(document, name);
  if (!handle || handle.points || handle.targets) return document;
  const owners = ownersOf(document);
  const all = [...handle.vertices, ...new Set(vertices.filter((vertex) => !owners.has(vertex)))];
  return changeHandle(document, name, { vertices: all, pose: about(handle.pose, centroid(rest, all)) });
}

/** Removes vertices from all handles; handles without vertices are removed. */
export function releaseVertices(document: Document, vertices: readonly number[], rest: Float32Array): Document {
  const released = new Set(vertices);
  const handles: Handle[] = [];
  for (const handle of document.handles) {
    const left = handle.vertices.filter((vertex) => !released.has(vertex));
    if (left.length === handle.vertices.length) handles.push(handle);
    else if (left.length > 0 && !handle.targets) {
      handles.push({ ...handle, vertices: left, pose: about(handle.pose, centroid(rest, left)) });
    }
  }
  return { ...document, handles };
}

/** Why the handle cannot have this name; undefined if it can. */
export function nameFault(document: Document, old: string, name: string): string | undefined {
  if (name === "") return "A handle needs a name.";
  if (new TextEncoder().encode(name).length > 128) return "A name has 128 bytes at most.";
  if (name !== old && handleOf(document, name)) return `There is a handle “${name}” already.`;
  return undefined;
}

export function paint(
  document: Document,
  field: "p" | "stiffness",
  vertices: readonly number[],
  value: number,
  vertexCount: number,
): Document {
  if (field === "p") {
    const paintedP = document.paintedP?.slice() ?? new Float32Array(vertexCount).fill(NaN);
    for (const vertex of vertices) paintedP[vertex] = value;
    return { ...document, paintedP, isAutomatic: false };
  }
  const stiffness = document.stiffness?.slice() ?? new Float32Array(vertexCount).fill(1);
  for (const vertex of vertices) stiffness[vertex] = value;
  return { ...document, stiffness, isAutomatic: false };
}

/** Without one of the painted fields. */
export function withoutField(document: Document, field: "paintedP" | "stiffness"): Document {
  const { [field]: _, ...rest } = document;
  return rest;
}

export function withoutPaint(document: Document): Document {
  const { paintedP: _, stiffness: __, ...rest } = document;
  return rest;
}

/** p of each vertex, if it is painted. */
export function pField({ paintedP }: Document, p: number): Float32Array | undefined {
  if (!paintedP) return undefined;
  const before = fields.get(paintedP);
  if (before?.p === p) return before.field;
  const field = paintedP.slice();
  for (let vertex = 0; vertex < field.length; ++vertex) if (Number.isNaN(field[vertex]!)) field[vertex] = p;
  fields.set(paintedP, { p, field });
  return field;
}

/** The last one of each painting: it is sent and drawn. */
const fields = new WeakMap<Float32Array, { p: number; field: Float32Array }>();

/** The anchor of a handle; for one with targets, the middle of the targets. */
export function anchorOfHandle(handle: Handle): Vector3 {
  if (handle.targets) {
    const points = Float32Array.from(handle.targets);
    return centroid(
      points,
      Array.from({ length: points.length / 3 }, (_, k) => k),
    );
  }
  const { center, translation } = handle.pose;
  return [center[0] + translation[0], center[1] + translation[1], center[2] + translation[2]];
}
