/** A triangle mesh as flat arrays. Vertex order is never changed by anybody. The arrays are kept and must not change. */
export interface Mesh {
  /** x, y, z of each vertex, in the caller's unit of length. */
  vertices: Float32Array | Float64Array | readonly number[];
  /** Three 0-based vertex indices a triangle, counter-clockwise seen from outside. */
  faces: Uint32Array | readonly number[];
  /** x, y, z of a normal for each vertex as it is drawn, of any length; 0 asks for the smooth one. For frames with normals. */
  normals?: Float32Array | Float64Array | readonly number[];
}

export type Vector3 = readonly [number, number, number];

/** x = R (p - center) + center + translation for every vertex of the handle; always relative to the rest mesh. */
export interface RigidMotion {
  /** Of any length but 0; z where left out. */
  axis?: Vector3;
  /** Counter-clockwise seen against the axis; 0 where left out. */
  angle?: number;
  /** The rest mesh's origin where left out. */
  center?: Vector3;
  translation?: Vector3;
}

/** Absolute positions: x, y, z for each of the handle's vertices or points, in their order. */
export interface TargetPositions {
  targets: Float32Array | Float64Array | readonly number[];
}

/** Where a handle goes: "fixed" stays where the rest mesh has it. */
export type Motion = "fixed" | RigidMotion | TargetPositions;

/** How a handle is held; a target is where its motion sends a vertex or point. */
export type Hold =
  /** Exactly at its target. */
  | { kind: "exact" }
  /** Drawn to its target: 0 lets go, 1 is about as strong as one edge of the surface. 0 to 1e6; 1 where left out. */
  | { kind: "soft"; weight?: number }
  /** Turned by the rotation of the handle's motion, its position free. Vertices only, no targets. 0 to 1e6; else 100. */
  | { kind: "orientation"; weight?: number }
  /** Free along a line through its target. Vertices only. */
  | { kind: "axisLock"; axis: Vector3 }
  /** Free within a plane through its target. Vertices only. */
  | { kind: "planeLock"; normal: Vector3 };

/** A point inside a face of the rest mesh: barycentric coordinates, each at least 0, their sum 1, both to 1e-6. */
export interface SurfacePoint {
  face: number;
  barycentric: Vector3;
}

/** A group of vertices, or of points inside faces, that the user holds. A vertex belongs to one handle at most. */
export interface Handle {
  vertices?: Uint32Array | readonly number[];
  /** In place of vertices; held exactly or soft. */
  points?: readonly SurfacePoint[];
  /** "fixed" where left out. */
  motion?: Motion;
  /** Exact where left out. */
  hold?: Hold;
  /** Radius, along the surface, of the surroundings that go along nearly rigidly, against spikes. 0: none. */
  footprint?: number;
}

export type Method = "auto" | "quasiNewton" | "lineSearch" | "localGlobal" | "conic" | "multiresolution";

/** Where a solve starts: from the session's present state, the naive Laplacian deformation, or the rest mesh. */
export type InitialGuess = "current" | "laplacian" | "rest";

/** How a solve is made and when it stops. One setting: it is replaced whole. What is left out is the server's default. */
export interface SolverSettings {
  method?: Method;
  /** 1e-14 to 0.1. */
  tolerance?: number;
  maxIterations?: number;
  /** Without limit where left out. */
  timeLimitSeconds?: number;
  initial?: InitialGuess;
}

/** The same number everywhere, one a vertex, or found by the server from the shape's geometry (strength 0 to 1). */
export type FieldValue = number | Float32Array | Float64Array | readonly number[] | { automatic: number };

/** What is left out keeps its value. */
export interface Settings {
  /** 1 to 64. */
  p?: FieldValue;
  /** 1e-6 to 1e6. */
  stiffness?: FieldValue;
  /** Of mixed norms, in the mesh's unit; 0 takes the mean rest edge length. */
  lengthUnit?: number;
  solver?: SolverSettings;
  /** The vertices that may move; everything outside is held where it is. Empty: everything may move again. */
  region?: Uint32Array | readonly number[];
}

/**
 * A scaling by different factors along three axes in which salient parts keep their shape and size. Makes the handle "resize",
 * which holds the ends along scaled axes; along the others the extent changes, unless plane locks hold ends there.
 */
export interface Resize {
  /** Along the axes, relative to the rest mesh; each 0.01 to 100. */
  scale: Vector3;
  /** Stays where it is; the middle of the mesh's bounding box where left out. */
  origin?: Vector3;
  /** Of the first and the second axis, of any length; x and y of the mesh where left out. */
  axes?: readonly [Vector3, Vector3];
}

