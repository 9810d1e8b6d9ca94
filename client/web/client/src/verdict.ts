import type { LpdeformError } from "./errors.js";

// What an error means for the session and for the call that it answers.

/** Whether the server does not have the session any more. */
export function isSessionLost(error: LpdeformError): boolean {
  return error.code === "not_found" && error.reason.startsWith("SESSION_");
}

/** Whether it is unknown if the server took the call, or may change: then the call is retried. */
export function isUndecided(error: LpdeformError): boolean {
  const passing = ["unavailable", "cancelled", "deadline_exceeded", "unknown"];
  const mayHaveRoom = error.code === "resource_exhausted" && error.retryAfterMs > 0;
  return passing.includes(error.code) || mayHaveRoom || isSessionLost(error) || error.reason === "UPLOAD_UNKNOWN";
}

/** Whether the server took the update, but cannot solve for it yet. */
export function isTakenAllTheSame(error: LpdeformError): boolean {
  return error.code === "failed_precondition" || error.code === "aborted";
}
