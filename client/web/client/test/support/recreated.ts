import type { Frame, Session } from "../../src/index.js";

/** The finished result of the session that takes the place of the one called `name`, as soon as it comes. */
export async function resultRecreated(session: Session, name: string): Promise<Frame> {
  for await (const frame of session) if (frame.isFinal && session.name !== name) return frame;
  throw new Error(`${name} was closed`);
}