/** A change of handles and settings; the server takes it whole or not at all. */
export interface Update {
  /** A Handle under `set` adds or replaces, a Motion under `move` moves, `remove` lets go of the handle of that name. */
  handles?: Readonly<Record<string, HandleChange>>;
  settings?: Settings;
  resize?: Resize;
  /**
   * What it does to handles is a step of its own, which Session.undo() takes back: to be set when a drag begins. Otherwise
   * updates that move the same handles, none of them over a second after the one before, are one step, and each other
   * update that changes handles is one. Settings are no part of steps.
   */
  beginsStep?: boolean;
}

export type HandleChange = { set: Handle } | { move: Motion } | { remove: true };

/** One kind of defect of a mesh: "zero_area_faces". */
export interface Defect {
  kind: string;
  count: number;
  /** The first few by index; an edge is two vertex indices. */
  first: readonly number[];
}

/** What the server found in the mesh. */
export interface MeshReport {
  vertices: number;
  faces: number;
  edges: number;
  components: number;
  boundaryLoops: number;
  /** Every kind, also those with count 0. */
  defects: readonly Defect[];
  /** Copies of a vertex before them. */
  weldedVertices: number;
  /** What is to be known before the mesh is deformed, one sentence for people each: that it comes apart where it is split. */
  notices: readonly string[];
}

export type StopReason =
  "running" | "converged" | "iteration_limit" | "time_limit" | "cancelled" | "stalled" | "numerical_breakdown";

/**
 * How positions, distortion and normals travel. "float32": 16 bytes a vertex with distortion, 12 without; exact to float32.
 * "float64": twice that, as the server computes (Frame.doubles).
 * "quantized": 8 bytes, off by at most half of 1/65535 of the frame's extent along each axis (distortion: of its largest).
 * "compressed": the same numbers, by meshoptimizer's vertex codec, 3 to 5 bytes on smooth surfaces. The last two always carry distortion.
 */
export type Encoding = "float32" | "float64" | "quantized" | "compressed";

/** 16-bit integers, to be used as they are as normalised vertex attributes of four components, at a stride of 8 bytes. */
export interface QuantizedSurface {
  /** x, y, z and distortion of each vertex: position = origin + q / 65535 extent, by components. */
  vertices: Uint16Array;
  /** x, y, z and 0 of each normal, of 32767; empty where normals were not asked for. */
  normals: Int16Array;
  origin: Vector3;
  extent: Vector3;
  /** E_i = q / 65535 distortionExtent. */
  distortionExtent: number;
}

/** As Frame has them; empty where they were not asked for. */
export interface DoubleSurface {
  readonly positions: Float64Array;
  readonly distortion: Float64Array;
  readonly normals: Float64Array;
}

/**
 * A state of the surface on its way to the optimum. The arrays are the caller's to keep, and are views of what came. Where the
 * frame came as doubles or quantized, positions, distortion and normals are made when they are first read.
 */
export interface Frame {
  /** x, y, z of each vertex. */
  readonly positions: Float32Array;
  /** E_i of each vertex, in the mesh's unit of length; empty where it was not asked for. */
  readonly distortion: Float32Array;
  /** x, y, z of a normal of length 1 for each vertex; empty where it was not asked for. */
  readonly normals: Float32Array;
  /** What came, where it came "quantized" or "compressed". */
  readonly quantized: QuantizedSurface | undefined;
  /** What came, where it came as "float64". */
  readonly doubles: DoubleSurface | undefined;
  /** The newest update it answers: see Session.update; never falls. */
  readonly inputSeq: number;
  /** Rises within an epoch. */
  readonly frameSeq: number;
  readonly epoch: number;
  /** Updates since the frame before that no frame answers. */
  readonly skippedInputs: number;
  readonly iteration: number;
  /** E of the positions, Eq. 3 of the paper, in the mesh's unit, with soft terms. */
  readonly energy: number;
  /** The part of it that soft and orientation handles have. */
  readonly softEnergy: number;
  /**
   * The result for inputSeq, however its solve ended (stopReason): no further frame until there is a new update, but for the same one
   * with its optimalityGap.
   */
  readonly isFinal: boolean;
  readonly stopReason: StopReason;
  /** (energy - lower bound) / energy of the convex problem with its rotations held. In results alone, see FrameOptions.certify. */
  readonly optimalityGap: number | undefined;
  readonly solveSeconds: number;
  /** "quasi_newton" and so on; empty before the first solve. */
  readonly method: string;
  /** Of the numbers above, as they travelled. */
  readonly wireBytes: number;
  /** When its last part came, in milliseconds of performance.now(). */
  readonly receivedAt: number;
}

export interface SolveProgress {
  iteration: number;
  energy: number;
  seconds: number;
}

export interface IterationRecord {
  iteration: number;
  seconds: number;
  /** The true one. */
  energy: number;
  /** What the method minimises, in its own unit. */
  objective: number;
  stage: number;
}

