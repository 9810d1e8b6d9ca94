import { expect, it, vi } from "vitest";
import { openSession, type Session } from "lpdeform-client";
import { shapesOf } from "../src/link/prepare.js";
import { emptyDocument } from "../src/model/document.js";

// The session of shapes that are prepared, where it is given up before it is there.

vi.mock("lpdeform-client", () => ({ openSession: vi.fn() }));

const mesh = { name: "", positions: new Float32Array(9), faces: Uint32Array.of(0, 1, 2) };

it("a session that comes after it was given up is closed; what waits for it ends at once, and its creation after ten seconds", async () => {
  vi.useFakeTimers();
  const close = vi.fn(async () => undefined);
  let arrive: (session: Session) => void;
  let until: AbortSignal;
  vi.mocked(openSession).mockImplementation((_mesh, options) => {
    until = options!.signal!;
    return new Promise((done) => (arrive = done));
  });
  const run = new AbortController();
  const first = shapesOf(mesh, [emptyDocument], undefined, run.signal).next();
  run.abort(new Error("given up"));
  await expect(first).rejects.toThrow("given up");
  expect(until!.aborted).toBe(false);
  arrive!({ close } as unknown as Session);
  await vi.advanceTimersByTimeAsync(0);
  expect(close).toHaveBeenCalledOnce();
  await vi.advanceTimersByTimeAsync(10_000);
  expect(until!.aborted).toBe(true);
  vi.useRealTimers();
});

it("nothing is created once it is given up", async () => {
  vi.mocked(openSession).mockClear();
  await expect(shapesOf(mesh, [emptyDocument], undefined, AbortSignal.abort(new Error("late"))).next()).rejects.toThrow("late");
  expect(openSession).not.toHaveBeenCalled();
});
