import { type ErrorCode, LpdeformError } from "./errors.js";
import { changesFromWire } from "./fromwire.js";
import type { UndoUpdateResponse } from "./gen/lpdeform/v1/service_pb.js";
import type { Link } from "./link.js";
import type { Reason } from "./reasons.js";
import { Backoff } from "./recovery.js";
import { pause } from "./waiting.js";

/**
 * Undoes the newest step of the handles on the server, or redoes the step that was undone last, after all earlier updates.
 * Resolves with the number of the update that this is.
 */
export async function takeStep(link: Link, redo: boolean, signal: AbortSignal): Promise<number> {
  const release = await link.holds.all(signal);
  try {
    signal.throwIfAborted();
    const { seq, response } = await askPatiently(link, redo, signal);
    link.ledger.acceptChange({ seq, update: changesFromWire(response.changes) }, response.result?.kept ?? false);
    return seq;
  } finally {
    release();
  }
}

/** The call is idempotent, so it may be repeated after the server went away. */
async function askPatiently(
  link: Link,
  redo: boolean,
  signal: AbortSignal,
): Promise<{ seq: number; response: UndoUpdateResponse }> {
  const backoff = new Backoff();
  const { session } = link.lease;
  let seq: number | undefined;
  let isAgain = false;
  for (;;) {
    try {
      if (isAgain) await noteLosses(link, signal);
      await link.sendWaiting(signal);
      const { writerToken } = link.lease;
      if (link.lease.session !== session) throw forgotten("not_found", "SESSION_UNKNOWN");
      // Once only: a call that was carried out without an answer has reduced the steps.
      if (seq === undefined && !redo && link.isRecreated) await checkSteps(link, signal);
      seq ??= link.ledger.takeNumber();
      const request = { session, writerToken, inputSeq: BigInt(seq), redo };
      return { seq, response: await link.rpc.call("undoUpdate", request, signal) };
    } catch (thrown) {
      signal.throwIfAborted();
      const error = thrown as LpdeformError;
      if (error.code !== "unavailable") throw error;
      isAgain = true;
      await pause(backoff.nextMs(error.retryAfterMs), signal);
    }
  }
}

/** What the server does not have any more is sent first, and only that, because it would count as a step. */
async function noteLosses({ rpc, lease, ledger }: Link, signal: AbortSignal): Promise<void> {
  const { session } = await rpc.call("getSession", { session: lease.session }, signal);
  ledger.reopened(Number(session?.epoch ?? 0), Number(session?.inputSeq ?? 0));
}

/** In a recreated session, the update with all its handles counts as a step for the server. Users must not undo it. */
async function checkSteps({ rpc, lease }: Link, signal: AbortSignal): Promise<void> {
  const { session } = await rpc.call("getSession", { session: lease.session }, signal);
  if ((session?.undoSteps ?? 0) <= 1) throw forgotten("failed_precondition", "NOTHING_TO_UNDO");
}

function forgotten(code: ErrorCode, reason: Reason): LpdeformError {
  return new LpdeformError(code, "The session was recreated, and has no steps from before.", { reason });
}
