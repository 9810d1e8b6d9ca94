/** A mesh as a server has it. */
export interface RestMesh {
  /** x, y, z of each vertex. */
  vertices: Float64Array;
  /** Three vertex indices of each triangle, counter-clockwise seen from outside. */
  faces: Uint32Array;
}

/** A triangle mesh as flat arrays. The order of vertices is never changed. The arrays are kept and must not change. */
export interface Mesh {
  /** x, y, z of each vertex, in the caller's unit of length. */
  vertices: Float32Array | Float64Array | readonly number[];
  /** Three 0-based vertex indices per triangle, counter-clockwise seen from outside. */
  faces: Uint32Array | readonly number[];
  /**
   * x, y, z of a normal for each vertex as it is drawn, of any length; 0 asks for the smooth normal. For frames with normals.
   */
  normals?: Float32Array | Float64Array | readonly number[];
}

export type Vector3 = readonly [number, number, number];

/** x = R (p - center) + center + translation for every vertex of the handle; always relative to the rest mesh. */
export interface RigidMotion {
  /** Of any length but 0; default: z. */
  axis?: Vector3;
  /** Radians, counter-clockwise seen against the axis; default: 0. */
  angle?: number;
  /** Default: the rest mesh's origin. */
  center?: Vector3;
  translation?: Vector3;
}

/** A RigidMotion whose rotation is a quaternion x, y, z, w of any length but 0, as Quaternion.toArray() of three.js has it. */
export interface QuaternionMotion {
  quaternion: readonly [number, number, number, number];
  /** Default: the rest mesh's origin. */
  center?: Vector3;
  translation?: Vector3;
}

/**
 * x = M p for every vertex of the handle: 16 numbers, column by column, as Matrix4.elements of three.js has them. A rotation and a
 * translation, to within 1e-5.
 */
export interface MatrixMotion {
  matrix: Float32Array | Float64Array | readonly number[];
}

/** Absolute positions: x, y, z for each of the handle's vertices or points, in their order. */
export interface TargetPositions {
  targets: Float32Array | Float64Array | readonly number[];
}

/** Where a handle moves: "fixed" stays where the rest mesh has it. */
export type Motion = "fixed" | RigidMotion | QuaternionMotion | MatrixMotion | TargetPositions;

/** How a handle is held. A target is the place where its motion sends a vertex or point. */
export type Hold =
  /** Exactly at its target. */
  | { kind: "exact" }
  /** Pulled towards its target: 0 has no effect, 1 is about as strong as one edge of the surface. 0 to 1e6; default: 1. */
  | { kind: "soft"; weight?: number }
  /** Rotated by the handle's motion, with a free position. For vertices only, without targets. 0 to 1e6; default: 100. */
  | { kind: "orientation"; weight?: number }
  /** Free along a line through its target. For vertices only. */
  | { kind: "axisLock"; axis: Vector3 }
  /** Free within a plane through its target. For vertices only. */
  | { kind: "planeLock"; normal: Vector3 };

/** A point inside a face of the rest mesh: barycentric coordinates, each at least 0, with sum 1, both to within 1e-6. */
export interface SurfacePoint {
  face: number;
  barycentric: Vector3;
}

/** A group of vertices, or of points inside faces, that the user holds. A vertex belongs to one handle at most. */
export interface Handle {
  vertices?: Uint32Array | readonly number[];
  /** Used instead of vertices; held exactly or soft. */
  points?: readonly SurfacePoint[];
  /** Default: "fixed". */
  motion?: Motion;
  /** Default: exact. */
  hold?: Hold;
  /** Radius, along the surface, of a region around the handle that moves with it nearly rigidly, against spikes. 0: none. */
  footprint?: number;
}

export type Method = "auto" | "quasiNewton" | "lineSearch" | "localGlobal" | "conic" | "multiresolution";

/** Where a solve starts: from the session's present state, the naive Laplacian deformation, or the rest mesh. */
export type InitialGuess = "current" | "laplacian" | "rest";

