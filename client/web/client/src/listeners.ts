import type { LpdeformError } from "./errors.js";
import type { Connection, Notice } from "./types.js";

/** Is told what happens to a session. */
export interface Watcher {
  problem(error: LpdeformError): void;
  connection(state: Connection): void;
  notice(notice: Notice | undefined): void;
}

/**
 * Calls a user's listener. If it throws, the error is reported as any other error of the page, by its "error" event. It is not
 * an error of the session, which goes on.
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
