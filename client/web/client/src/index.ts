export { type ErrorCode, type ErrorDetails, LpdeformError } from "./errors.js";
export type { Reason } from "./reasons.js";
export { Backoff } from "./recovery.js";
export {
  joinSessionByName as joinSession,
  openSession,
  restoreSession,
  Session,
  type SessionEvents,
} from "./session.js";
export type * from "./types.js";
