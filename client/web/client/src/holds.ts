/** What is under way in a session, as far as holds ask. */
export interface Traffic {
  /** No update is on its way. */
  isQuiet(): boolean;
  isClosed(): boolean;
  /** Updates may be sent again. */
  released(): void;
}

/** Keeps updates from being sent while a call is made that none may overtake. */
export class Holds {
  #count = 0;
  #isUndoing = false;
  readonly #waiting = new Set<() => void>();

  constructor(readonly traffic: Traffic) {}

  /** No update may be sent. */
  get areThere(): boolean {
    return this.#count > 0;
  }

  /** Waits until no update is on its way, and keeps others from being sent until the result is called. */
  async updates(signal: AbortSignal): Promise<() => void> {
    ++this.#count;
    await this.#until(() => this.traffic.isQuiet() && !this.#isUndoing, signal);
    return () => this.#letGo();
  }

  /** As updates(), and keeps solves from beginning, too; waits for those that there are. Rejects where the signal ends it. */
  async all(signal: AbortSignal): Promise<() => void> {
    const isFree = () => this.#count === 0;
    while (!isFree() && !signal.aborted) await this.#until(isFree, signal);
    signal.throwIfAborted();
    ++this.#count;
    this.#isUndoing = true;
    await this.#until(() => this.traffic.isQuiet(), signal);
    return () => {
      this.#isUndoing = false;
      this.#letGo();
    };
  }

  /** Something has ended: whoever waits looks again. */
  readonly wake = () => {
    for (const resolve of this.#waiting) resolve();
    this.#waiting.clear();
  };

  #letGo(): void {
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
