import type { LpdeformError } from "./errors.js";
import type { Connection, Notice } from "./types.js";

/** Who is told what becomes of a session. */
export interface Watcher {
  problem(error: LpdeformError): void;
  connection(state: Connection): void;
  notice(notice: Notice | undefined): void;
}

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
