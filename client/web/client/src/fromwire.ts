import { type Buffer, Scalar, type Vector3 } from "./gen/lpdeform/v1/data_pb.js";
import { StopReason } from "./gen/lpdeform/v1/frame_pb.js";
import { type Handle, type HandleUpdate, Method, type Motion } from "./gen/lpdeform/v1/handle_pb.js";
import type { MeshReport as WireMeshReport } from "./gen/lpdeform/v1/report_pb.js";
import type * as api from "./types.js";

// From messages of the contract to the values of this library.

const stopReasons: Record<StopReason, api.StopReason> = {
  [StopReason.UNSPECIFIED]: "running",
  [StopReason.CONVERGED]: "converged",
  [StopReason.ITERATION_LIMIT]: "iteration_limit",
  [StopReason.TIME_LIMIT]: "time_limit",
  [StopReason.CANCELLED]: "cancelled",
  [StopReason.STALLED]: "stalled",
  [StopReason.NUMERICAL_BREAKDOWN]: "numerical_breakdown",
};

export function stopReasonFromWire(reason: StopReason): api.StopReason {
  return stopReasons[reason] ?? "running";
}

/** As in reports: "quasi_newton". Empty where none runs. */
export function methodName(method: Method): string {
  return method === Method.UNSPECIFIED ? "" : (Method[method]?.toLowerCase() ?? "");
}

export function reportFromWire(report: WireMeshReport): api.MeshReport {
  return {
    vertices: report.vertices,
    faces: report.faces,
    edges: report.edges,
    components: report.components,
    boundaryLoops: report.boundaryLoops,
    defects: report.defects.map(({ kind, count, first }) => ({ kind, count, first: [...first] })),
    weldedVertices: report.weldedVertices,
  };
}

/** Changes of handles that the server made. */
export function changesFromWire(changes: readonly HandleUpdate[]): Record<string, api.HandleChange> {
  // Without a prototype, so that a handle may have any name.
  const out: Record<string, api.HandleChange> = Object.create(null);
  for (const { name, change } of changes) {
    if (change.case === "set") out[name] = { set: handleFromWire(change.value) };
    else if (change.case === "move") out[name] = { move: motionFromWire(change.value) };
    else out[name] = { remove: true };
  }
  return out;
}

function handleFromWire(handle: Handle): api.Handle {
  const motion = handle.motion ? motionFromWire(handle.motion) : "fixed";
  const common = { motion, hold: holdFromWire(handle), footprint: handle.footprintRadius };
  if (!handle.points) return { ...common, vertices: new Uint32Array(bytesOf(handle.vertices)) };
  const faces = new Uint32Array(bytesOf(handle.points.faces));
  const [...barycentric] = numbersOf(handle.points.barycentric, handle.points.scalar);
  const points = [...faces].map((face, k) => {
    const [a = 0, b = 0, c = 0] = barycentric.slice(3 * k, 3 * k + 3);
    return { face, barycentric: [a, b, c] as const };
  });
  return { ...common, points };
}

function holdFromWire({ hold }: Handle): api.Hold {
  switch (hold.case) {
    case "soft":
    case "orientation":
      return { kind: hold.case, ...(hold.value.weight !== undefined && { weight: hold.value.weight }) };
    case "axisLock":
      return { kind: "axisLock", axis: vectorFromWire(hold.value.axis) };
    case "planeLock":
      return { kind: "planeLock", normal: vectorFromWire(hold.value.normal) };
    default:
      return { kind: "exact" };
  }
}

function motionFromWire({ kind }: Motion): api.Motion {
  if (kind.case === "targets") return { targets: numbersOf(kind.value.positions, kind.value.scalar) };
  if (kind.case !== "rigid") return "fixed";
  const { axis, angleRadians, center, translation } = kind.value;
  return {
    axis: vectorFromWire(axis, [0, 0, 1]),
    angle: angleRadians,
    center: vectorFromWire(center),
    translation: vectorFromWire(translation),
  };
}

function vectorFromWire(vector: Vector3 | undefined, otherwise: api.Vector3 = [0, 0, 0]): api.Vector3 {
  return vector ? [vector.x, vector.y, vector.z] : otherwise;
}

/** A copy, which begins where numbers of any size may. */
function bytesOf(buffer: Buffer | undefined): ArrayBuffer {
  const bytes = buffer?.source.case === "inline" ? buffer.source.value : new Uint8Array();
  return bytes.slice().buffer as ArrayBuffer;
}

function numbersOf(buffer: Buffer | undefined, scalar: Scalar): Float32Array | Float64Array {
  return scalar === Scalar.FLOAT64 ? new Float64Array(bytesOf(buffer)) : new Float32Array(bytesOf(buffer));
}
