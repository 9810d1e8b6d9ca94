import { LpdeformError } from "./errors.js";
import { type GoAway, GoAwayReason } from "./gen/lpdeform/v1/service_pb.js";
import { isSessionLost, isTakenAllTheSame, isUndecided } from "./verdict.js";

export type NextStep = "resume" | "recreate" | "giveUp";

/** What to do when a stream has ended. */
export interface Recovery {
  next: NextStep;
  why: LpdeformError;
  /** How long to wait before the next try. */
  pauseMs: number;
}

/** How a stream ended. */
export interface Ending {
  /** Undefined if there was no error. */
  error?: LpdeformError | undefined;
  /** The server's reason, if it gave one; it takes precedence over `error`. */
  goAway?: GoAway | undefined;
  /** How long the stream was open. */
  stoodMs: number;
  /** Time since a stream was last open. */
  awayMs: number;
}

/**
 * Exponential backoff from 50 ms to 2 s. Each pause is random within its upper half, so that clients do not all return at once.
 */
export class Backoff {
  static readonly mostMs = 2000;
  /** The longest pause that a server may ask for. */
  static readonly mostAskedMs = 60_000;
  static readonly #firstMs = 50;
  #longestMs = Backoff.#firstMs;

  /** `chance`: returns a number from 0 to 1. */
  constructor(readonly chance: () => number = Math.random) {}

  /** The next pause, in addition to what the server asks for. */
  nextMs(askedMs = 0): number {
    const longest = this.#longestMs;
    this.#longestMs = Math.min(2 * longest, Backoff.mostMs);
    return Math.min(Math.max(askedMs, 0), Backoff.mostAskedMs) + longest * (0.5 + 0.5 * this.chance());
  }

  reset(): void {
    this.#longestMs = Backoff.#firstMs;
  }
}

/**
 * What a session does after each of its streams. tests/golden/recovery.json has the rules as a table, which the clients in all
 * languages replay.
 */
export class RecoveryRules {
  /** How many streams in a row may end with a message that does not fit, before the server counts as one of another version. */
  static readonly mostMisfits = 5;
  readonly backoff: Backoff;
  #misfits = 0;

  /** `hasCopy`: the session can be recreated. Gives up after `reconnectForMs` without an open stream. */
  constructor(
    readonly hasCopy: boolean,
    readonly reconnectForMs: number,
    chance: () => number = Math.random,
  ) {
    this.backoff = new Backoff(chance);
  }

  /** A complete frame came. */
  frameFitted(): void {
    this.#misfits = 0;
  }

  /** The caller starts again. */
  begin(): void {
    this.#misfits = 0;
    this.backoff.reset();
  }

  after({ error, goAway, stoodMs, awayMs }: Ending): Recovery {
    if (stoodMs >= Backoff.mostMs) this.backoff.reset(); // a stream that breaks at once is not a success
    const found = goAway ? afterGoAway(goAway, this.hasCopy) : afterError(error, this.hasCopy);
    const isMisfit = found.why.reason === "FRAME_PARTS" && ++this.#misfits >= RecoveryRules.mostMisfits;
    const next = isMisfit || awayMs > this.reconnectForMs ? "giveUp" : found.next;
    const askedMs = goAway ? goAway.reconnectAfterMs : (error?.retryAfterMs ?? 0);
    return { next, why: found.why, pauseMs: this.backoff.nextMs(askedMs) };
  }

  /** The session could not be recreated. */
  afterFailedMaking(error: LpdeformError): Recovery {
    const next = isUndecided(error) ? "recreate" : "giveUp";
    return { next, why: error, pauseMs: this.backoff.nextMs(error.retryAfterMs) };
  }
}

/** What an error means for the update that it answers, or that a call carried. */
export type Answer = "again" | "recreate" | "taken" | "refused";

/** `isSecond`: this update had the same answer before. */
export function answerOf(error: LpdeformError, isSecond = false): Answer {
  if (isSessionLost(error)) return "recreate";
  if (isTakenAllTheSame(error)) return "taken";
  const isInVain = isSecond && error.reason === "UPLOAD_UNKNOWN";
  return isUndecided(error) && !isInVain ? "again" : "refused";
}

type Found = Pick<Recovery, "next" | "why">;

function afterError(error: LpdeformError | undefined, hasCopy: boolean): Found {
  if (!error) return { next: "resume", why: new LpdeformError("unavailable", "The server ended the stream.") };
  // It is another mesh, so it would happen again.
  if (error.reason === "FRAME_VERTICES" || error.reason === "EXCEPTION") return { next: "giveUp", why: error };
  if (isSessionLost(error)) return { next: hasCopy ? "recreate" : "giveUp", why: error };
  if (passing.has(error.code) || isUndecided(error)) return { next: "resume", why: error };
  return { next: "giveUp", why: error.reason === "NOT_THE_WRITER" ? writerReplaced() : error };
}

/** The error for a writer who has been replaced. */
export function writerReplaced(text = "Another writer took the session over."): LpdeformError {
  return new LpdeformError("aborted", text, { reason: "WRITER_REPLACED" });
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

function afterGoAway({ reason, text }: GoAway, hasCopy: boolean): Found {
  switch (reason) {
    case GoAwayReason.SESSION_DELETED:
      return { next: "giveUp", why: new LpdeformError("not_found", text, { reason: "SESSION_DELETED" }) };
    case GoAwayReason.SESSION_EXPIRED:
      return {
        next: hasCopy ? "recreate" : "giveUp",
        why: new LpdeformError("not_found", text, { reason: "SESSION_EXPIRED" }),
      };
    case GoAwayReason.WRITER_REPLACED:
      return { next: "giveUp", why: writerReplaced(text) };
    case GoAwayReason.PROTOCOL_ERROR:
      return { next: "giveUp", why: new LpdeformError("internal", text, { reason: "PROTOCOL_ERROR" }) };
    case GoAwayReason.TOKEN_EXPIRED:
      return { next: "resume", why: new LpdeformError("unauthenticated", text, { reason: "TOKEN_EXPIRED" }) };
    default:
      return { next: "resume", why: new LpdeformError("unavailable", text, { reason: "DRAINING" }) };
  }
}
