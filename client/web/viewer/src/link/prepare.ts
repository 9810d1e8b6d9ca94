import { openSession, type Session, type Weld } from "lpdeform-client";
import type { Shape } from "../model/blend.js";
import { changes, newSession } from "../model/changes.js";
import type { Document } from "../model/document.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";

/** How long a creation that is given up is waited for: until its session has a name, nobody can close it, and it stays until it expires. */
const graceMs = 10_000;

/** Rejects as soon as `signal` is aborted. If the session is there later, it is closed. */
async function opened(open: (until: AbortSignal) => Promise<Session>, signal: AbortSignal): Promise<Session> {
  signal.throwIfAborted();
  const until = new AbortController();
  const opening = open(until.signal);
  return await new Promise((resolve, reject) => {
    const giveUp = () => {
      reject(signal.reason as Error);
      setTimeout(() => until.abort(), graceMs);
      opening.then((session) => session.close()).catch(() => undefined);
    };
    signal.addEventListener("abort", giveUp, { once: true });
    opening.then(resolve, reject).finally(() => signal.removeEventListener("abort", giveUp));
  });
}

/**
 * The shapes of these documents, in this order, each solved from the one before, in a session of its own. `weld`: as in Live.
 * `maxFramesPerSecond`: of those that are not shown; 0: without limit. Throws an LpdeformError.
 */
export async function* shapesOf(
  mesh: Mesh,
  documents: readonly Document[],
  weld: Weld | undefined,
  signal: AbortSignal,
  maxFramesPerSecond = 0,
): AsyncGenerator<Shape> {
  const { positions, exact, faces } = mesh;
  const session = await opened(
    (until) =>
      openSession(
        { vertices: exact ?? positions, faces },
        { freeComponents: "follow", maxFramesPerSecond, signal: until, ...(weld && { weld }) },
      ),
    signal,
  );
  try {
    let told = newSession;
    for (const asked of documents) {
      const update = changes(told, asked, mesh);
      if (update) session.update(update);
      told = asked;
      const { positions, distortion } = await session.settle({ signal });
      yield { positions, distortion };
    }
  } finally {
    // If the page is being left, the server is told nevertheless.
    void session.close({ keepalive: true }).catch(() => undefined); // it expires by itself if the server is away
  }
}
