/** Ends early if the signal aborts. */
export function pause(milliseconds: number, signal?: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      signal?.removeEventListener("abort", done);
      resolve();
    };
    const timer = setTimeout(done, milliseconds);
    signal?.addEventListener("abort", done);
    if (signal?.aborted) done();
  });
}

/** Like the promise, but rejects with the signal's reason as soon as the signal aborts. The work behind the promise goes on. */
export function unlessAborted<Value>(promise: Promise<Value>, signal: AbortSignal): Promise<Value> {
  return new Promise((resolve, reject) => {
    const stop = () => reject(signal.reason);
    const done = () => signal.removeEventListener("abort", stop);
    signal.addEventListener("abort", stop);
    promise.then(resolve, reject).finally(done);
    if (signal.aborted) stop();
  });
}

/** Pauses that can be cut short. */
export class Pauses {
  #abort = new AbortController();

  /** `over`: when it aborts, there are no more pauses. */
  constructor(readonly over: AbortSignal) {}

  /** True if end() was called before the time was over. */
  async wait(milliseconds: number): Promise<boolean> {
    if (this.over.aborted) return true;
    const { signal } = this.#abort;
    await pause(milliseconds, signal);
    return signal.aborted;
  }

  /** Ends all present pauses. */
  end(): void {
    this.#abort.abort();
    this.#abort = new AbortController();
  }
}
