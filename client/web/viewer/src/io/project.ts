import { usualWelding } from "lpdeform-client/mesh/derived";
import type { Encoding } from "lpdeform-client";
import { type Document, emptyDocument, type Handle, handleOf } from "../model/document.js";
import { leastP, mostP } from "../model/exponent.js";
import type { Mesh, Vector3 } from "lpdeform-client/mesh/mesh";
import type { Pose } from "../model/pose.js";
import { type Detail, shapeKinds } from "../model/shapes.js";
import { type ColourBy, colourings, usualSearch, type View } from "../model/view.js";
import { FileFault } from "lpdeform-client/mesh/fault";
import { gunzip, gzip } from "./gzip.js";
import { isPlace } from "./places.js";
import { readKeyPoses, readPose } from "./project_poses.js";
import { handlesJson, readHandles } from "./handlefile.js";
import { readStoredMesh, storedMesh } from "./project_mesh.js";
import { isObject, joinSections, splitSections } from "./sections.js";

const format = "lpdeform project";
/** Raised when an older page would misread a file. */
const version = 1;
/** Of what a file holds unpacked. */
const mostBytes = 500e6;

/** The settings of the view that belong to the work. */
export type ProjectView = Pick<
  View,
  | "shape"
  | "detail"
  | "selected"
  | "isYUp"
  | "pinned"
  | "isWelded"
  | "weldTolerance"
  | "isSplit"
  | "colourBy"
  | "wireframe"
  | "ghost"
  | "encoding"
  | "search"
>;

/** Work as one file: mesh, handles, fields, settings, camera. */
export interface Project {
  mesh: Mesh;
  document: Document;
  view: ProjectView;
  look: { position: Vector3; target: Vector3 };
}

const isBoolean = (value: unknown) => typeof value === "boolean";
const oneOf =
  <Value>(...values: readonly Value[]) =>
  (value: unknown) =>
    values.includes(value as Value);

function isSearch(value: unknown): boolean {
  if (!isObject(value)) return false;
  const { effort = 0, show = false, leastShare = 0 } = value;
  const isEffort = Number.isInteger(effort) && (effort as number) >= 0 && (effort as number) <= 1000;
  return isEffort && isBoolean(show) && typeof leastShare === "number" && leastShare >= 0 && leastShare <= 1;
}

/** What each may be. One that is missing does not compile. */
const viewChecks: { readonly [K in keyof ProjectView]: (value: unknown) => boolean } = {
  shape: oneOf("", ...shapeKinds.map(({ id }) => id)),
  detail: oneOf<Detail>("coarse", "medium", "fine"),
  selected: (value) => value === undefined || typeof value === "string",
  isYUp: isBoolean,
  pinned: (value) => value === undefined || (typeof value === "number" && value > 0 && value < Infinity),
  isWelded: isBoolean,
  weldTolerance: (value) => typeof value === "number" && value >= 0 && value <= 0.001,
  isSplit: isBoolean,
  colourBy: oneOf<ColourBy>(...colourings),
  wireframe: isBoolean,
  ghost: isBoolean,
  encoding: oneOf<Encoding>("float32", "quantized", "compressed"),
  search: isSearch,
};
const viewKeys = Object.keys(viewChecks) as (keyof ProjectView)[];

/**
 * A gzip file of one line of JSON and arrays; the line's "handles" is a handle file of the command line. Rejects with a FileFault if
 * it would hold more than readProject() reads.
 */
export async function writeProject({ mesh, document, view, look }: Project): Promise<Uint8Array<ArrayBuffer>> {
  const { head, arrays } = await storedMesh(mesh);
  const { p, secondP, isAutomatic, handles, keyPoses } = document;
  const all = {
    format,
    version,
    mesh: head,
    p,
    secondP,
    isAutomatic,
    handles: handlesJson(document, mesh),
    poses: keyPoses ?? [],
    marks: handles.map(({ colour, isLocked, pose }) => ({ colour, isLocked, ...(pose.scale && { pose }) })),
    view: Object.fromEntries(viewKeys.map((key) => [key, view[key]])),
    camera: look,
  };
  return gzip(joinSections(all, arrays, mostBytes));
}

