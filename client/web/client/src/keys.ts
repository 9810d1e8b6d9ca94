import { LpdeformError } from "./errors.js";
import { checkHold } from "./hold_kinds.js";
import { checkKeys, checkVector, checkVectors, checkWord, isNumbers, mistyped, refused } from "./key_checks.js";
import { checkMatrix, checkQuaternion } from "./rotation.js";
import type * as api from "./types.js";

// The keys of what callers pass in. An unknown key is refused by name, because ignoring it would not do what the caller meant. The
// compiler makes sure that no key of types.ts is missing here.

type Keys<Bag> = Readonly<Record<Bag extends unknown ? keyof Bag : never, true>>;

const connect: Keys<api.ConnectOptions> = {
  url: true,
  callTimeoutMs: true,
  reconnectForMs: true,
  token: true,
  fetch: true,
};
const frames: Keys<api.FrameOptions> = {
  credit: true,
  withoutDistortion: true,
  withNormals: true,
  certify: true,
  maxFramesPerSecond: true,
  encoding: true,
  lowestEncoding: true,
  shading: true,
};
const restore: Keys<api.RestoreOptions> = { ...connect, ...frames, signal: true };
const join: Keys<api.JoinOptions> = { ...restore, role: true };
const open: Keys<api.OpenOptions> = { ...restore, weights: true, freeComponents: true, weld: true, settings: true };
const solve: Keys<api.DoubleSolveOptions> = {
  certify: true,
  trace: true,
  withNormals: true,
  initialPositions: true,
  onProgress: true,
  deadlineMs: true,
  signal: true,
  scalar: true,
};
const byPosition: Keys<api.WeldByPosition> = { tolerance: true };
const mesh: Keys<api.Mesh> = { vertices: true, faces: true, normals: true };
const update: Keys<api.Update> = { handles: true, settings: true, resize: true, beginsStep: true };
const change: Keys<api.HandleChange> = { set: true, move: true, remove: true };
const handle: Keys<api.Handle> = { vertices: true, points: true, motion: true, hold: true, footprint: true };
const point: Keys<api.SurfacePoint> = { face: true, barycentric: true };
const rigid: Keys<api.RigidMotion> = { axis: true, angle: true, center: true, translation: true };
const quaternion: Keys<api.QuaternionMotion> = { quaternion: true, center: true, translation: true };
const matrix: Keys<api.MatrixMotion> = { matrix: true };
const targets: Keys<api.TargetPositions> = { targets: true };
const settings: Keys<api.Settings> = { p: true, stiffness: true, lengthUnit: true, solver: true, region: true };
const solver: Keys<api.SolverSettings> = {
  method: true,
  tolerance: true,
  maxIterations: true,
  timeLimitSeconds: true,
  initial: true,
  search: true,
};
const search: Keys<api.MinimaSearch> = { effort: true, show: true, leastShare: true };
const resize: Keys<api.Resize> = { scale: true, origin: true, axes: true };

const methods: Readonly<Record<api.Method, true>> = {
  auto: true,
  quasiNewton: true,
  lineSearch: true,
  localGlobal: true,
  conic: true,
  multiresolution: true,
};
const guesses: Readonly<Record<api.InitialGuess, true>> = { current: true, laplacian: true, rest: true };
const weights: Readonly<Record<api.WeightKind, true>> = { cotangent: true, uniform: true, intrinsicDelaunay: true };
const free: Readonly<Record<api.FreeComponents, true>> = { error: true, stay: true, follow: true };
const encodings: Readonly<Record<api.Encoding, true>> = {
  float32: true,
  float64: true,
  quantized: true,
  compressed: true,
};

/** Its keys, and what the contract has no room for. */
export function checkMesh(given: api.Mesh): void {
  checkKeys(given, mesh, "mesh");
  for (const element of ["vertices", "faces"] as const) {
    const { length } = given[element];
    if (length % 3 === 0) continue;
    const text = `The ${element} are ${length} numbers, which are not three each.`;
    throw new LpdeformError("invalid_argument", text, { reason: "MESH_SIZE", element, limit: "a multiple of 3" });
  }
}

