import { LpdeformError } from "./errors.js";
import { type GoAway, GoAwayReason } from "./gen/lpdeform/v1/service_pb.js";
import { isSessionLost } from "./lease.js";

/** What to do when a stream has ended. */
export interface Recovery {
  next: "resume" | "makeAnew" | "giveUp";
  why: LpdeformError;
  pauseMs: number;
}

/** `ended`: nothing where the server ended the stream without an error. `hasCopy`: the session can be made anew. */
export function recoveryAfter(
  ended: LpdeformError | undefined,
  goAway: GoAway | undefined,
  hasCopy: boolean,
): Recovery {
  if (goAway) return afterGoAway(goAway, hasCopy);
  const why = ended ?? new LpdeformError("unavailable", "The server ended the stream.");
  const pauseMs = why.retryAfterMs;
  if (why.reason === "FRAME_VERTICES") return { next: "giveUp", why, pauseMs }; // it is another mesh
  if (isSessionLost(why)) return { next: hasCopy ? "makeAnew" : "giveUp", why, pauseMs };
  return { next: passing.has(why.code) ? "resume" : "giveUp", why, pauseMs };
}

const passing = new Set([
  "cancelled",
  "unknown",
  "deadline_exceeded",
  "resource_exhausted",
  "internal",
  "unavailable",
  "data_loss",
]);

function afterGoAway(goAway: GoAway, hasCopy: boolean): Recovery {
  const pauseMs = goAway.reconnectAfterMs;
  switch (goAway.reason) {
    case GoAwayReason.SESSION_DELETED:
      return {
        next: "giveUp",
        why: new LpdeformError("not_found", goAway.text, { reason: "SESSION_DELETED" }),
        pauseMs,
      };
    case GoAwayReason.SESSION_EXPIRED:
      return {
        next: hasCopy ? "makeAnew" : "giveUp",
        why: new LpdeformError("not_found", goAway.text, { reason: "SESSION_EXPIRED" }),
        pauseMs,
      };
    case GoAwayReason.PROTOCOL_ERROR:
      return { next: "giveUp", why: new LpdeformError("internal", goAway.text, { reason: "PROTOCOL_ERROR" }), pauseMs };
    case GoAwayReason.TOKEN_EXPIRED:
      return {
        next: "resume",
        why: new LpdeformError("unauthenticated", goAway.text, { reason: "TOKEN_EXPIRED" }),
        pauseMs,
      };
    default:
      return { next: "resume", why: new LpdeformError("unavailable", goAway.text, { reason: "DRAINING" }), pauseMs };
  }
}

/** Growing pauses, 100 ms to 2 s, each spread over its upper half so that clients do not come back all at once. */
export class Backoff {
  static readonly mostMs = 2000;
  #longestMs = 100;

  nextMs(): number {
    const longest = this.#longestMs;
    this.#longestMs = Math.min(2 * longest, Backoff.mostMs);
    return longest * (0.5 + 0.5 * Math.random());
  }

  reset(): void {
    this.#longestMs = 100;
  }
}
