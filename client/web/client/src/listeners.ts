/**
 * Calls what the user of this library gave. What it throws is reported as any fault of the page's, to its "error" event: it is no
 * fault of the session, which goes on.
 */
export function tell<Value>(listener: (value: Value) => void, value: Value): void {
  try {
    listener(value);
  } catch (fault) {
    if (typeof globalThis.reportError === "function") globalThis.reportError(fault);
    else
      queueMicrotask(() => {
        throw fault;
      });
  }
}
