import { derivedOf, weldOf } from "lpdeform-client/mesh/derived";
import type { LpdeformError } from "lpdeform-client";
import { sentence } from "../link/status.js";
import { shapesOf } from "../link/prepare.js";
import { type Blended, blended, blendPs, type Shape } from "../model/blend.js";
import type { Document } from "../model/document.js";
import { State } from "../model/state.js";
import type { App } from "./app.js";

/** How long nothing must have changed before shapes are prepared. */
const idleMs = 1500;
/** The same for a mesh of more than `mostSoon` vertices whose slider was not used yet. So many take two cores some 20 s. */
const longIdleMs = 20_000;
export const mostSoon = 20_000;
/** A solve sends frames on the way, which nobody sees. */
const framesPerSecond = 10;

export interface BlendFacts {
  /** The p at which the slider is held. */
  held: number | undefined;
  /** Whether the mesh is so large that the page waits longer, or until the slider is used. */
  waitsLong: boolean;
  /** How many shapes are ready. */
  ready: number;
  /** About how long the others take, as far as this is known. */
  secondsLeft: number | undefined;
  /** Why no more are prepared, in a sentence; empty if nothing is wrong. */
  fault: string;
}

/** What shapes depend on besides p. */
function workOf({ handles, paintedP, stiffness, region, isAutomatic }: Document): readonly unknown[] {
  return [handles, paintedP, stiffness, region, isAutomatic];
}

/**
 * Prepares the first picture's shape for several p while nothing else is done, so that a slider passes through them at once. There is
 * a session for it only while it solves: any change of the document, and a page that is not seen, end it.
 */
export class Blend {
  readonly facts = new State<BlendFacts>({
    held: undefined,
    waitsLong: false,
    ready: 0,
    secondsLeft: undefined,
    fault: "",
  });
  /** In the order of blendPs. */
  #shapes = new Map<number, Shape>();
  /** Whether the slider was used since the work has changed. */
  #isAsked = false;
  /** Whether the press of the slider was cancelled and goes on without effect. */
  #isCancelled = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #run = new AbortController();

  constructor(readonly app: App) {
    app.facts.watch(
      ({ mesh, document }) => [mesh, ...workOf(document)],
      () => this.#drop(),
    );
    app.view.watch(
      ({ isWelded, weldTolerance }) => [isWelded, weldTolerance],
      () => this.#drop(),
    );
    app.facts.watch(
      ({ document }) => [document.p],
      () => this.cancel(),
    );
    app.facts.watch(
      ({ document, isFilming, problem, status }) => [document, isFilming, problem, status.kind],
      () => this.#soon(),
    );
    app.onCancel.add(() => this.cancel());
    document.addEventListener("visibilitychange", () => this.#soon());
  }

  /** Call it when the slider is pressed. */
  begin(): void {
    this.#isCancelled = false;
  }

  /**
   * Shows the shape at p in the first picture, until release() or cancel(). Undefined if none is ready; then they are prepared from
   * now on. Undefined and without effect, too, in a press that was cancelled.
   */
  show(p: number): Blended | undefined {
    if (this.#isCancelled) return undefined;
    this.facts.set({ held: p });
    if (this.facts.now.waitsLong || this.facts.now.fault) this.#ask();
    const found = blended(this.#shapes, p);
    if (found) this.app.preview(found.shape, found.low < found.high ? p : found.low);
    return found;
  }

  /** Solves for the p at which the slider was held; until its first frame comes, the shape that was shown stays. */
  release(): void {
    const { app } = this;
    const { held: p } = this.facts.now;
    this.#isCancelled = false;
    if (p === undefined) return;
    this.facts.set({ held: undefined });
    app.endPreview(app.document.p !== p);
    if (app.document.p !== p) app.change({ ...app.document, p });
  }

  /** Ends the press of the slider without a change. False if there is none. */
  cancel(): boolean {
    if (this.facts.now.held === undefined) return false;
    this.#isCancelled = true;
    this.facts.set({ held: undefined });
    this.app.endPreview(false);
    return true;
  }

  #ask(): void {
    this.#isAsked = true;
    this.facts.set({ fault: "" });
    this.#soon();
  }

  /** The shapes are those of other work. */
  #drop(): void {
    this.#shapes.clear();
    this.#isAsked = false;
    if (!this.cancel()) this.app.endPreview(false);
    this.facts.set({ ready: 0, secondsLeft: undefined, fault: "" });
    this.#soon();
  }

  /** Stops at once, and goes on when nothing else has been done for some time. */
  #soon(): void {
    clearTimeout(this.#timer);
    this.#run.abort();
    const { document: work, mesh } = this.app;
    const isPossible = !work.isAutomatic && work.handles.length > 0;
    const isLeft = this.#shapes.size < blendPs.length && this.facts.now.fault === "";
    const isWanted = isPossible && isLeft;
    const waitsLong = isWanted && !this.#isAsked && mesh.positions.length > 3 * mostSoon;
    this.facts.set({ waitsLong, secondsLeft: undefined });
    const isSeen = document.visibilityState !== "hidden";
    if (isWanted && isSeen && this.#mayBecomeQuiet) this.#after(waitsLong ? longIdleMs : idleMs);
  }

  #after(ms: number): void {
    this.#timer = setTimeout(() => (this.#isQuiet ? void this.#prepare() : this.#after(idleMs)), ms);
  }

  /** Otherwise this is tried again when these facts have changed. */
  get #mayBecomeQuiet(): boolean {
    const { isFilming, problem, status } = this.app.facts.now;
    return status.kind === "live" && problem === undefined && !isFilming;
  }

  /** Whether no drag is under way, and the server has solved for all that is shown. */
  get #isQuiet(): boolean {
    const { history, panes } = this.app;
    const isSolved = panes.every(({ live, frame }) => live && !live.isSettling && frame?.isFinal);
    return history.settled === history.present && isSolved;
  }

  async #prepare(): Promise<void> {
    const { mesh, document } = this.app;
    const { signal } = (this.#run = new AbortController());
    this.facts.set({ waitsLong: false });
    const begun = performance.now();
    // Each is solved from the one before, also the first that is new.
    const ps = blendPs.slice(Math.max(this.#shapes.size - 1, 0));
    try {
      const documents = ps.map((p) => ({ ...document, p }));
      let done = 0;
      for await (const shape of shapesOf(mesh, documents, weldOf(derivedOf(mesh)), signal, framesPerSecond)) {
        if (signal.aborted) return;
        this.#shapes.set(ps[done++]!, shape);
        const secondsLeft = (((performance.now() - begun) / 1000) * (ps.length - done)) / done;
        this.facts.set({ ready: this.#shapes.size, secondsLeft });
      }
    } catch (thrown) {
      if (!signal.aborted) this.facts.set({ fault: faultOf(thrown as LpdeformError) });
    }
  }
}

function faultOf({ code, message }: LpdeformError): string {
  return code === "resource_exhausted" ? "The server has no room for it now." : sentence(message);
}
