import type { Hold, SurfacePoint } from "lpdeform-client";
import { addHandle, type Document, type Handle, paint, withoutPaint } from "../model/document.js";
import { type HoldKind, holdKinds, kindOf } from "../model/hold_kinds.js";
import { centroid, type Mesh, type Vector3 } from "lpdeform-client/mesh/mesh";
import { targetsOf } from "../model/targets.js";
import { capital } from "../model/words.js";
import { axisAngle, isAtRest, noRotation, type Pose, quaternionOf } from "../model/pose.js";
import { FileFault } from "lpdeform-client/mesh/fault";
import { arrayOf, checkKeys, objectOf, textOf, vector3, vertexNumbers, weightOf } from "./json.js";

// The handle file of the command line; client/cli/README.md describes it whole.

const holdKeys = Object.values<HoldKind>(holdKinds).flatMap(({ fileKey }) => fileKey ?? []);
const handleKeys = ["name", "vertices", "points", "translate", "rotate", "positions", "footprint", ...holdKeys];

/**
 * The document with the handles, region and painted groups of a file in place of its own. Throws a FileFault. `withCopies`: adds
 * what is painted with a vertex, being one with it.
 */
export function readHandleFile(
  text: string,
  document: Document,
  mesh: Mesh,
  withCopies = (vertices: number[]): number[] => vertices,
): Document {
  let json: unknown;
  try {
    json = JSON.parse(text);
  } catch (error) {
    throw new FileFault(`The handle file is not JSON: ${(error as Error).message}.`);
  }
  const result = readHandles(json, document, mesh, withCopies);
  if (result.handles.length === 0) throw new FileFault("The handle file has no handle.");
  return result;
}

/** Like readHandleFile(), from its JSON, which may have no handles. */
export function readHandles(
  json: unknown,
  document: Document,
  mesh: Mesh,
  withCopies = (vertices: number[]): number[] => vertices,
): Document {
  const file = objectOf(json, "the whole");
  checkKeys(file, ["handles", "region", "groups", "mesh", "note"], "the whole");
  const vertexCount = mesh.positions.length / 3;
  let result: Document = { ...withoutPaint(document), handles: [], isAutomatic: false };
  for (const one of arrayOf(file["handles"], "“handles”")) result = withHandle(result, one, mesh);
  if (file["region"] !== undefined) {
    result = { ...result, region: vertexNumbers(file["region"], "“region”", vertexCount) };
  } else {
    const { region: _, ...rest } = result;
    result = rest;
  }
  for (const one of arrayOf(file["groups"] ?? [], "“groups”")) result = withGroup(result, one, vertexCount, withCopies);
  return result;
}

function withHandle(document: Document, json: unknown, mesh: Mesh): Document {
  const object = objectOf(json, `handle ${document.handles.length + 1}`);
  const name = textOf(object["name"], `the name of handle ${document.handles.length + 1}`);
  const owner = `handle “${name}”`;
  checkKeys(object, handleKeys, owner);
  if (document.handles.some((handle) => handle.name === name)) throw new FileFault(`There are two handles “${name}”.`);
  const points = object["points"] === undefined ? undefined : surfacePoints(object["points"], owner, mesh);
  if ((points === undefined) === (object["vertices"] === undefined)) {
    throw new FileFault(`${capital(owner)} needs either “vertices” or “points”.`);
  }
  const vertices = points ? [] : vertexNumbers(object["vertices"], owner, mesh.positions.length / 3);
  const added = addHandle(document, vertices, mesh.positions, {
    name,
    ...(points && { points }),
    ...motionOf(
      object,
      owner,
      points ? centerOf(points, mesh) : centroid(mesh.positions, vertices),
      vertices.length || points!.length,
    ),
    hold: holdOf(object, owner),
    footprint: weightOf(object["footprint"] ?? 0, `the footprint of ${owner}`, Infinity),
  });
  if (added === document || added.handles.at(-1)!.vertices.length !== vertices.length) {
    throw new FileFault(`${capital(owner)} has a vertex that another handle has, too.`);
  }
  return added;
}

function motionOf(
  object: Record<string, unknown>,
  owner: string,
  middle: Vector3,
  count: number,
): Pick<Handle, "pose" | "targets"> {
  const { translate, rotate, positions } = object;
  if (positions !== undefined) {
    if (translate !== undefined || rotate !== undefined) {
      throw new FileFault(`${capital(owner)} has “positions” beside “translate” or “rotate”.`);
    }
    const targets = arrayOf(positions, `the positions of ${owner}`).flatMap((one) => vector3(one, `a position of ${owner}`));
    if (targets.length !== 3 * count)
      throw new FileFault(`${capital(owner)} has ${count} vertices and ${targets.length / 3} positions.`);
    return { pose: { rotation: noRotation, translation: [0, 0, 0], center: middle }, targets };
  }
  const pose: Pose = { rotation: noRotation, translation: [0, 0, 0], center: middle };
  const translation = translate === undefined ? pose.translation : vector3(translate, `“translate” of ${owner}`);
  if (rotate === undefined) return { pose: { ...pose, translation } };
  const turn = objectOf(rotate, `“rotate” of ${owner}`);
  checkKeys(turn, ["axis", "angle_degrees", "center"], `“rotate” of ${owner}`);
  const axis = vector3(turn["axis"], `the axis of ${owner}`);
  if (Math.hypot(...axis) < 1e-12) throw new FileFault(`The axis of ${owner} has no direction.`);
  const degrees = turn["angle_degrees"];
  if (typeof degrees !== "number" || !Number.isFinite(degrees)) {
    throw new FileFault(`“angle_degrees” of ${owner} is not a number.`);
  }
  const center = turn["center"] === undefined ? ([0, 0, 0] as const) : vector3(turn["center"], `the center of ${owner}`);
  return { pose: { rotation: quaternionOf(axis, (degrees * Math.PI) / 180), translation, center } };
}