/** Reads what writeProject() wrote. Rejects with a FileFault that names `file` and what is wrong. */
export async function readProject(file: string, bytes: Uint8Array<ArrayBuffer>): Promise<Project> {
  if (bytes[0] !== 0x1f || bytes[1] !== 0x8b) throw new FileFault(`${file} is not a project of this page.`);
  const [head, arrays] = splitSections(await unpacked(file, bytes), file);
  if (head["format"] !== format) throw new FileFault(`${file} is not a project of this page: its format is another.`);
  if (head["version"] !== version) {
    throw new FileFault(`${file} is a project of version ${String(head["version"])}; this page reads version ${version}.`);
  }
  const mesh = readStoredMesh(head["mesh"], arrays, file);
  const document = documentOf(head, mesh, file);
  return { mesh, document, view: viewOf(head["view"], document, file), look: lookOf(head["camera"], file) };
}

async function unpacked(file: string, bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  const content = await gunzip(bytes, mostBytes).catch(() => {
    throw new FileFault(`${file} is damaged or cut off: its checksum is not that of what it holds.`);
  });
  if (!content) throw new FileFault(`${file} holds more than ${mostBytes / 1e6} MB; this page reads projects of that at most.`);
  return content;
}

function documentOf(head: Record<string, unknown>, mesh: Mesh, file: string): Document {
  const { p, secondP, isAutomatic, handles, marks } = head;
  for (const [name, value] of Object.entries({ p, secondP })) {
    if (typeof value === "number" && value >= leastP && value <= mostP) continue;
    throw new FileFault(`In ${file}, ${name} is ${String(value)}, not a number from ${leastP} to ${mostP}.`);
  }
  if (!isBoolean(isAutomatic)) throw new FileFault(`In ${file}, “isAutomatic” is neither true nor false.`);
  const settings = { ...emptyDocument, p: p as number, secondP: secondP as number };
  const document = withoutMarks(handles, settings, mesh, file);
  const keyPoses = readKeyPoses(head["poses"], file);
  return {
    ...document,
    ...(keyPoses.length > 0 && { keyPoses }),
    isAutomatic: isAutomatic as boolean,
    handles: document.handles.map((handle, k) => marked(handle, markOf(marks, k, handle.name, file))),
  };
}

function withoutMarks(handles: unknown, settings: Document, mesh: Mesh, file: string): Document {
  try {
    return readHandles(handles, settings, mesh);
  } catch (thrown) {
    if (!(thrown instanceof FileFault)) throw thrown;
    throw new FileFault(thrown.message.replace(/the handle file/i, (words) => `${words.slice(0, 3)} handles of ${file}`));
  }
}

/** What the page knows of a handle beside its handle file; `pose` if that has the handle's positions for it. */
type Mark = Pick<Handle, "colour" | "isLocked"> & { pose?: Pose };

function marked(handle: Handle, { pose, ...rest }: Mark): Handle {
  const { targets: _, ...untargeted } = handle;
  return pose ? { ...untargeted, ...rest, pose } : { ...handle, ...rest };
}

/** Of the k-th handle. */
function markOf(marks: unknown, k: number, name: string, file: string): Mark {
  const { colour, isLocked, pose } = Array.isArray(marks) && isObject(marks[k]) ? marks[k] : {};
  const read = pose === undefined ? undefined : readPose(pose);
  if (pose !== undefined && !read) throw new FileFault(`In ${file}, the scaled pose of handle “${name}” is none.`);
  if (typeof colour === "string" && /^#[0-9a-f]{6}$/i.test(colour) && typeof isLocked === "boolean")
    return { colour, isLocked, ...(read && { pose: read }) };
  throw new FileFault(`In ${file}, handle “${name}” has no colour, or it is not said whether it is locked.`);
}

/** Keys that this page does not know are those of a later one, and change nothing of the work. */
function viewOf(json: unknown, document: Document, file: string): ProjectView {
  const { tolerance: weldTolerance } = usualWelding; // earlier pages wrote none
  const view: Record<string, unknown> = { weldTolerance, search: usualSearch, ...(isObject(json) && json) };
  for (const key of viewKeys) {
    if (viewChecks[key](view[key])) continue;
    throw new FileFault(`In ${file}, “${key}” of the view is ${JSON.stringify(view[key])}, which it cannot be.`);
  }
  const known = Object.fromEntries(viewKeys.map((key) => [key, view[key]])) as unknown as ProjectView;
  const { effort, show, leastShare } = known.search;
  const search = { ...(effort !== undefined && { effort }), ...(show && { show }), ...(leastShare && { leastShare }) };
  return { ...known, search, selected: handleOf(document, known.selected)?.name };
}

function lookOf(json: unknown, file: string): Project["look"] {
  const { position, target } = isObject(json) ? json : {};
  if (isPlace(position) && isPlace(target) && position.some((value, axis) => value !== target[axis]))
    return { position, target };
  throw new FileFault(`In ${file}, the camera has no place, or nothing to look at.`);
}
