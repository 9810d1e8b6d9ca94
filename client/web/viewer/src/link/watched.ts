import { Backoff, joinSession, type LpdeformError } from "lpdeform-client";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { isPassing, say, sentence, type Status, statusOf } from "./status.js";

// A session of somebody else, which a link names: "/#watch=" and its 32 hexadecimal digits. Who knows the name may also write to the
// session, so it stands in the fragment, which browsers send to no server: no log has it.

const prefix = "sessions/";

/** The link by which others see this session. */
export function linkTo(session: string, page: string): string {
  const link = new URL(page);
  link.search = "";
  link.hash = `watch=${session.slice(prefix.length)}`;
  return link.href;
}

/** What a link names, from the fragment of the page's address. Null: it is no such link. */
export function watchedIn(fragment: string): string | null {
  return new URLSearchParams(fragment.slice(1)).get("watch");
}

/** The session that a link names; undefined if it names none. */
export function sessionOf(watched: string): string | undefined {
  return /^[0-9a-f]{32}$/.test(watched) ? prefix + watched : undefined;
}

/**
 * The mesh of a session at rest. Tries again by itself after a failure that may pass, of which it tells `failed`. Rejects with an
 * LpdeformError after any other.
 */
export async function watchedMesh(session: string, failed: (status: Status) => void): Promise<Mesh> {
  const backoff = new Backoff();
  for (;;) {
    try {
      return await readMesh(session);
    } catch (thrown) {
      const error = thrown as LpdeformError;
      const status = watchedStatus(error);
      if (!isPassing(status)) throw error;
      failed(status);
      await new Promise((resolve) => setTimeout(resolve, backoff.nextMs(error.retryAfterMs)));
    }
  }
}

async function readMesh(session: string): Promise<Mesh> {
  const joined = await joinSession(session);
  try {
    const { vertices, faces } = await joined.mesh();
    const positions = Float32Array.from(vertices);
    const isExact = vertices.every((value, k) => value === positions[k]);
    return { name: "A shared shape", positions, faces, ...(!isExact && { exact: vertices }) };
  } finally {
    void joined.close().catch(() => undefined);
  }
}

/** What an error means to somebody who watches. `status`: what it means to somebody who works. */
export function watchedStatus(error: LpdeformError, status = statusOf(error)): Status {
  if (error.code === "not_found" || error.reason.startsWith("SESSION_")) {
    const text = "The page that it came from was closed, or shows another shape now. Ask for a new link.";
    return say("refused", "This session has ended, or is not yours to see", text);
  }
  return isPassing(status)
    ? say(status.kind, status.title, "Trying again by itself…")
    : say("refused", "This session cannot be watched", sentence(error.message));
}
