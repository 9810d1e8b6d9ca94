import { changeHandle, type Document, type Handle, handleOf, type KeyPose } from "./document.js";
import { about, add, axisAngle, conjugate, noScale, type Pose, product, quaternionOf, scaled } from "./pose.js";

/** The document as it is, under the first free name of the form "Pose 2". */
export function keyPoseOf({ keyPoses = [], handles, p }: Document): KeyPose {
  let number = 1;
  while (keyPoses.some(({ name }) => name === `Pose ${number}`)) ++number;
  return {
    name: `Pose ${number}`,
    p,
    handles: handles.map(({ name, pose, targets }) => ({ name, pose, ...(targets && { targets }) })),
  };
}

/** The document at a pose. Handles that the pose does not know stay; those that are gone do not come back. */
export function atPose(document: Document, pose: KeyPose): Document {
  return between(document, pose, pose, 1);
}

/** The document at a share of the way from one pose to another: rotations by the shorter way, p and scales by their logarithms. */
export function between(document: Document, from: KeyPose, to: KeyPose, share: number): Document {
  const p = share === 1 ? to.p : from.p * (to.p / from.p) ** share;
  let result: Document = { ...document, p };
  for (const end of to.handles) {
    const handle = handleOf(document, end.name);
    const start = from.handles.find(({ name }) => name === end.name) ?? end;
    if (handle) result = changeHandle(result, end.name, mixed(handle, start, end, share));
  }
  return result;
}

type Place = Pick<Handle, "pose" | "targets">;

function mixed({ pose, targets }: Handle, from: Place, to: Place, share: number): Partial<Handle> {
  if (!targets) {
    const [a, b] = [about(from.pose, pose.center), about(to.pose, pose.center)];
    return { pose: share === 1 ? b : mixedPose(a, b, share) };
  }
  const [a, b] = [from.targets, to.targets];
  if (a?.length !== targets.length || b?.length !== targets.length) return {}; // of other vertices
  return { targets: a.map((value, k) => value + share * (b[k]! - value)) };
}

/** Both have the same center. */
function mixedPose(from: Pose, to: Pose, share: number): Pose {
  const { axis, angle } = axisAngle(product(to.rotation, conjugate(from.rotation)));
  const shorter = angle > Math.PI ? angle - 2 * Math.PI : angle;
  const move = to.translation.map((value, k) => share * (value - from.translation[k]!)) as [number, number, number];
  const [low, high] = [from.scale ?? noScale, to.scale ?? noScale];
  const scale = low.map((value, k) => value * (high[k]! / value) ** share) as [number, number, number];
  const pose = {
    center: from.center,
    translation: add(from.translation, move),
    rotation: product(quaternionOf(axis, share * shorter), from.rotation),
  };
  return scaled(pose, scale);
}

/** The document at a time in seconds when its poses are played one after the other; undefined at their end. */
export function played(document: Document, seconds: number, secondsEach: number): Document | undefined {
  const { keyPoses = [] } = document;
  const at = seconds / secondsEach;
  const from = Math.floor(at);
  if (from + 1 >= keyPoses.length) return undefined;
  const t = at - from;
  return between(document, keyPoses[from]!, keyPoses[from + 1]!, t * t * (3 - 2 * t)); // slow at each pose
}