export function checkOpenOptions(given: api.OpenOptions): void {
  checkKeys(given, open, "options");
  checkEncodings(given);
  checkWord(given.weights, weights, "weights");
  checkWord(given.freeComponents, free, "freeComponents");
  const { weld } = given;
  if (typeof weld === "string") checkWord(weld, { byPosition: true }, "weld");
  else if (weld && !isNumbers(weld)) checkKeys(weld, byPosition, "weld");
  if (given.settings) checkSettings(given.settings);
}

export function checkRestoreOptions(given: api.RestoreOptions): void {
  checkKeys(given, restore, "options");
  checkEncodings(given);
}

export function checkJoinOptions(given: api.JoinOptions): void {
  checkKeys(given, join, "options");
  checkEncodings(given);
  checkWord(given.role, { reader: true, writer: true }, "role");
}

export function checkSolveOptions(given: api.SolveOptions | api.DoubleSolveOptions): void {
  checkKeys(given, solve, "options");
  if ("scalar" in given) checkWord(given.scalar, { float64: true }, "scalar");
}

/** For calls with few options, whose names are `known`. */
export function checkCallOptions(given: object, ...known: string[]): void {
  checkKeys(given, Object.fromEntries(known.map((key) => [key, true])), "options");
}

export function checkUpdate(given: api.Update): void {
  checkKeys(given, update, "update");
  for (const [name, one] of Object.entries(given.handles ?? {})) checkChange(one, `handle "${name}"`);
  if (given.settings) checkSettings(given.settings);
  if (!given.resize) return;
  checkKeys(given.resize, resize, "resize");
  checkVectors(given.resize, ["scale", "origin"], "resize");
  given.resize.axes?.forEach((axis, k) => checkVector(axis, `axes[${k}] of resize`));
}

function checkChange(given: api.HandleChange, owner: string): void {
  checkKeys(given, change, owner);
  if (Object.keys(given).length !== 1) throw refused(`${owner} needs one of set, move and remove`, owner, change);
  if ("move" in given) checkMotion(given.move, owner);
  if ("set" in given) checkHandle(given.set, owner);
}

function checkHandle(given: api.Handle, owner: string): void {
  checkKeys(given, handle, owner);
  for (const one of given.points ?? []) checkKeys(one, point, `a point of ${owner}`);
  if (given.motion !== undefined) checkMotion(given.motion, owner);
  if (given.hold) checkHold(given.hold, owner);
}

function checkMotion(given: api.Motion, owner: string): void {
  const element = `motion of ${owner}`;
  if (typeof given === "string") checkWord(given, { fixed: true }, element);
  else if ("targets" in given) checkKeys(given, targets, element);
  else if ("matrix" in given) {
    checkKeys(given, matrix, element);
    checkMatrix(given.matrix, element);
  } else if ("quaternion" in given) {
    checkKeys(given, quaternion, element);
    checkQuaternion(given.quaternion, element);
    checkVectors(given, ["center", "translation"], element);
  } else {
    checkKeys(given, rigid, element);
    checkVectors(given, ["axis", "center", "translation"], element);
  }
}

function checkSettings(given: api.Settings): void {
  checkKeys(given, settings, "settings");
  for (const field of ["p", "stiffness"] as const) {
    checkField(given[field], field);
  }
  if (!given.solver) return;
  checkKeys(given.solver, solver, "solver");
  checkWord(given.solver.method, methods, "method");
  checkWord(given.solver.initial, guesses, "initial");
  if (given.solver.search) checkKeys(given.solver.search, search, "search");
}

function checkField(value: unknown, field: string): void {
  if (value === undefined || typeof value === "number") return;
  if (typeof value !== "object" || value === null)
    throw mistyped(`${field} is ${String(value)}`, field, "a number, one a vertex, or { automatic: strength }");
  if (!isNumbers(value)) checkKeys(value, { automatic: true }, field);
}

function checkEncodings({ encoding, lowestEncoding }: api.FrameOptions): void {
  checkWord(encoding, encodings, "encoding");
  checkWord(lowestEncoding, encodings, "lowestEncoding");
}
