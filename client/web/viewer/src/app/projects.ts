import { type Project, readProject, writeProject } from "../io/project.js";
import { prepare } from "../io/opened.js";
import { weldingOf } from "./asides.js";
import type { App } from "./app.js";

/** The present work as a file. While poses play it is the work from before. */
export function saveProject(app: App): Promise<Uint8Array<ArrayBuffer>> {
  app.flush();
  const { mesh, document, view, look, history, isPlaying } = app;
  return writeProject({ mesh, document: isPlaying ? history.settled : document, view: view.now, look });
}

/**
 * Opens a project in place of the present work, which is set aside. If the file has a fault, nothing changes: FileFault. False, and
 * nothing changes, if something else is opened in the meantime.
 */
export async function openProject(app: App, file: File): Promise<boolean> {
  const isNewest = app.opening();
  const project = await readProject(file.name, new Uint8Array(await file.arrayBuffer()));
  await prepare(project.mesh, weldingOf(project.view)); // what follows happens at once
  if (!isNewest()) return false;
  await show(app, project);
  return true;
}

async function show(app: App, { mesh, document, view, look }: Project): Promise<void> {
  const { shape, detail, selected, isYUp, pinned, isWelded, weldTolerance, ...settings } = view;
  app.endAll();
  app.view.set({ ...settings, isYUp }); // before the camera is set, because that depends on what is up
  await app.restore({ mesh, document, look, view: { shape, detail, selected, isYUp, pinned, isWelded, weldTolerance } });
}
