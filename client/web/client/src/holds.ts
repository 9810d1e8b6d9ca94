/** The state of a session's updates, as far as holds need it. */
export interface Traffic {
  /** Whether no update is under way. */
  isQuiet(): boolean;
  isClosed(): boolean;
  /** Updates may be sent again. */
  released(): void;
}

/** Keeps updates from being sent during a call that no update may overtake. */
export class Holds {
  #count = 0;
  #isUndoing = false;
  readonly #waiting = new Set<() => void>();

  constructor(readonly traffic: Traffic) {}

  /** Whether updates are held back. */
  get areThere(): boolean {
    return this.#count > 0;
  }

  /** Waits until no update is under way, and holds updates back until the returned function is called. */
  async updates(signal: AbortSignal): Promise<() => void> {
    ++this.#count;
    await this.#until(() => this.traffic.isQuiet() && !this.#isUndoing, signal);
    return () => this.#release();
  }

  /** Like updates(), but also keeps solves from beginning, after waiting for those under way. Rejects if the signal aborts. */
  async all(signal: AbortSignal): Promise<() => void> {
    const isFree = () => this.#count === 0;
    while (!isFree() && !signal.aborted) await this.#until(isFree, signal);
    signal.throwIfAborted();
    ++this.#count;
    this.#isUndoing = true;
    await this.#until(() => this.traffic.isQuiet(), signal);
    return () => {
      this.#isUndoing = false;
      this.#release();
    };
  }

  /** Something has ended: those who wait check again. */
  readonly wake = () => {
    for (const resolve of this.#waiting) resolve();
    this.#waiting.clear();
  };

  #release(): void {
    --this.#count;
    this.wake();
    this.traffic.released();
  }

  async #until(isSo: () => boolean, signal: AbortSignal): Promise<void> {
    signal.addEventListener("abort", this.wake, { once: true });
    while (!isSo() && !this.traffic.isClosed() && !signal.aborted) {
      await new Promise<void>((resolve) => this.#waiting.add(resolve));
    }
    signal.removeEventListener("abort", this.wake);
  }
}
