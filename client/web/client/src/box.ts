import type { LpdeformError } from "./errors.js";
import type { WireFrame } from "./frame.js";

/** A frame, and the stream that it came on and that must acknowledge it. */
export interface Taken {
  frame: WireFrame;
  streamId: string;
}

/**
 * The newest frame that was not taken, and the callers who wait for it. Drops frames of an older epoch or update than an
 * earlier frame.
 */
export class FrameBox {
  #newest: Taken | undefined;
  #epoch = 0;
  #inputSeq = 0;
  #end: LpdeformError | "closed" | undefined;
  #waiting = new Set<() => void>();
  #lastFinal: WireFrame | undefined;
  #takes = 0;

  /** The frame that take() returned last, if it is final. */
  get lastFinal(): WireFrame | undefined {
    return this.#lastFinal;
  }

  /** How many frames take() has returned. */
  get takes(): number {
    return this.#takes;
  }

  /** Returns false if the frame is dropped. */
  put(frame: WireFrame, streamId: string): boolean {
    if (frame.epoch < this.#epoch || frame.inputSeq < this.#inputSeq) return false;
    this.#epoch = frame.epoch;
    this.#inputSeq = frame.inputSeq;
    if (this.#newest) frame.skippedInputs += this.#newest.frame.skippedInputs;
    this.#newest = { frame, streamId };
    this.#wake();
    return true;
  }

  /** Drops frames of earlier epochs. */
  beginEpoch(epoch: number): void {
    if (epoch <= this.#epoch) return;
    this.#epoch = epoch;
    this.#newest = undefined;
  }

  /** Epochs start again, because the session is a new one. */
  beginSession(): void {
    this.#epoch = 0;
    this.#newest = undefined;
  }

  /** Nothing more comes. */
  finish(end: LpdeformError | "closed"): void {
    this.#end ??= end;
    this.#wake();
  }

  /** Reverses finish(). Forgets the last frame taken, because another writer may have changed the session since. */
  resume(): void {
    this.#lastFinal = undefined;
    if (this.#end !== "closed") this.#end = undefined;
  }

  /** The newest frame, if there is one; throws the reason if nothing more comes. */
  take(): Taken | undefined {
    const taken = this.#newest;
    this.#newest = undefined;
    if (!taken && this.#end && this.#end !== "closed") throw this.#end;
    if (taken) {
      this.#lastFinal = taken.frame.isFinal ? taken.frame : undefined;
      ++this.#takes;
      this.#wake();
    }
    return taken;
  }

  get isClosed(): boolean {
    return this.#end === "closed" && !this.#newest;
  }

  /**
   * Waits until take() has something to return or throw, until it has returned more than `takes` frames, or until the signal
   * aborts.
   */
  async wait(takes: number, signal?: AbortSignal): Promise<void> {
    while (!this.#newest && !this.#end && this.#takes === takes && !signal?.aborted) {
      await new Promise<void>((resolve) => {
        const done = () => {
          this.#waiting.delete(done);
          signal?.removeEventListener("abort", done);
          resolve();
        };
        this.#waiting.add(done);
        signal?.addEventListener("abort", done);
      });
    }
  }

  #wake(): void {
    for (const done of [...this.#waiting]) done();
  }
}
