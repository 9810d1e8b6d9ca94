import type { LpdeformError } from "./errors.js";
import type { UndoUpdateResponse } from "./gen/lpdeform/v1/service_pb.js";
import { changesFromWire } from "./fromwire.js";
import { isUndecided } from "./lease.js";
import { type Link, sessionClosed } from "./link.js";
import { Backoff } from "./recovery.js";
import { pause } from "./waiting.js";

/** Takes the newest step of the handles back on the server, or does it again; the number of the update that this is. */
export async function takeBack(link: Link, redo: boolean): Promise<number> {
  if (link.isClosed) throw sessionClosed();
  link.requireWriter();
  const { signal } = link.stop;
  const release = await link.holdAlone(signal);
  try {
    await sendWaiting(link, signal);
    if (link.isClosed) throw sessionClosed();
    return await takeBackAlone(link, redo, signal);
  } catch (error) {
    throw link.isClosed ? sessionClosed() : error;
  } finally {
    release();
  }
}

/** So that what was changed before is a step of its own. */
async function sendWaiting(link: Link, signal: AbortSignal): Promise<void> {
  const { ledger } = link;
  while (ledger.hasWaiting && !signal.aborted) {
    const update = ledger.sendNext();
    try {
      ledger.accept(update, await link.sendUpdate(update, link.lease, signal));
    } catch (thrown) {
      if (isUndecided(thrown as LpdeformError) || update.seq === ledger.newestAccepted) ledger.connectionLost();
      else ledger.refuse(update);
      throw thrown;
    }
  }
}

async function takeBackAlone(link: Link, redo: boolean, signal: AbortSignal): Promise<number> {
  const { ledger, lease } = link;
  const change = ledger.beginChange();
  try {
    const request = { session: lease.session, writerToken: lease.writerToken, inputSeq: BigInt(change.seq), redo };
    const undone = await askPatiently(
      () => link.rpc.call("undoUpdate", request, signal),
      link.rpc.callTimeoutMs,
      signal,
    );
    change.update = { handles: changesFromWire(undone.changes) };
    ledger.accept(change, undone.result?.kept ?? false);
  } catch (error) {
    ledger.refuse(change);
    throw error;
  }
  return change.seq;
}

/** The same call again does no harm, so a server that went away may be asked again. */
async function askPatiently(
  ask: () => Promise<UndoUpdateResponse>,
  longestMs: number,
  signal: AbortSignal,
): Promise<UndoUpdateResponse> {
  const end = performance.now() + longestMs;
  const backoff = new Backoff();
  for (;;) {
    try {
      return await ask();
    } catch (error) {
      const pauseMs = backoff.nextMs();
      if ((error as LpdeformError).code !== "unavailable" || performance.now() + pauseMs > end) throw error;
      await pause(pauseMs, signal);
    }
  }
}
