import { cannotBeReached, type ErrorDetails, LpdeformError } from "./errors.js";

/** Time limit of the probes. */
const probeMs = 3000;

/**
 * Browsers report the same error for a call that a proxy does not allow to this page's origin as for a call that reaches no
 * server. If the proxy answers, but not to this page, the returned error says so and what to do. Otherwise the error stays as
 * it is.
 */
export async function explained(error: LpdeformError, baseUrl: string): Promise<LpdeformError> {
  const page = globalThis.location?.origin;
  if (!page || error.message !== cannotBeReached) return error;
  const proxy = new URL(baseUrl, page).origin;
  if (proxy === page) return error;
  const answers = async (mode: RequestMode) => {
    const request = { mode, cache: "no-store", credentials: "omit", signal: AbortSignal.timeout(probeMs) } as const;
    return fetch(`${proxy}/lpdeform.v1.DeformService/ListSessions`, request).then(
      () => true,
      () => false,
    );
  };
  if ((await answers("cors")) || !(await answers("no-cors"))) return error;
  const text =
    `The proxy at ${proxy} does not take calls from pages of ${page}. Start it with --origin ${page}, as in ` +
    `"deploy/up --origin ${page}" or "deploy/web --origin ${page}".`;
  const details: ErrorDetails = { reason: "ORIGIN_NOT_ALLOWED", element: page, limit: `--origin ${page}` };
  return new LpdeformError("permission_denied", text, details, error);
}
