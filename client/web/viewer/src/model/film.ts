import type { Shape } from "./blend.js";
import type { Document } from "./document.js";
import { atPose, played } from "./key_poses.js";

/** A moment of the poses as they are played: the document then, and what to call it. */
export interface Moment {
  name: string;
  document: Document;
}

/** The moments of a film of the document's poses: each pose, and `steps` - 1 between it and the next, evenly in time. */
export function momentsOf(document: Document, steps: number): Moment[] {
  const { keyPoses = [] } = document;
  const last = keyPoses.at(-1);
  const moments = keyPoses.slice(0, -1).flatMap(({ name }, pose) =>
    Array.from({ length: steps }, (_, step) => ({
      name: step === 0 ? name : `${name} to ${keyPoses[pose + 1]!.name}, ${Math.round((100 * step) / steps)} %`,
      document: played(document, pose * steps + step, steps)!,
    })),
  );
  return last ? [...moments, { name: last.name, document: atPose(document, last) }] : [];
}

/** The shape at `at` of a film: 0 is the first, 1 the second, and what is between them is interpolated. */
export function shapeAt(shapes: readonly Shape[], at: number): Shape {
  const k = Math.min(Math.max(Math.floor(at), 0), shapes.length - 1);
  const [from, to] = [shapes[k]!, shapes[Math.min(k + 1, shapes.length - 1)]!];
  const share = Math.min(Math.max(at - k, 0), 1);
  const mix = (a: Float32Array, b: Float32Array) => a.map((value, j) => value + share * (b[j]! - value));
  return share === 0 ? from : { positions: mix(from.positions, to.positions), distortion: mix(from.distortion, to.distortion) };
}
