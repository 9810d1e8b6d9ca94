import { cannotBeReached, type ErrorDetails, LpdeformError } from "./errors.js";

/** What the probes may take. */
const probeMs = 3000;

/**
 * Browsers say of a call that a proxy does not allow to pages of their address what they say of one that reaches nobody. Where the
 * proxy answers, but not to this page, the error says that and what to do; otherwise it stays as it is.
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
