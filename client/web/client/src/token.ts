import type { Interceptor } from "@connectrpc/connect";
import { LpdeformError } from "./errors.js";
import type { ConnectOptions } from "./types.js";

/** Sends a bearer token with each call, requested from the caller's function when the call begins. */
export function bearing(token: NonNullable<ConnectOptions["token"]>): Interceptor {
  return (next) => async (request) => {
    const text = await newest(token);
    if (text !== "") request.header.set("authorization", `Bearer ${text}`);
    return next(request);
  };
}

async function newest(token: NonNullable<ConnectOptions["token"]>): Promise<string> {
  let text: unknown;
  try {
    text = await token();
  } catch (cause) {
    throw refused(`The function of the token failed: ${String(cause)}`, cause);
  }
  if (typeof text === "string" && /^[ -~]*$/.test(text)) return text;
  throw refused("The function of the token gave something that a header cannot carry.");
}

function refused(text: string, cause?: unknown): LpdeformError {
  return new LpdeformError("unauthenticated", text, { reason: "TOKEN_FUNCTION", limit: "printable ASCII" }, cause);
}
