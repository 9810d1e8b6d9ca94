import { LpdeformError } from "lpdeform-client";
import { morphGlb } from "../io/gltf_morphs.js";
import { shapesOf } from "../link/prepare.js";
import { derivedOf, weldOf } from "lpdeform-client/mesh/derived";
import type { Shape } from "../model/blend.js";
import { type Moment, momentsOf, shapeAt } from "../model/film.js";
import { drawnAt } from "lpdeform-client/mesh/drawmesh";
import type { App } from "./app.js";
import { mostSecondsAtOnce, secondsEach } from "./player.js";

/** Shapes that are solved from one pose to the next. */
const steps = 6;
/** Of all shapes of a film. */
const mostBytes = 500e6;
const bytesEach = 24;
/** How long a video stays at its first and last picture. */
const restSeconds = 0.4;
const formats = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];

export interface Film {
  moments: readonly Moment[];
  shapes: readonly Shape[];
  seconds: number;
}

/**
 * Solves for the poses and for what is between them, in a session of its own. Undefined if there are no two poses, which the user is
 * told, or if the work changes meanwhile. Rejects with an LpdeformError.
 */
async function film(app: App, signal: AbortSignal): Promise<Film | undefined> {
  const { mesh, document } = app;
  const poses = document.keyPoses?.length ?? 0;
  if (poses < 2) {
    app.notify("There is nothing to film before there are two poses: “Keep this pose” in the panel “Poses”.", true);
    return undefined;
  }
  const isAnother = () => app.mesh !== mesh || app.document !== document;
  const room = Math.floor(mostBytes / ((bytesEach * mesh.positions.length) / 3) / poses);
  const moments = momentsOf(document, Math.min(steps, Math.max(room, 1)));
  const shapes: Shape[] = [];
  const say = () => app.notifyWhile(`Solving for the poses: ${shapes.length + 1} of ${moments.length}… Escape stops it.`);
  let done = say();
  try {
    const documents = moments.map((moment) => moment.document);
    for await (const shape of shapesOf(mesh, documents, weldOf(derivedOf(mesh)), signal)) {
      if (isAnother()) break;
      shapes.push(shape);
      if (shapes.length < moments.length) done = say();
    }
    return isAnother() ? sayChanged(app) : { moments, shapes, seconds: secondsEach * (poses - 1) };
  } finally {
    done();
  }
}

/** Aborts when Escape is pressed, for as long as the work goes on. */
async function untilEscape<Made>(app: App, work: (signal: AbortSignal) => Promise<Made>): Promise<Made> {
  const over = new AbortController();
  const stop = ({ code }: KeyboardEvent) => {
    if (code === "Escape") over.abort(new LpdeformError("cancelled", "Escape was pressed."));
  };
  window.addEventListener("keydown", stop);
  app.facts.set({ isFilming: true });
  try {
    return await work(over.signal);
  } finally {
    app.facts.set({ isFilming: false });
    window.removeEventListener("keydown", stop);
  }
}

function sayChanged(app: App): undefined {
  app.notify("The work has changed: the poses were not exported.", true);
}

/** The poses as a GLB with morph targets and an animation through them, shaded as on the page. Rejects after Escape, too. */
export async function posesAsGlb(app: App): Promise<Uint8Array<ArrayBuffer> | undefined> {
  const { mesh } = app;
  const made = await untilEscape(app, (signal) => film(app, signal));
  if (!made) return undefined;
  const { moments, shapes, seconds } = made;
  const { drawn } = derivedOf(mesh).shown;
  const stills = shapes.map(({ positions }, k) => ({ name: moments[k]!.name, ...drawnAt(positions, drawn) }));
  return morphGlb(mesh.name, drawn.indices, stills, seconds / (stills.length - 1));
}

/**
 * The poses as a video of the first picture, as it looks. Undefined if this browser records none, or as film(). Rejects after Escape,
 * too.
 */
export function posesAsVideo(app: App): Promise<Blob | undefined> {
  return untilEscape(app, (signal) => filmed(app, signal));
}

async function filmed(app: App, signal: AbortSignal): Promise<Blob | undefined> {
  const mimeType = formats.find((format) => globalThis.MediaRecorder?.isTypeSupported(format));
  if (!mimeType) {
    app.notify("This browser records no videos.", true);
    return undefined;
  }
  const made = await film(app, signal);
  if (!made) return undefined;
  const { mesh } = app;
  const { selected, alsoSelected } = app.view.now;
  const done = app.notifyWhile("Recording the poses… Escape stops it.");
  app.view.set({ selected: undefined });
  try {
    const video = await recorded(app, made, mimeType, signal);
    return app.mesh === mesh ? video : sayChanged(app);
  } finally {
    done();
    app.endPreview(false);
    if (app.mesh === mesh) app.view.set({ selected, alsoSelected });
  }
}

/**
 * Shows the shapes one after the other, and records a copy of each picture: the size of the stage's own changes if drawing is slow.
 */
async function recorded(app: App, { shapes, seconds }: Film, mimeType: string, signal: AbortSignal): Promise<Blob> {
  const { stage } = app.panes[0]!;
  const canvas = document.createElement("canvas");
  const ratio = Math.min(devicePixelRatio, 2);
  [canvas.width, canvas.height] = [stage.width, stage.height].map((size) => 2 * Math.round((size * ratio) / 2)) as [
    number,
    number,
  ];
  const context = canvas.getContext("2d")!;
  const copy = () => context.drawImage(stage.canvas, 0, 0, canvas.width, canvas.height);
  app.afterDrawing.add(copy);
  const stream = canvas.captureStream(60);
  const recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond: 12e6 });
  const parts: Blob[] = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  const stopped = new Promise((resolve) => (recorder.onstop = resolve));
  try {
    app.preview(shapes[0]!);
    await nextPicture(app);
    recorder.start();
    await play(app, shapes, seconds, signal);
    recorder.stop();
    await stopped;
  } finally {
    app.afterDrawing.delete(copy);
    if (recorder.state !== "inactive") recorder.stop();
    for (const track of stream.getTracks()) track.stop();
  }
  return new Blob(parts, { type: mimeType });
}

function nextPicture(app: App): Promise<void> {
  return new Promise((resolve) => {
    const drawn = () => {
      app.afterDrawing.delete(drawn);
      resolve();
    };
    app.afterDrawing.add(drawn);
  });
}

/** With pictures at rest before and after. Ends early if another mesh is opened. Rejects with the signal's reason. */
function play(app: App, shapes: readonly Shape[], seconds: number, signal: AbortSignal): Promise<void> {
  const { mesh } = app;
  let [at, last] = [-restSeconds, performance.now()];
  return new Promise((resolve, reject) => {
    const step = (now: number) => {
      if (signal.aborted) return reject(signal.reason as LpdeformError);
      at += Math.min(Math.max(now - last, 0) / 1000, mostSecondsAtOnce);
      last = now;
      if (at > seconds + restSeconds || app.mesh !== mesh) return resolve();
      app.preview(shapeAt(shapes, (at / seconds) * (shapes.length - 1)));
      requestAnimationFrame(step);
    };
    step(last);
  });
}
