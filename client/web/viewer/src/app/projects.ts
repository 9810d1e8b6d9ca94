import { type Project, readProject, writeProject } from "../io/project.js";
import type { App } from "./app.js";

/** The present work as a file. */
export function saveProject(app: App): Promise<Uint8Array<ArrayBuffer>> {
  const { mesh, document, view } = app;
  return writeProject({ mesh, document, view: view.now, look: app.panes[0]!.stage.look });
}

/** Opens a project in place of the present work, which is set aside. If the file has a fault, nothing changes: FileFault. */
export async function openProject(app: App, name: string, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  show(app, await readProject(name, bytes));
}

function show(app: App, { mesh, document, view, look }: Project): void {
  const { shape, detail, selected, isYUp, pinned, isWelded, ...settings } = view;
  app.endAll();
  app.view.set({ ...settings, isYUp }); // before the camera is set, because that depends on what is up
  app.restore({ mesh, document, look, view: { shape, detail, selected, isYUp, pinned, isWelded } });
}
