import { LpdeformError } from "./errors.js";
import { type Buffer, Scalar } from "./gen/lpdeform/v1/data_pb.js";
import { StopReason } from "./gen/lpdeform/v1/frame_pb.js";
import {
  type Handle as WireHandle,
  type HandleUpdate as WireHandleUpdate,
  Method,
  type Motion as WireMotion,
  type SurfacePoints,
} from "./gen/lpdeform/v1/handle_pb.js";
import type { MeshReport as WireMeshReport } from "./gen/lpdeform/v1/report_pb.js";
import { NoticeReason, type Notice as WireNotice } from "./gen/lpdeform/v1/service_pb.js";
import { holdFromWire, vectorOf } from "./hold_kinds.js";
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

export function noticeFromWire({ reason, text, inputSeq, energy, savedShare }: WireNotice): api.Notice {
  if (reason === NoticeReason.BETTER_SHAPE) {
    return { reason: "better_shape", text, inputSeq: Number(inputSeq), energy, savedShare };
  }
  if (reason === NoticeReason.OVERLOADED) return { reason: "overloaded", text };
  return { reason: reason === NoticeReason.RECOVERED ? "recovered" : "other", text };
}

/** As in reports: "quasi_newton". Empty if no method runs. */
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
    notices: report.defects.flatMap(noticesOf),
  };
}

/** The same as in client/cpp/mesh_notices.h. */
function noticesOf({ kind, count, first }: api.Defect): string[] {
  if (kind !== "split_border_vertices" || count === 0) return [];
  const named = [...first, ...(count > first.length ? ["..."] : [])].join(", ");
  return [
    `The mesh comes apart where it is split: ${count} vertices at its borders lie in the same place as others ` +
      `(vertices ${named}). Weld it by position to hold it together there.`,
  ];
}

/** Changes of handles that the server made. */
export function changesFromWire(changes: readonly WireHandleUpdate[]): api.Update {
  // Without a prototype, so that a handle may have any name.
  const handles: Record<string, api.HandleChange> = Object.create(null);
  for (const { name, change } of changes) {
    if (change.case === "set") handles[name] = { set: handleFromWire(change.value) };
    else if (change.case === "move") handles[name] = { move: motionFromWire(change.value) };
    else handles[name] = { remove: true };
  }
  return { handles };
}

function handleFromWire({ vertices, points, motion, hold, footprintRadius }: WireHandle): api.Handle {
  return {
    ...(vertices && { vertices: indicesOf(vertices) }),
    ...(points && { points: pointsFromWire(points) }),
    ...(motion && { motion: motionFromWire(motion) }),
    hold: holdFromWire(hold),
    footprint: footprintRadius,
  };
}

function motionFromWire({ kind }: WireMotion): api.Motion {
  if (kind.case === "rigid") {
    const { axis, angleRadians, center, translation } = kind.value;
    return {
      axis: vectorOf(axis),
      angle: angleRadians,
      center: vectorOf(center),
      translation: vectorOf(translation),
    };
  }
  if (kind.case === "targets") return { targets: numbersOf(kind.value.positions, kind.value.scalar) };
  return "fixed";
}

function pointsFromWire({ faces, scalar, barycentric }: SurfacePoints): api.SurfacePoint[] {
  const numbers = numbersOf(barycentric, scalar);
  return Array.from(indicesOf(faces), (face, k) => ({
    face,
    barycentric: [numbers[3 * k]!, numbers[3 * k + 1]!, numbers[3 * k + 2]!],
  }));
}

/** A copy of the bytes, because messages are views of the received data. */
function bytesOf(buffer: Buffer | undefined, width: number): ArrayBuffer {
  const bytes = buffer?.source.case === "inline" ? buffer.source.value : new Uint8Array();
  if (bytes.byteLength % width === 0) return bytes.slice().buffer as ArrayBuffer;
  throw new LpdeformError("internal", `The server sent ${bytes.byteLength} bytes for numbers of ${width} each.`);
}

function indicesOf(buffer: Buffer | undefined): Uint32Array {
  return new Uint32Array(bytesOf(buffer, 4));
}

function numbersOf(buffer: Buffer | undefined, scalar: Scalar): Float32Array | Float64Array {
  return scalar === Scalar.FLOAT32 ? new Float32Array(bytesOf(buffer, 4)) : new Float64Array(bytesOf(buffer, 8));
}
