import * as three from "three";
import { noScale, type Pose } from "../model/pose.js";

/** The vertex's place in shaders: what a handle has moved since the frame, as far as the vertex goes along. */
export const place = `
attribute float pull;
uniform mat4 ahead;
vec3 placed() {
  return mix(position, (ahead * vec4(position, 1.0)).xyz, pull);
}`;

/** For points on the surface: before it, in the same place of the picture. */
export const before = `
vec4 before(vec4 seen) {
  return isOrthographic ? seen + vec4(0.0, 0.0, 0.014 / projectionMatrix[1][1], 0.0) : vec4(0.996 * seen.xyz, 1.0);
}`;

/** A uniform for it. */
export interface Ahead {
  value: three.Matrix4;
}

/** The motion from one pose to another. */
export function motionBetween(from: Pose, to: Pose): three.Matrix4 {
  return matrixOf(to).multiply(matrixOf(from).invert());
}

function matrixOf({ rotation, translation, center, scale = noScale }: Pose): three.Matrix4 {
  const [x, y, z] = center;
  return new three.Matrix4()
    .makeTranslation(x + translation[0], y + translation[1], z + translation[2])
    .multiply(new three.Matrix4().makeRotationFromQuaternion(new three.Quaternion(...rotation)))
    .scale(new three.Vector3(...scale))
    .multiply(new three.Matrix4().makeTranslation(-x, -y, -z));
}