/**
 * How a solve is made and when it stops. This is a single setting and is replaced as a whole. An absent value takes the
 * server's default.
 */
export interface SolverSettings {
  method?: Method;
  /** 1e-14 to 0.1. */
  tolerance?: number;
  maxIterations?: number;
  /** Default: without limit. */
  timeLimitSeconds?: number;
  initial?: InitialGuess;
  search?: MinimaSearch;
}

/**
 * How far to look for lower minima once the first one is found. The energy is not convex: it has many minima, above all where p
 * is below 2.
 */
export interface MinimaSearch {
  /**
   * The number of further starts is 12 times the effort, 0 to 1000. 0 takes the first minimum. Default: 1 if the method is "auto"
   * and p is below 2 somewhere, and for Session.solve() if it also starts cold; otherwise 0. A start takes up to two or three
   * times as long as the first minimum. Meshes of fewer than 100 vertices are not searched. Meshes of more than 15,000 vertices
   * are searched on their coarse levels, and only what is lower there is tried on the mesh itself, as one further start.
   *
   * Session.solve() finds the first minimum, then searches with what is left of its limits, and then answers. A session whose
   * frames are read shows the first minimum, and searches when nothing changes for a second. Session.solve() makes it forget the
   * shape that it has announced: Session.takeBetterShape() then rejects with NO_BETTER_SHAPE, and the session searches again.
   */
  effort?: number;
  /**
   * What the session does with a lower minimum that it has found then. False, the default: a notice "better_shape" announces it,
   * and Session.takeBetterShape() shows it. True: it is shown at once, as a new frame for the same update.
   */
  show?: boolean;
  /** The share of the energy that must be saved for this, 0 to 1; the default, also for 0, is 0.02. */
  leastShare?: number;
}

/** The same number everywhere, one per vertex, or computed by the server from the shape's geometry (strength 0 to 1). */
export type FieldValue = number | Float32Array | Float64Array | readonly number[] | { automatic: number };

/** Settings that are absent keep their values. */
export interface Settings {
  /** 1 to 64. */
  p?: FieldValue;
  /** 1e-6 to 1e6. */
  stiffness?: FieldValue;
  /** The unit of length for mixed norms, in the mesh's unit; 0 takes the mean rest edge length. */
  lengthUnit?: number;
  solver?: SolverSettings;
  /** The vertices that may move; all others stay where they are. Empty: everything may move again. */
  region?: Uint32Array | readonly number[];
}

/**
 * A scaling by different factors along three axes. Salient parts keep their shape and size. It makes the handle "resize", which
 * holds the ends along scaled axes. Along the other axes the extent changes, unless plane locks hold the ends there.
 */
export interface Resize {
  /** Along the axes, relative to the rest mesh; each 0.01 to 100. */
  scale: Vector3;
  /** The point that stays in place; default: the middle of the mesh's bounding box. */
  origin?: Vector3;
  /** Directions of the first and second axis, of any length; default: x and y of the mesh. */
  axes?: readonly [Vector3, Vector3];
}

