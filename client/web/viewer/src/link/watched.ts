import { joinSession, type LpdeformError } from "lpdeform-client";
import type { Mesh } from "../model/mesh.js";
import { isPassing, say, sentence, type Status, statusOf } from "./status.js";

// A session of somebody else, which a link names: "/?watch=" and its 32 hexadecimal digits.

const prefix = "sessions/";

/** The link by which others see this session. */
export function linkTo(session: string, page: string): string {
  const link = new URL(page);
  link.search = `watch=${session.slice(prefix.length)}`;
  link.hash = "";
  return link.href;
}

/** The session that a link names; undefined if it names none. */
export function sessionOf(watched: string): string | undefined {
  return /^[0-9a-f]{32}$/.test(watched) ? prefix + watched : undefined;
}

/** The mesh of a session at rest. Rejects with an LpdeformError. */
export async function watchedMesh(session: string): Promise<Mesh> {
  const joined = await joinSession(session);
  try {
    const { vertices, faces } = await joined.mesh();
    const positions = Float32Array.from(vertices);
    const isExact = vertices.every((value, k) => value === positions[k]);
    return { name: "A shared shape", positions, faces, ...(!isExact && { exact: vertices }) };
  } finally {
    void joined.close();
  }
}

/** What an error means to somebody who watches. */
export function watchedStatus(error: LpdeformError): Status {
  if (error.code === "not_found" || error.reason.startsWith("SESSION_")) {
    const text = "Whoever works on it has closed it or opened something else. Ask for a new link.";
    return say("refused", "This session has ended", text);
  }
  const status = statusOf(error);
  return isPassing(status)
    ? say(status.kind, status.title, "Trying again by itself…")
    : say("refused", "This session cannot be watched", sentence(error.message));
}
