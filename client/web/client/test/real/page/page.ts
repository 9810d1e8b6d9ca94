// A page in split view: the same handles at two values of p. What it shows is in window.views; it can also watch a session of
// somebody else's.
import { type Frame, joinSession, openSession } from "../../../src/index.js";
import { grid } from "../shapes.js";

export interface View {
  frames: number;
  newest: Frame | undefined;
  move(height: number): number;
}

declare global {
  interface Window {
    views?: View[];
    watch(name: string, credit: number): Promise<Watched[]>;
  }
}

/** A frame that was taken: what it answers, and when, in milliseconds since 1970. */
export interface Watched {
  inputSeq: number;
  at: number;
}

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
