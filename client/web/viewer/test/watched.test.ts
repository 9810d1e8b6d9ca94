import { LpdeformError } from "lpdeform-client";
import { expect, it } from "vitest";
import { statusAtEnd } from "../src/link/status.js";
import { linkTo, sessionOf, watchedIn, watchedStatus } from "../src/link/watched.js";

const digits = "0123456789abcdef0123456789abcdef";

it("a link names the session and nothing of what the page shows besides, and comes back", () => {
  const link = linkTo(`sessions/${digits}`, "https://example.org/deform/?shape=sheet&detail=fine#top");
  expect(link).toBe(`https://example.org/deform/#watch=${digits}`);
  expect(sessionOf(watchedIn(new URL(link).hash)!)).toBe(`sessions/${digits}`);
  for (const other of ["", "#", "#top"]) expect(watchedIn(other)).toBeNull();
  for (const wrong of ["", digits.slice(1), `${digits}0`, `${digits.slice(1)}/`, digits.toUpperCase(), "../x"]) {
    expect(sessionOf(wrong)).toBeUndefined();
  }
});

it("a watcher is told whether the session is over, will come back, or is not allowed", () => {
  const kind = (error: LpdeformError) => [watchedStatus(error).kind, watchedStatus(error).title];
  expect(kind(new LpdeformError("not_found", "x", { reason: "SESSION_UNKNOWN" }))).toEqual([
    "refused",
    "This session has ended, or is not yours to see",
  ]);
  expect(kind(new LpdeformError("aborted", "x", { reason: "SESSION_DELETED" as never }))[0]).toBe("refused");
  expect(kind(new LpdeformError("unavailable", "x"))).toEqual(["away", "The server is away"]);
  expect(kind(new LpdeformError("permission_denied", "You may not."))).toEqual(["refused", "This session cannot be watched"]);
  const misfit = new LpdeformError("data_loss", "The frame does not fit.", { reason: "FRAME_VERTICES" as never });
  expect(watchedStatus(misfit).kind).toBe("away");
  expect(watchedStatus(misfit, statusAtEnd(misfit)).title).toBe("This session cannot be watched");
  expect(watchedStatus(new LpdeformError("unavailable", "x")).text).not.toContain("Your work");
});
