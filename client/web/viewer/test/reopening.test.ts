import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { ErrorCode, Reason } from "lpdeform-client";
import { Live } from "../src/link/live.js";
import { emptyDocument } from "../src/model/document.js";

/** Sessions that open, or are refused, and whose stream then fails; `frames` before it does, `stoodMs` after they opened. */
const healthy = {
  isFull: false,
  frames: 0,
  stoodMs: 0,
  code: "unavailable" as ErrorCode,
  reason: "" as Reason,
  retryAfterMs: 0,
};
const server = vi.hoisted(() => ({ asked: 0, says: undefined as unknown as typeof healthy }));

vi.mock("lpdeform-client", async (original) => {
  const client = await original<typeof import("lpdeform-client")>();
  return {
    ...client,
    openSession: () => {
      ++server.asked;
      const { isFull, frames, stoodMs, code, reason, retryAfterMs } = server.says;
      const error = new client.LpdeformError(code, "no stream", { reason, retryAfterMs });
      if (isFull) return Promise.reject(error);
      return Promise.resolve({
        meshReport: { notices: [] },
        on: () => undefined,
        update: () => 1,
        poll: () => undefined,
        close: () => Promise.resolve(),
        async *[Symbol.asyncIterator]() {
          for (let k = 0; k < frames; ++k) yield await Promise.resolve({ inputSeq: 1 });
          if (stoodMs > 0) await new Promise((stood) => setTimeout(stood, stoodMs));
          throw error;
        },
      });
    },
  };
});

const quiet = { status: vi.fn(), report: vi.fn(), problem: vi.fn(), notice: vi.fn(), better: vi.fn() };
const watcher = { frame: vi.fn(() => queueMicrotask(() => live.take())), ...quiet };
let live: Live;
const begin = (says: Partial<typeof healthy>) => {
  Object.assign(server, { asked: 0, says: { ...healthy, ...says } });
  live = new Live(
    { name: "a", positions: new Float32Array(9), faces: Uint32Array.of(0, 1, 2) },
    emptyDocument,
    "first",
    "float32",
    watcher,
  );
};

/** Milliseconds until the server is asked again, to one. */
async function pauseUntilAsked(): Promise<number> {
  const before = server.asked;
  for (let waited = 0; waited < 100_000; ++waited) {
    if (server.asked > before) return waited;
    await vi.advanceTimersByTimeAsync(1);
  }
  throw new Error("it was not asked again");
}

async function pauses(count: number): Promise<number[]> {
  await vi.advanceTimersByTimeAsync(0);
  const found: number[] = [];
  while (found.length < count) found.push(await pauseUntilAsked());
  return found;
}

beforeEach(() => void vi.useFakeTimers());

afterEach(() => {
  live.close();
  vi.useRealTimers();
  vi.restoreAllMocks();
});

it("a stream that is refused for good ends it, in words", async () => {
  begin({ code: "unauthenticated" });
  await vi.advanceTimersByTimeAsync(60_000);
  expect(server.asked).toBe(1);
  expect(live.status).toMatchObject({ kind: "refused", title: "The server does not let you in" });
});

it("frames that never fit end it, with what to do", async () => {
  begin({ code: "data_loss", reason: "FRAME_PARTS" });
  await vi.advanceTimersByTimeAsync(60_000);
  expect(server.asked).toBe(1);
  expect(live.status).toMatchObject({ kind: "refused", title: "The server's frames do not fit this mesh" });
  expect(live.status.text).toContain("reload the page");
});

// As after the streams of one session: tests/golden/recovery.json has these pauses.
describe.each([
  [0, [25, 50, 100, 200, 400, 800, 1000, 1000]],
  [1, [50, 100, 200, 400, 800, 1600, 2000, 2000]],
] as const)("with chance %d, after pauses that grow", (chance, growing) => {
  beforeEach(() => void vi.spyOn(Math, "random").mockReturnValue(chance));

  it.each([
    ["sessions without frames are opened again", {}],
    ["sessions that break at once, with frames", { frames: 2 }],
    ["sessions that cannot be opened are asked for again", { isFull: true }],
  ])("%s", async (_, says) => {
    begin(says);
    expect(await pauses(growing.length)).toEqual(growing);
  });

  it.each([
    [30_000, 30_000],
    [3_600_000, 60_000], // a minute at most
  ])("a full server that asks for %d ms has them, and the pauses on top", async (retryAfterMs, asked) => {
    begin({ isFull: true, code: "resource_exhausted", reason: "SESSIONS_FULL", retryAfterMs });
    expect(await pauses(3)).toEqual(growing.slice(0, 3).map((pause) => asked + pause));
  });

  it("a stream that ends with a pause asked for is followed by it", async () => {
    begin({ code: "resource_exhausted", retryAfterMs: 500 });
    expect(await pauses(2)).toEqual(growing.slice(0, 2).map((pause) => 500 + pause));
  });

  it("a session that stood is opened again soon, each time", async () => {
    begin({ frames: 2, stoodMs: 2000 });
    const soon = 2000 + growing[0];
    expect(await pauses(3)).toEqual([soon, soon, soon]);
    expect(watcher.frame).toHaveBeenCalledTimes(8);
  });
});

it("a page that has done with it waits for nothing more", async () => {
  begin({ isFull: true, code: "resource_exhausted", retryAfterMs: 60_000 });
  await vi.advanceTimersByTimeAsync(1000);
  expect(vi.getTimerCount()).toBe(1);
  live.close();
  await vi.advanceTimersByTimeAsync(0);
  expect([vi.getTimerCount(), server.asked]).toEqual([0, 1]);
});
