import { LpdeformError } from "./errors.js";
import { reportFromWire } from "./fromwire.js";
import type { Session as WireSession } from "./gen/lpdeform/v1/service_pb.js";
import { Packer } from "./packer.js";
import type { Rpc } from "./rpc.js";
import { freeComponents, meshToWire, settingsToWire, weights, weldToWire } from "./towire.js";
import type { Mesh, MeshReport, OpenOptions } from "./types.js";
import { Uploads } from "./upload.js";
import { isUndecided } from "./verdict.js";

/** What a client knows of its session on the server. */
export interface Lease {
  session: string;
  /** Empty for a reader. */
  writerToken: string;
  epoch: number;
  inputSeq: number;
  report: MeshReport;
  /** The header lpdeform-session that leads to the session's server, if one is known. */
  route?: string;
}

/** What a lost session can be recreated from. */
export interface Copy {
  /** Idempotent: the same request id gives the same session. */
  make(requestId: string, signal: AbortSignal): Promise<Lease>;
  /** Whether the copy has no handles. */
  isBare: boolean;
}

/** Creates a session. It is idempotent: the same request id gives the same session, however often it is tried. */
export async function createSession(
  rpc: Rpc,
  mesh: Mesh,
  options: OpenOptions,
  requestId: string,
  signal?: AbortSignal,
): Promise<Lease> {
  const uploads = new Uploads(rpc, signal, requestId);
  const packer = new Packer();
  const normals = mesh.normals && packer.numbers(mesh.normals);
  const request = {
    requestId,
    mesh: await meshToWire(mesh, packer),
    weights: weights[options.weights ?? "cotangent"],
    freeComponents: freeComponents[options.freeComponents ?? "error"],
    settings: settingsToWire(options.settings ?? {}, packer),
    ...(options.weld && { weld: weldToWire(options.weld, packer) }),
    ...(normals && { normals: { scalar: normals.scalar, data: normals.buffer } }),
  };
  await packer.flush((bytes) => uploads.add(bytes));
  try {
    const { session, writerToken } = await rpc.call("createSession", request, signal);
    uploads.discard();
    const lease = leaseOf(session, writerToken);
    checkVertexCount(lease.report.vertices, mesh.vertices.length / 3);
    return lease;
  } catch (error) {
    if (!isUndecided(error as LpdeformError)) uploads.discard();
    throw error;
  }
}

/** The lease from the answer of a server that created a session. */
export function leaseOf(session: WireSession | undefined, writerToken: string): Lease {
  if (!session?.mesh) throw new LpdeformError("internal", "The server made a session and did not say which.");
  return {
    session: session.name,
    writerToken,
    epoch: Number(session.epoch),
    inputSeq: Number(session.inputSeq),
    report: reportFromWire(session.mesh),
  };
}

/** Throws if a server reports `count` vertices for a mesh that has `wanted`: arrays have the latter size. */
export function checkVertexCount(count: number, wanted: number): void {
  if (count === wanted) return;
  throw new LpdeformError("data_loss", `The server speaks of ${count} vertices of a mesh that has ${wanted}.`, {
    reason: "FRAME_VERTICES",
    limit: `vertices = ${wanted}`,
  });
}

/** The header that leads to a session on another of several servers; empty if the error does not name one. */
export function routeOf(error: LpdeformError): string {
  const said = "lpdeform-session: ";
  const isElsewhere = error.reason === "SESSION_ELSEWHERE" && error.limit.startsWith(said);
  return isElsewhere ? error.limit.slice(said.length) : "";
}

/** Joins a session by name. */
export async function joinSession(
  rpc: Rpc,
  name: string,
  role: "reader" | "writer",
  signal?: AbortSignal,
): Promise<Lease> {
  const { session } = await rpc.call("getSession", { session: name }, signal);
  if (!session?.mesh) throw new LpdeformError("internal", "The server has a session and did not say which.");
  const lease: Lease = {
    session: name,
    writerToken: "",
    epoch: Number(session.epoch),
    inputSeq: Number(session.inputSeq),
    report: reportFromWire(session.mesh),
  };
  if (session.route) lease.route = session.route;
  if (role === "reader") return lease;
  const acquired = await rpc.call("acquireWriter", { session: name }, signal);
  return {
    ...lease,
    writerToken: acquired.writerToken,
    epoch: Number(acquired.epoch),
    inputSeq: Number(acquired.inputSeq),
  };
}
