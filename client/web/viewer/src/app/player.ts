import { atPose, played } from "../model/key_poses.js";
import type { Document } from "../model/document.js";
import { State } from "../model/state.js";
import type { App } from "./app.js";

/** From one pose to the next. */
export const secondsEach = 1.5;
/** However slowly the page draws, what lies between two poses is seen. */
export const mostSecondsAtOnce = 0.1;

/** Plays the poses one after the other. The server solves for what is between them. All of it is one step, and Escape reverts it. */
export class Player {
  readonly facts = new State({ isPlaying: false });
  #shown: Document | undefined;

  constructor(readonly app: App) {}

  play(): void {
    const { keyPoses = [] } = this.app.document;
    if (keyPoses.length < 2) return this.app.notify("There is nothing to play before there are two poses.", true);
    this.app.endAll();
    this.app.endGesture();
    this.#tell(true);
    this.#shown = this.app.document;
    let [seconds, last] = [0, performance.now()];
    const step = (now: number) => {
      if (!this.#isGoingOn) return this.#end();
      seconds += Math.min(Math.max(now - last, 0) / 1000, mostSecondsAtOnce);
      last = now;
      const document = played(this.#shown!, seconds, secondsEach);
      if (!document) return this.stop(atPose(this.#shown!, keyPoses.at(-1)!));
      this.#show(document, now);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  /** Stays where it is, or at `last`. */
  stop(last?: Document): void {
    if (this.#isGoingOn) {
      if (last) this.#show(last, performance.now());
      this.app.endGesture();
    }
    this.#end();
  }

  /** False once something else has changed the document, or Escape was pressed. */
  get #isGoingOn(): boolean {
    return this.facts.now.isPlaying && this.app.document === this.#shown;
  }

  #show(document: Document, time: number): void {
    this.app.during(document, time, true);
    this.#shown = document;
  }

  #end(): void {
    this.#shown = undefined;
    this.#tell(false);
  }

  #tell(isPlaying: boolean): void {
    this.app.isPlaying = isPlaying;
    this.facts.set({ isPlaying });
  }
}