export interface SolveOptions {
  /** Compute SolveResult.optimalityGap. */
  certify?: boolean;
  /** Fill SolveResult.trace. */
  trace?: boolean;
  withNormals?: boolean;
  /** x, y, z of each vertex, in place of the initial guess. */
  initialPositions?: Float32Array | Float64Array | readonly number[];
  /** Called at most ten times a second. */
  onProgress?: (progress: SolveProgress) => void;
  /** Of the whole call; without limit where left out. When it has passed, the server stops as well. */
  deadlineMs?: number;
  signal?: AbortSignal;
}

/** For a result in the doubles that the server computes in: 32 bytes a vertex. */
export interface DoubleSolveOptions extends SolveOptions {
  scalar: "float64";
}

export interface SolveResult<Numbers = Float32Array> {
  /** x, y, z of each vertex. */
  positions: Numbers;
  /** E_i of each vertex. */
  distortion: Numbers;
  /** x, y, z of a normal of length 1 for each vertex; empty where it was not asked for. */
  normals: Numbers;
  method: string;
  stopReason: StopReason;
  iterations: number;
  initialEnergy: number;
  energy: number;
  softEnergy: number;
  /** (E - lower bound) / E of the convex problem with its rotations held; where it was asked for. */
  optimalityGap?: number;
  setupSeconds: number;
  solveSeconds: number;
  threads: number;
  inputSeq: number;
  trace: readonly IterationRecord[];
}

/** What becomes of a connected component that no handle holds: refused, stays at rest, or moves with the nearest handle. */
export type FreeComponents = "error" | "stay" | "follow";

export type WeightKind = "cotangent" | "uniform" | "intrinsicDelaunay";

export interface WeldByPosition {
  /**
   * Vertices no farther apart than this share of the bounding box's diagonal are one, as are those that a chain of such steps
   * connects. 0 to 0.001; 1e-6 where left out or 0.
   */
  tolerance?: number;
}

/** Vertices that are copies of one: by position, "byPosition" being {}; or one number a vertex, the same for copies. */
export type Weld = "byPosition" | WeldByPosition | Uint32Array | readonly number[];

/**
 * "idle" before the first frame is asked for, and while the page is hidden, has nothing to send and does not settle(); frames
 * come again when it is seen. "reconnecting" while the server is away; "closed" when all is over.
 */
/** What a server says about itself; nothing failed. */
export interface Notice {
  /** After "overloaded" frames come less often, and the last one of an update later, until "recovered". "other": of a newer server. */
  reason: "overloaded" | "recovered" | "other";
  /** One sentence for people. */
  text: string;
}

export type Connection = "idle" | "connected" | "reconnecting" | "closed";

/** How frames travel. */
export interface FrameOptions {
  /** Frames that may be under way and not yet taken, 1 to 8; the server's 2 where left out. */
  credit?: number;
  withoutDistortion?: boolean;
  withNormals?: boolean;
  /**
   * A result comes again, with its Frame.optimalityGap, unless a new update comes first: the server looks for it once updates
   * have paused for a tenth of a second.
   */
  certify?: boolean;
  /** Without limit where left out; the last frame of an update always comes. */
  maxFramesPerSecond?: number;
  /** "float32" where left out. */
  encoding?: Encoding;
  /** What the server may go down to where its limit of bytes a second asks for it; "quantized" where left out. */
  lowestEncoding?: Encoding;
}

export interface ConnectOptions {
  /** Of the proxy, "https://host:port"; the page's own origin where left out. */
  url?: string;
  /** Of every call but solve, which has its own; 30 s where left out. */
  callTimeoutMs?: number;
  /** A session whose server stays away for longer gives up; 2 minutes where left out. */
  reconnectForMs?: number;
  /**
   * Gives the bearer token of each call when that begins, so that tokens may be renewed; an empty one counts as none. Sessions
   * share a connection where they are given the same function. Where it fails, so does what it was asked for (TOKEN_FUNCTION): an
   * update is refused, a session whose stream has to be opened is over.
   */
  token?: () => string | Promise<string>;
  /** In place of the platform's, for tests and for programs outside a browser. */
  fetch?: typeof globalThis.fetch;
}

export interface OpenOptions extends ConnectOptions, FrameOptions {
  weights?: WeightKind;
  freeComponents?: FreeComponents;
  weld?: Weld;
  settings?: Settings;
  /** Of opening; an open session is ended by close(). */
  signal?: AbortSignal;
}

export interface RestoreOptions extends ConnectOptions, FrameOptions {
  /** Of restoring; an open session is ended by close(). */
  signal?: AbortSignal;
}

export interface JoinOptions extends ConnectOptions, FrameOptions {
  /** "reader" where left out. A writer takes over from whoever is. */
  role?: "reader" | "writer";
  signal?: AbortSignal;
}
