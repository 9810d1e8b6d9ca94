import { StopReason } from "./gen/lpdeform/v1/frame_pb.js";
import { Method } from "./gen/lpdeform/v1/handle_pb.js";
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
