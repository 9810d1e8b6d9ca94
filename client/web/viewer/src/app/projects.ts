import { type Project, readProject, writeProject } from "../io/project.js";
import { prepare } from "../io/opened.js";
import { weldingOf } from "./asides.js";
import type { App } from "./app.js";

/** The present work as a file. */
export function saveProject(app: App): Promise<Uint8Array<ArrayBuffer>> {
  const { mesh, document, view } = app;
  return writeProject({ mesh, document, view: view.now, look: app.panes[0]!.stage.look });
}

/** Opens a project in place of the present work, which is set aside. If the file has a fault, nothing changes: FileFault. */
export async function openProject(app: App, name: string, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  await show(app, await readProject(name, bytes));
}

async function show(app: App, { mesh, document, view, look }: Project): Promise<void> {
  const { shape, detail, selected, isYUp, pinned, isWelded, weldTolerance, ...settings } = view;
  await prepare(mesh, weldingOf(view)); // what follows happens at once
  app.endAll();
  app.view.set({ ...settings, isYUp }); // before the camera is set, because that depends on what is up
  await app.restore({ mesh, document, look, view: { shape, detail, selected, isYUp, pinned, isWelded, weldTolerance } });
}