function holdOf(object: Record<string, unknown>, owner: string): Hold {
  const holds: Hold[] = [];
  for (const { fileKey, weight, direction } of Object.values<HoldKind>(holdKinds)) {
    if (fileKey === undefined || object[fileKey] === undefined) continue;
    const value = object[fileKey];
    holds.push(
      weight ? weight.with(weightOf(value, `“${fileKey}” of ${owner}`, 1e6)) : direction.with(directionOf(value, owner)),
    );
  }
  if (holds.length > 1) throw new FileFault(`${capital(owner)} is held in two ways.`);
  return holds[0] ?? holdKinds.exact.fresh;
}

function directionOf(json: unknown, owner: string): Vector3 {
  const vector = vector3(json, `the lock of ${owner}`);
  if (Math.hypot(...vector) === 0) throw new FileFault(`The lock of ${owner} has no direction.`);
  return vector;
}

function surfacePoints(json: unknown, owner: string, mesh: Mesh): SurfacePoint[] {
  return arrayOf(json, `the points of ${owner}`).map((one) => {
    const point = objectOf(one, `a point of ${owner}`);
    checkKeys(point, ["face", "barycentric"], `a point of ${owner}`);
    const { face } = point;
    const faces = mesh.faces.length / 3;
    if (typeof face !== "number" || !Number.isInteger(face) || face < 0 || face >= faces) {
      throw new FileFault(`${capital(owner)} has a point in face ${JSON.stringify(face)}; the mesh has ${faces} faces.`);
    }
    return { face, barycentric: vector3(point["barycentric"], `“barycentric” of ${owner}`) };
  });
}

function centerOf(points: readonly SurfacePoint[], mesh: Mesh): Vector3 {
  const sum: [number, number, number] = [0, 0, 0];
  for (const { face, barycentric } of points) {
    for (let corner = 0; corner < 3; ++corner) {
      const vertex = mesh.faces[3 * face + corner]!;
      for (let axis = 0; axis < 3; ++axis)
        sum[axis]! += (barycentric[corner]! * mesh.positions[3 * vertex + axis]!) / points.length;
    }
  }
  return sum;
}

function withGroup(
  document: Document,
  json: unknown,
  vertexCount: number,
  withCopies: (vertices: number[]) => number[],
): Document {
  const group = objectOf(json, "a group");
  const owner = `group “${textOf(group["name"], "the name of a group")}”`;
  checkKeys(group, ["name", "vertices", "p", "stiffness"], owner);
  const vertices = withCopies(vertexNumbers(group["vertices"], owner, vertexCount));
  let result = document;
  for (const [field, least, most] of [
    ["p", 1, 64],
    ["stiffness", 1e-6, 1e6],
  ] as const) {
    if (group[field] === undefined) continue;
    const value = group[field];
    if (typeof value !== "number" || !(value >= least && value <= most))
      throw new FileFault(`“${field}” of ${owner} is not within ${least} to ${most}.`);
    result = paint(result, field, vertices, value, vertexCount);
  }
  return result;
}

/** A handle file with the document's handles, and its painting as groups. A scaled handle has positions in it. */
export function writeHandleFile(document: Document, mesh: Mesh): string {
  return `${JSON.stringify(handlesJson(document, mesh))}\n`;
}

/** The JSON of such a file. */
export function handlesJson(document: Document, mesh: Mesh): object {
  const groups = [...paintedGroups("p", document.paintedP, NaN), ...paintedGroups("stiffness", document.stiffness, 1)];
  return {
    mesh: mesh.name,
    handles: document.handles.map((handle) => handleJson(handle, mesh)),
    ...(document.region && { region: document.region }),
    ...(groups.length > 0 && { groups }),
  };
}

function handleJson(handle: Handle, mesh: Mesh): object {
  const { name, vertices, points, pose, hold, footprint } = handle;
  const targets = handle.targets ?? (pose.scale && !kindOf(hold).isTurnedOnly ? [...targetsOf(handle, mesh)] : undefined);
  const { axis, angle } = axisAngle(pose.rotation);
  const { fileKey, weight, direction } = kindOf(hold);
  return {
    name,
    ...(points ? { points } : { vertices }),
    ...(targets && { positions: targets.flatMap((_, k) => (k % 3 === 0 ? [targets.slice(k, k + 3)] : [])) }),
    ...(!targets && !isAtRest(pose) && pose.translation.some((value) => value !== 0) && { translate: pose.translation }),
    ...(!targets && angle !== 0 && { rotate: { axis, angle_degrees: (angle * 180) / Math.PI, center: pose.center } }),
    ...(fileKey && { [fileKey]: (weight ?? direction).of(hold) }),
    ...(footprint > 0 && { footprint }),
  };
}

function paintedGroups(field: "p" | "stiffness", values: Float32Array | undefined, unpainted: number): object[] {
  const groups = new Map<number, number[]>();
  values?.forEach((value, vertex) => {
    if (Object.is(value, unpainted)) return;
    const group = groups.get(value);
    if (group) group.push(vertex);
    else groups.set(value, [vertex]);
  });
  return [...groups].map(([value, vertices]) => ({ name: `${field} ${shortest(value)}`, vertices, [field]: shortest(value) }));
}

/** 1.2 where float32 has made 1.2000000476837158 of it. */
function shortest(value: number): number {
  for (let digits = 1; digits < 9; ++digits) {
    const short = Number(value.toPrecision(digits));
    if (Math.fround(short) === value) return short;
  }
  return value;
}
