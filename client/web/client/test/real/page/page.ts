// A page in split view: the same handles at two values of p. What it shows is in window.views; it can also watch a session of
// somebody else's.
import { type Frame, joinSession, LpdeformError, openSession } from "../../../src/index.js";
import { grid } from "../../support/shapes.js";

export interface View {
  frames: number;
  newest: Frame | undefined;
  move(height: number): number;
}

declare global {
  interface Window {
    views?: View[];
    watch(name: string, credit: number): Promise<Watched[]>;
    /** The height of the right edge of a mesh of so many vertices a side that was lifted by 2, in this encoding. */
    lift(side: number, encoding: "quantized" | "compressed"): Promise<number>;
    /** Opens a session there and closes it; what it was told where that failed. */
    tryAt(url: string): Promise<Refused | undefined>;
  }
}

/** A frame that was taken: what it answers, and when, in milliseconds since 1970. */
export interface Watched {
  inputSeq: number;
  at: number;
}

export type Refused = Pick<LpdeformError, "code" | "reason" | "element" | "limit" | "message">;

window.tryAt = async (url) => {
  try {
    await (await openSession(grid(3).mesh, { url })).close();
    return undefined;
  } catch (thrown) {
    const { code, reason, element, limit, message } = thrown as LpdeformError;
    return { code, reason, element, limit, message };
  }
};

window.lift = async (side, encoding) => {
  const { mesh, handles } = grid(side);
  const session = await openSession(mesh, { encoding, settings: { p: 2 } });
  session.setHandles(handles);
  session.move("right", { translation: [0, 0, 2] });
  const { positions } = await session.settle();
  await session.close();
  return positions[3 * (side - 1) + 2]!;
};

window.watch = async (name, credit) => {
  const session = await joinSession(name, { credit });
  const log: Watched[] = [];
  void (async () => {
    for await (const { inputSeq } of session) log.push({ inputSeq, at: Date.now() });
  })();
  return log;
};

async function view(p: number): Promise<View> {
  const { mesh, handles } = grid(20);
  const session = await openSession(mesh, { settings: { p } });
  session.setHandles(handles);
  const shown: View = {
    frames: 0,
    newest: undefined,
    move: (height) => session.move("right", { translation: [0, 0, height] }),
  };
  void (async () => {
    for await (const frame of session) {
      ++shown.frames;
      shown.newest = frame;
    }
  })();
  return shown;
}

window.views = await Promise.all([view(1.5), view(2)]);
