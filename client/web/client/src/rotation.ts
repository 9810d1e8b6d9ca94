import { mistyped } from "./key_checks.js";
import type { MatrixMotion, QuaternionMotion, RigidMotion, Vector3 } from "./types.js";

// Other ways to say a rigid motion. The contract has axis and angle.

/** How far a matrix of floats that were multiplied a few times may be from a rotation. */
const tolerance = 1e-5;

export function rigidOf(motion: RigidMotion | QuaternionMotion | MatrixMotion): RigidMotion {
  if ("matrix" in motion) return ofMatrix(Array.from(motion.matrix));
  if (!("quaternion" in motion)) return motion;
  const { quaternion, ...rest } = motion;
  return { ...ofQuaternion(quaternion), ...rest };
}

export function checkQuaternion(given: unknown, owner: string): void {
  const numbers = numbersOf(given);
  const isOne = numbers?.length === 4 && Math.hypot(...numbers) > 0;
  const element = `quaternion of ${owner}`;
  if (!isOne) throw mistyped(`${element} is ${shown(given)}`, element, "four numbers x, y, z, w that are not all 0");
}

export function checkMatrix(given: unknown, owner: string): void {
  const element = `matrix of ${owner}`;
  const m = numbersOf(given);
  if (m?.length !== 16) throw mistyped(`${element} is ${shown(given)}`, element, "16 numbers, column by column");
  const columns = [0, 4, 8].map((k) => m.slice(k, k + 3) as unknown as Vector3);
  const [x, y, z] = columns as [Vector3, Vector3, Vector3];
  const isOrthonormal = columns.every((a, i) => columns.every((b, j) => near(dot(a, b), i === j ? 1 : 0)));
  const isAffine = near(m[3]!, 0) && near(m[7]!, 0) && near(m[11]!, 0) && near(m[15]!, 1);
  if (isOrthonormal && isAffine && dot(cross(x, y), z) > 0) return;
  const limit = "a rotation and a translation, without scale, shear or mirror";
  throw mistyped(`${element} is ${shown(given)}`, element, limit);
}

function near(value: number, wanted: number): boolean {
  return Math.abs(value - wanted) <= tolerance;
}

/** Undefined if it is no array of finite numbers. */
function numbersOf(given: unknown): number[] | undefined {
  if (!Array.isArray(given) && !ArrayBuffer.isView(given)) return undefined;
  const numbers = Array.from(given as unknown as ArrayLike<unknown>);
  return numbers.every((value) => Number.isFinite(value)) ? (numbers as number[]) : undefined;
}

function shown(given: unknown): string {
  return ArrayBuffer.isView(given)
    ? JSON.stringify(Array.from(given as unknown as ArrayLike<number>))
    : JSON.stringify(given);
}

function ofQuaternion([x, y, z, w]: QuaternionMotion["quaternion"]): RigidMotion {
  const length = Math.hypot(x, y, z);
  return length === 0 ? {} : { axis: [x / length, y / length, z / length], angle: 2 * Math.atan2(length, w) };
}

function ofMatrix(m: readonly number[]): RigidMotion {
  return { ...ofQuaternion(quaternionOf(m)), translation: [m[12]!, m[13]!, m[14]!] };
}

/** Of the greatest of its four numbers first, because dividing by a small one loses digits. */
function quaternionOf(m: readonly number[]): QuaternionMotion["quaternion"] {
  const [xx, yy, zz] = [m[0]!, m[5]!, m[10]!];
  const [yz, zx, xy] = [m[6]! + m[9]!, m[8]! + m[2]!, m[1]! + m[4]!];
  const [x, y, z] = [m[6]! - m[9]!, m[8]! - m[2]!, m[1]! - m[4]!];
  const trace = xx + yy + zz;
  if (trace >= Math.max(xx, yy, zz)) return [x, y, z, 1 + trace];
  if (xx >= Math.max(yy, zz)) return [1 + xx - yy - zz, xy, zx, x];
  if (yy >= zz) return [xy, 1 + yy - zz - xx, yz, y];
  return [zx, yz, 1 + zz - xx - yy, z];
}

function dot(a: Vector3, b: Vector3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function cross(a: Vector3, b: Vector3): Vector3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