/** A change of handles and settings; the server accepts or refuses it as a whole. */
export interface Update {
  /** A Handle under `set` adds or replaces, a Motion under `move` moves, `remove` removes the handle of that name. */
  handles?: Readonly<Record<string, HandleChange>>;
  settings?: Settings;
  resize?: Resize;
  /**
   * Whether its effect on handles begins a new step for Session.undo(). Set it when a drag begins. Otherwise updates that move
   * the same handles, none of them more than a second after the one before, are one step, and any other update that changes
   * handles is a step. Settings are not part of steps.
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

/** What the server reported of the mesh. */
export interface MeshReport {
  vertices: number;
  faces: number;
  edges: number;
  components: number;
  boundaryLoops: number;
  /** Every kind, also those with count 0. */
  defects: readonly Defect[];
  /** How many vertices are copies of an earlier one. */
  weldedVertices: number;
  /**
   * What users should know before they deform the mesh, one sentence each: for example that it comes apart where it is split.
   */
  notices: readonly string[];
}

export type StopReason =
  "running" | "converged" | "iteration_limit" | "time_limit" | "cancelled" | "stalled" | "numerical_breakdown";

/**
 * How positions, distortion and normals are sent.
 * "float32": 16 bytes per vertex with distortion, 12 without; exact to float32.
 * "float64": twice that, as the server computes (Frame.doubles).
 * "quantized": 8 bytes, off by at most half of 1/65535 of the frame's extent along each axis (distortion: of its largest).
 * "compressed": the same numbers by meshoptimizer's vertex codec, 3 to 5 bytes on smooth surfaces.
 * The last two always include distortion.
 */
export type Encoding = "float32" | "float64" | "quantized" | "compressed";

/** 16-bit integers that can be used directly as normalised vertex attributes of four components, with a stride of 8 bytes. */
export interface QuantizedSurface {
  /** x, y, z and distortion of each vertex: position = origin + q / 65535 * extent, per component. */
  vertices: Uint16Array;
  /** x, y, z and 0 of each normal, with 32767 for 1; empty if normals were not requested. */
  normals: Int16Array;
  origin: Vector3;
  extent: Vector3;
  /** E_i = q / 65535 * distortionExtent. */
  distortionExtent: number;
}

/** The same values as in Frame; empty if they were not requested. */
export interface DoubleSurface {
  readonly positions: Float64Array;
  readonly distortion: Float64Array;
  readonly normals: Float64Array;
}

/**
 * A state of the surface on its way to the result. The caller may keep the arrays, which are views of the received message.
 * For a frame of doubles or a quantized frame, positions, distortion and normals are computed when they are first read.
 */
export interface Frame {
  /** x, y, z of each vertex. */
  readonly positions: Float32Array;
  /** E_i of each vertex, in the mesh's unit of length; empty if it was not requested. */
  readonly distortion: Float32Array;
  /** x, y, z of a normal of length 1 for each vertex; empty if normals were not requested. */
  readonly normals: Float32Array;
  /** The received integers of a frame in encoding "quantized" or "compressed". */
  readonly quantized: QuantizedSurface | undefined;
  /** The received doubles of a frame in encoding "float64". */
  readonly doubles: DoubleSurface | undefined;
  /** What is drawn of it, if the session has `shading`. */
  readonly shaded: Shaded | undefined;
  /** The newest update that the frame answers: see Session.update; never falls. */
  readonly inputSeq: number;
  /** Rises within an epoch. */
  readonly frameSeq: number;
  readonly epoch: number;
  /** Updates since the previous frame that no frame answers. */
  readonly skippedInputs: number;
  readonly iteration: number;
  /** E of the positions, Eq. 3 of the paper, in the mesh's unit, including soft terms. */
  readonly energy: number;
  /** The part of the energy that soft and orientation handles have. */
  readonly softEnergy: number;
  /**
   * Whether this is the result for inputSeq, however its solve ended (stopReason). No further frame comes until there is a new
   * update, except the same frame with its optimalityGap, and a better shape that is taken or shown (MinimaSearch).
   */
  readonly isFinal: boolean;
  readonly stopReason: StopReason;
  /**
   * (energy - lower bound) / energy of the convex problem with its rotations held. Only in results, see FrameOptions.certify.
   */
  readonly optimalityGap: number | undefined;
  readonly solveSeconds: number;
  /** "quasi_newton" and so on; empty before the first solve. */
  readonly method: string;
  /** Bytes of the numbers above as received. */
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
  /** The true energy. */
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
  /** x, y, z of each vertex, instead of the initial guess. */
  initialPositions?: Float32Array | Float64Array | readonly number[];
  /** Called at most ten times per second. */
  onProgress?: (progress: SolveProgress) => void;
  /** For the whole call; default: without limit. When it has passed, the server stops as well. */
  deadlineMs?: number;
  signal?: AbortSignal;
}

/** For a result in the doubles that the server computes: 32 bytes per vertex. */
export interface DoubleSolveOptions extends SolveOptions {
  scalar: "float64";
}

export interface SolveResult<Numbers = Float32Array> {
  /** x, y, z of each vertex. */
  positions: Numbers;
  /** E_i of each vertex. */
  distortion: Numbers;
  /** x, y, z of a normal of length 1 for each vertex; empty if normals were not requested. */
  normals: Numbers;
  method: string;
  stopReason: StopReason;
  iterations: number;
  initialEnergy: number;
  energy: number;
  softEnergy: number;
  /** (E - lower bound) / E of the convex problem with its rotations held, if it was requested. */
  optimalityGap?: number;
  setupSeconds: number;
  solveSeconds: number;
  threads: number;
  inputSeq: number;
  /**
   * The energies of minima, in order: the first one, then one for each start of the search for lower ones (see MinimaSearch)
   * that has converged, or has come back to the lowest minimum, whose energy it then has. Several starts may come to the same
   * minimum. Starts that were given up have no entry. `energy` is the lowest. Empty if a limit has ended the solve before the
   * first.
   */
  minima: readonly number[];
  /** How many further starts the search made, including those that were given up. */
  furtherStarts: number;
  /** The part of `iterations` that the search made. */
  searchIterations: number;
  /** The effort of the search: the one asked for, or the default. */
  effort: number;
  trace: readonly IterationRecord[];
}

/** What happens to a connected component that no handle holds: refused, stays at rest, or moves with the nearest handle. */
export type FreeComponents = "error" | "stay" | "follow";

export type WeightKind = "cotangent" | "uniform" | "intrinsicDelaunay";

export interface WeldByPosition {
  /**
   * Vertices that are no farther apart than this share of the bounding box's diagonal are one, and so are those that a chain of
   * such steps connects. 0 to 0.001; the default, also for 0, is 1e-6.
   */
  tolerance?: number;
}

/**
 * Vertices that are copies of one: by position ("byPosition" means {}); or one number per vertex, which is the same for copies.
 */
export type Weld = "byPosition" | WeldByPosition | Uint32Array | readonly number[];

/** What a server says about itself, or about the session's surface; nothing has failed. */
export type Notice = ServerNotice | BetterShapeNotice;

export interface ServerNotice {
  /**
   * After "overloaded" frames come less often, and the last frame of an update comes later, until "recovered". "other": from a
   * newer server.
   */
  reason: "overloaded" | "recovered" | "other";
  /** One sentence for people. */
  text: string;
}

/** A shape of lower energy is known for the newest update: see MinimaSearch. Session.takeBetterShape() shows it. */
export interface BetterShapeNotice {
  reason: "better_shape";
  /** One sentence for people. */
  text: string;
  /** The update that the shape is for. The notice ends with a frame for a later update or a frame of the shape. */
  inputSeq: number;
  /** Of the shape. */
  energy: number;
  /** The share of the present energy that the shape saves, 0 to 1. */
  savedShare: number;
}

/** A better shape that was taken. */
export interface BetterShape {
  /** The update that the shape is for. */
  inputSeq: number;
  energy: number;
}

/**
 * "idle" before the first frame is requested, and while the page is hidden, has nothing to send and does not settle(); frames
 * come again when the page is visible. "reconnecting" while the server is away; "closed" at the end.
 */
export type Connection = "idle" | "connected" | "reconnecting" | "closed";

/** How frames are sent. */
export interface FrameOptions {
  /** How many frames may be under way and not yet taken, 1 to 8; default: the server's 2. */
  credit?: number;
  withoutDistortion?: boolean;
  withNormals?: boolean;
  /**
   * A result is sent again with its Frame.optimalityGap, unless a new update comes first. The server computes it once updates
   * have paused for a tenth of a second.
   */
  certify?: boolean;
  /** Default: without limit. The last frame of an update always comes. */
  maxFramesPerSecond?: number;
  /** Default: "float32". */
  encoding?: Encoding;
  /** The least precise encoding that the server may use to keep its limit of bytes per second; default: "quantized". */
  lowestEncoding?: Encoding;
  /**
   * Finds normals and the rest of what is drawn of each frame before it is given out, in a worker: an OpenMesh of
   * "lpdeform-client/mesh", of the same mesh. Default: frames have no `shaded`.
   */
  shading?: FrameShading | undefined;
}

/** The vertices of a part of a frame: blocks of four 16-bit integers each, compressed or not. */
export interface PackedPart {
  firstVertex: number;
  vertexCount: number;
  vertices: Uint8Array;
  /** Empty if the frame has none. */
  normals: Uint8Array;
}

/** A quantized frame as it came. */
export interface Packed {
  vertexCount: number;
  isCompressed: boolean;
  quantization: Omit<QuantizedSurface, "vertices" | "normals">;
  parts: PackedPart[];
}

export interface Unpacked {
  quantized: QuantizedSurface;
  positions: Float32Array;
  distortion: Float32Array;
  normals: Float32Array;
}

/** Unpacks frames, in the order in which they are given. The bytes of the parts may be gone afterwards. */
export interface FrameUnpacker {
  /** Rejects with a LpdeformError (FRAME_PARTS) if a block cannot be read. `shaded`: what is drawn of it, if that was found, too. */
  unpack(packed: Packed): Promise<Unpacked & { shaded?: Shaded }>;
}

/** x, y, z of each drawn vertex and of its normal: the sums of the faces' normals, weighted by area; not of length 1. */
export interface DrawnAt {
  positions: Float32Array;
  normals: Float32Array;
}

/** A frame as it is drawn. The arrays are of the drawn vertices, which are split at hard edges. */
export interface Shaded extends DrawnAt {
  /** Empty if the frame has none. */
  distortion: Float32Array;
  statistics: EnergyStatistics;
  /** For each block of faces in the mesh's order of them the least x, y, z of its corners, and the largest. */
  boxes: Float32Array;
}

/** What the side panel shows of the energies of the cells. */
export interface EnergyStatistics {
  max: number;
  /** The energy drawn in full red: the 95th percentile, or the maximum if that percentile is 0. */
  red: number;
  /** The sum of the largest ceil(n/20) energies divided by the sum of all; 0 if all are 0. */
  top5Share: number;
}
/** An OpenMesh is one. */
export interface FrameShading extends FrameUnpacker {
  shade(frame: { readonly positions: Float32Array; readonly distortion: Float32Array }): Promise<Shaded>;
}

export interface ConnectOptions {
  /** Of the proxy, "https://host:port"; default: the page's own origin. */
  url?: string;
  /** Time limit of every call but solve, which has its own; default: 30 s. */
  callTimeoutMs?: number;
  /** A session gives up if its server stays away for longer; default: 2 minutes. */
  reconnectForMs?: number;
  /**
   * Returns the bearer token for each call when the call begins, so that tokens may be renewed; an empty one counts as none.
   * Sessions share a connection if they have the same function. If it fails, the call fails (TOKEN_FUNCTION): an update is
   * refused, and a session whose stream has to be opened ends.
   */
  token?: () => string | Promise<string>;
  /** Replaces the platform's fetch, for tests and for programs outside a browser. */
  fetch?: typeof globalThis.fetch;
}

export interface OpenOptions extends ConnectOptions, FrameOptions {
  weights?: WeightKind;
  freeComponents?: FreeComponents;
  weld?: Weld | undefined;
  settings?: Settings;
  /** For opening only; close() ends an open session. */
  signal?: AbortSignal;
}

export interface RestoreOptions extends ConnectOptions, FrameOptions {
  /** For restoring only; close() ends an open session. */
  signal?: AbortSignal;
}

export interface JoinOptions extends ConnectOptions, FrameOptions {
  /** Default: "reader". A writer takes over from the present one. */
  role?: "reader" | "writer";
  signal?: AbortSignal;
}
