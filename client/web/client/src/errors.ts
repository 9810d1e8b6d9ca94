import { BinaryReader } from "@bufbuild/protobuf/wire";
import { Code, ConnectError } from "@connectrpc/connect";
import type { Fault } from "./gen/lpdeform/v1/service_pb.js";
import type { Reason } from "./reasons.js";

/** The names of google.rpc.Code: "invalid_argument" and so on. */
export type ErrorCode = keyof typeof names;

const names = {
  cancelled: Code.Canceled,
  unknown: Code.Unknown,
  invalid_argument: Code.InvalidArgument,
  deadline_exceeded: Code.DeadlineExceeded,
  not_found: Code.NotFound,
  already_exists: Code.AlreadyExists,
  permission_denied: Code.PermissionDenied,
  resource_exhausted: Code.ResourceExhausted,
  failed_precondition: Code.FailedPrecondition,
  aborted: Code.Aborted,
  out_of_range: Code.OutOfRange,
  unimplemented: Code.Unimplemented,
  internal: Code.Internal,
  unavailable: Code.Unavailable,
  data_loss: Code.DataLoss,
  unauthenticated: Code.Unauthenticated,
} as const;

const codes = new Map<number, ErrorCode>(Object.entries(names).map(([name, code]) => [code, name as ErrorCode]));

export interface ErrorDetails {
  /** Stable (proto/errors.md); empty if the server was not reached. */
  reason?: Reason;
  /** What is wrong: "vertex 17". May be empty. */
  element?: string;
  /** The limit that was violated. May be empty. */
  limit?: string;
  /** The update that the error is about; 0 if none. */
  inputSeq?: number;
  /** When to retry; 0 if a retry does not help. */
  retryAfterMs?: number;
}

/** Every error that this library throws or reports. `message` is one sentence for people. */
export class LpdeformError extends Error implements Required<ErrorDetails> {
  override readonly name = "LpdeformError";
  readonly reason: Reason;
  readonly element: string;
  readonly limit: string;
  readonly inputSeq: number;
  readonly retryAfterMs: number;

  constructor(
    readonly code: ErrorCode,
    message: string,
    details: ErrorDetails = {},
    cause?: unknown,
  ) {
    super(message, { cause });
    this.reason = details.reason ?? "";
    this.element = details.element ?? "";
    this.limit = details.limit ?? "";
    this.inputSeq = details.inputSeq ?? 0;
    this.retryAfterMs = details.retryAfterMs ?? 0;
  }
}

export function fromFault(fault: Fault): LpdeformError {
  return new LpdeformError(codes.get(fault.code) ?? "unknown", fault.text, {
    reason: fault.reason as Reason,
    element: fault.element,
    limit: fault.limit,
    inputSeq: Number(fault.inputSeq),
    retryAfterMs: fault.retryAfterMs,
  });
}

/** Not even heartbeats came. */
export function serverSilent(): LpdeformError {
  return new LpdeformError("unavailable", "The server has fallen silent.", { reason: "SILENCE" });
}

export function sessionClosed(): LpdeformError {
  return new LpdeformError("failed_precondition", "The session is closed.", { reason: "SESSION_CLOSED" });
}

/** For what nobody should have thrown. */
export function unforeseen(thrown: unknown): LpdeformError {
  if (thrown instanceof LpdeformError) return thrown;
  const message = thrown instanceof Error ? thrown.message : String(thrown);
  return new LpdeformError("internal", message, { reason: "EXCEPTION" }, thrown);
}

export const cannotBeReached = "The server cannot be reached.";

/** Converts anything that a call has thrown. */
export function fromCall(thrown: unknown): LpdeformError {
  if (thrown instanceof LpdeformError) return thrown;
  const error = ConnectError.from(thrown);
  if (error.cause instanceof LpdeformError) return error.cause;
  const details: ErrorDetails = {};
  for (const detail of error.details) {
    if (!("type" in detail)) continue;
    if (detail.type === "google.rpc.ErrorInfo") readErrorInfo(detail.value, details);
    if (detail.type === "google.rpc.RetryInfo") details.retryAfterMs = readRetryInfo(detail.value);
  }
  // What fetch throws if no server listens, or if the connection breaks.
  const isNetwork = error.cause instanceof TypeError || thrown instanceof TypeError;
  const code = isNetwork ? "unavailable" : (codes.get(error.code) ?? "unknown");
  return new LpdeformError(code, isNetwork ? cannotBeReached : error.rawMessage, details, thrown);
}

/** Calls `visit` for each field of a serialized message. If `visit` returns true, it has read the value. */
function forEachField(bytes: Uint8Array, visit: (field: number, reader: BinaryReader) => boolean): void {
  const reader = new BinaryReader(bytes);
  while (reader.pos < reader.len) {
    const [field, wireType] = reader.tag();
    if (!visit(field, reader)) reader.skip(wireType);
  }
}

// Field numbers of google/rpc/error_details.proto, which never change. Reading them directly keeps those
// messages out of users' pages.

function readErrorInfo(bytes: Uint8Array, details: ErrorDetails): void {
  forEachField(bytes, (field, reader) => {
    if (field === 1) details.reason = reader.string() as Reason;
    else if (field === 3) readMetadata(reader.bytes(), details);
    else return false;
    return true;
  });
}

function readMetadata(bytes: Uint8Array, details: ErrorDetails): void {
  const entry = ["", "", ""];
  forEachField(bytes, (field, reader) => {
    entry[field] = reader.string();
    return true;
  });
  if (entry[1] === "element") details.element = entry[2] ?? "";
  if (entry[1] === "limit") details.limit = entry[2] ?? "";
}

function readRetryInfo(bytes: Uint8Array): number {
  let milliseconds = 0;
  forEachField(bytes, (field, reader) => {
    if (field !== 1) return false;
    forEachField(reader.bytes(), (part, duration) => {
      if (part === 1) milliseconds += Number(duration.int64()) * 1000;
      else if (part === 2) milliseconds += duration.int32() / 1e6;
      else return false;
      return true;
    });
    return true;
  });
  return milliseconds;
}
