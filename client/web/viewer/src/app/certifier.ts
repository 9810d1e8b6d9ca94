import type { Document } from "../model/document.js";
import type { App } from "./app.js";

/** Larger meshes keep a server busy for seconds. */
const mostVertices = 20_000;
const quietMs = 700;

/** Asks for the gap when a result stands and nobody moves anything; gives way at once to whoever does. */
export function startCertifier(app: App): void {
  let waiting: ReturnType<typeof setTimeout> | undefined;
  let running: AbortController | undefined;
  let tried: Document | undefined;
  const stop = () => {
    clearTimeout(waiting);
    waiting = undefined;
    running?.abort();
    running = undefined;
  };
  const run = async () => {
    const abort = new AbortController();
    running = abort;
    const { document } = app;
    for (const pane of app.panes) {
      const result = await pane.live?.certify(abort.signal);
      if (abort.signal.aborted) return;
      pane.result = result;
      app.requestDraw();
    }
    tried = document;
    if (running === abort) running = undefined;
  };
  app.facts.watch((facts, before) => {
    if (facts.document !== before.document || facts.mesh !== before.mesh) stop();
  });
  app.afterDrawing.add(() => {
    const isDone = app.panes.every(({ frame, live }) => frame?.converged && live && !live.isSettling);
    const isWanted = tried !== app.document && app.document.handles.length > 0;
    if (!isDone) {
      if (waiting !== undefined) stop();
    } else if (isWanted && !running && waiting === undefined && app.mesh.positions.length <= 3 * mostVertices) {
      waiting = setTimeout(() => {
        waiting = undefined;
        void run();
      }, quietMs);
    }
  });
}
