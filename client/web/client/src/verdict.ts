import type { LpdeformError } from "./errors.js";

// What an error says of the session and of the call that it answers.

/** The server has the session no more. */
export function isSessionLost(error: LpdeformError): boolean {
  return error.code === "not_found" && error.reason.startsWith("SESSION_");
}

/** Whether the server took the call is not known, or may change: it is to be tried again. */
export function isUndecided(error: LpdeformError): boolean {
  const passing = ["unavailable", "cancelled", "deadline_exceeded", "unknown"];
  const mayHaveRoom = error.code === "resource_exhausted" && error.retryAfterMs > 0;
  return passing.includes(error.code) || mayHaveRoom || isSessionLost(error) || error.reason === "UPLOAD_UNKNOWN";
}

/** The server took the update, and cannot solve for it yet. */
export function isTakenAllTheSame(error: LpdeformError): boolean {
  return error.code === "failed_precondition" || error.code === "aborted";
}
