import { leastP, mostP } from "../model/exponent.js";
import type { KeyPose } from "../model/document.js";
import { leastScale, mostScale, type Pose, type Quaternion } from "../model/pose.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { FileFault } from "lpdeform-client/mesh/fault";
import { isPlace } from "./places.js";
import { isObject } from "./sections.js";

/** The poses of a project. Throws a FileFault that names `file` and the pose. */
export function readKeyPoses(json: unknown, file: string): KeyPose[] {
  if (!Array.isArray(json)) throw new FileFault(`In ${file}, “poses” is not a list.`);
  const names = new Set<string>();
  return json.map((one: unknown, k) => {
    const pose = poseOf(one);
    if (!pose || names.has(pose.name)) {
      throw new FileFault(`In ${file}, pose ${k + 1} has no name of its own, no p, or a handle without a place.`);
    }
    names.add(pose.name);
    return pose;
  });
}

function poseOf(json: unknown): KeyPose | undefined {
  const { name, p, handles } = isObject(json) ? json : {};
  if (typeof name !== "string" || name.length > 100 || !Array.isArray(handles)) return undefined;
  if (typeof p !== "number" || !(p >= leastP && p <= mostP)) return undefined;
  const places = handles.map(handleOf);
  return places.every((one) => one !== undefined) ? { name, p, handles: places } : undefined;
}

function handleOf(json: unknown): KeyPose["handles"][number] | undefined {
  const { name, pose, targets } = isObject(json) ? json : {};
  const read = readPose(pose);
  if (typeof name !== "string" || !read) return undefined;
  if (targets !== undefined && !(Array.isArray(targets) && targets.every((value) => Number.isFinite(value)))) return undefined;
  return { name, pose: read, ...(targets !== undefined && { targets: targets as number[] }) };
}

/** Undefined if it is none. */
export function readPose(json: unknown): Pose | undefined {
  const { rotation, translation, center, scale } = isObject(json) ? json : {};
  if (!isRotation(rotation) || !isPlace(translation) || !isPlace(center)) return undefined;
  if (scale === undefined) return { rotation, translation, center };
  return isScale(scale) ? { rotation, translation, center, scale } : undefined;
}

function isScale(json: unknown): json is Vector3 {
  return isPlace(json) && json.every((value) => value >= leastScale && value <= mostScale);
}

function isRotation(json: unknown): json is Quaternion {
  return Array.isArray(json) && json.length === 4 && Math.abs(Math.hypot(...(json as number[])) - 1) < 1e-6;
}
