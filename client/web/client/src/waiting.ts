/** Ends early where the signal says so. */
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

/** As the promise, or rejects with the signal's reason as soon as it says so. What is waited for goes on. */
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

  /** `over`: none any more. */
  constructor(readonly over: AbortSignal) {}

  /** True where end() came before the time was over. */
  async wait(milliseconds: number): Promise<boolean> {
    if (this.over.aborted) return true;
    const { signal } = this.#abort;
    await pause(milliseconds, signal);
    return signal.aborted;
  }

  /** Of all that wait now. */
  end(): void {
    this.#abort.abort();
    this.#abort = new AbortController();
  }
}
