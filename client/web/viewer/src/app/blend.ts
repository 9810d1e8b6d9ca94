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

export interface BlendFacts {
  isOn: boolean;
  /** How many shapes are ready. */
  ready: number;
  /** Why no more are prepared, in a sentence; empty if nothing is wrong. */
  fault: string;
}

/** What shapes depend on besides p. */
function workOf({ handles, paintedP, stiffness, region, isAutomatic }: Document): readonly unknown[] {
  return [handles, paintedP, stiffness, region, isAutomatic];
}

/** Prepares the first picture's shape for several p while nothing else is done, so that a slider passes through them at once. */
export class Blend {
  readonly facts = new State<BlendFacts>({ isOn: false, ready: 0, fault: "" });
  #shapes = new Map<number, Shape>();
  #timer: ReturnType<typeof setTimeout> | undefined;
  #run = new AbortController();

  constructor(readonly app: App) {
    app.facts.watch(
      ({ mesh, document }) => [mesh, ...workOf(document)],
      () => this.#restart(),
    );
    app.view.watch(
      ({ isWelded, weldTolerance }) => [isWelded, weldTolerance],
      () => this.#restart(),
    );
  }

  switch(isOn: boolean): void {
    this.facts.set({ isOn });
    this.#restart();
  }

  /** Shows the shape at p in the first picture, until release(). Undefined if none is ready. */
  show(p: number): Blended | undefined {
    const found = blended(this.#shapes, p);
    if (found) this.app.preview(found.shape);
    return found;
  }

  /** Solves for p; until its first frame comes, the shape that was shown stays. */
  release(p: number): void {
    const { app } = this;
    app.endPreview(app.document.p !== p);
    if (app.document.p !== p) app.change({ ...app.document, p });
  }

  /** The shapes are those of other work, or not wanted any more. */
  #restart(): void {
    clearTimeout(this.#timer);
    this.#run.abort();
    this.#shapes.clear();
    this.app.endPreview(false);
    this.facts.set({ ready: 0, fault: "" });
    const { isAutomatic, handles } = this.app.document;
    if (!this.facts.now.isOn || isAutomatic || handles.length === 0) return;
    this.#timer = setTimeout(() => void this.#prepare(), idleMs);
  }

  async #prepare(): Promise<void> {
    const { mesh, document, panes } = this.app;
    if (panes[0]!.live?.isSettling) {
      this.#timer = setTimeout(() => void this.#prepare(), idleMs);
      return;
    }
    const { signal } = (this.#run = new AbortController());
    try {
      const documents = blendPs.map((p) => ({ ...document, p }));
      let next = 0;
      for await (const shape of shapesOf(mesh, documents, weldOf(derivedOf(mesh)), signal)) {
        if (signal.aborted) return;
        this.#shapes.set(blendPs[next++]!, shape);
        this.facts.set({ ready: this.#shapes.size });
      }
    } catch (thrown) {
      if (!signal.aborted) this.facts.set({ fault: sentence((thrown as LpdeformError).message) });
    }
  }
}
