import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { ErrorCode } from "lpdeform-client";
import { Live } from "../src/link/live.js";
import { emptyDocument } from "../src/model/document.js";

/** Sessions that open and whose stream then fails; `frames` before it does. */
const server = vi.hoisted(() => ({ opened: 0, most: 10, frames: 0, code: "unavailable" as ErrorCode, reason: "" }));

vi.mock("lpdeform-client", async (original) => {
  const client = await original<typeof import("lpdeform-client")>();
  return {
    ...client,
    openSession: () => {
      ++server.opened;
      return Promise.resolve({
        meshReport: { notices: [] },
        on: () => undefined,
        update: () => 1,
        poll: () => undefined,
        close: () => Promise.resolve(),
        async *[Symbol.asyncIterator]() {
          for (let k = 0; k < server.frames; ++k) yield await Promise.resolve({ inputSeq: 1 });
          if (server.opened === server.most) await new Promise(() => undefined);
          throw new client.LpdeformError(server.code, "no stream", { reason: server.reason });
        },
      });
    },
  };
});

const quiet = { status: vi.fn(), report: vi.fn(), problem: vi.fn(), notice: vi.fn() };
const watcher = { frame: vi.fn(() => queueMicrotask(() => live.take())), ...quiet };
let live: Live;
const begin = (code: ErrorCode, frames: number, reason = "") => {
  Object.assign(server, { opened: 0, frames, code, reason });
  live = new Live(
    { name: "a", positions: new Float32Array(9), faces: Uint32Array.of(0, 1, 2) },
    emptyDocument,
    "first",
    "float32",
    watcher,
  );
};

beforeEach(() => void vi.useFakeTimers());

afterEach(() => {
  live.close();
  vi.useRealTimers();
});

it("a stream that is refused for good ends it, in words", async () => {
  begin("unauthenticated", 0);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(server.opened).toBe(1);
  expect(live.status).toMatchObject({ kind: "refused", title: "The server does not let you in" });
});

it("frames that never fit end it, with what to do", async () => {
  begin("data_loss", 0, "FRAME_PARTS");
  await vi.advanceTimersByTimeAsync(60_000);
  expect(server.opened).toBe(1);
  expect(live.status).toMatchObject({ kind: "refused", title: "The server's frames do not fit this mesh" });
  expect(live.status.text).toContain("reload the page");
});

it("sessions without frames are opened again after pauses that grow", async () => {
  begin("unavailable", 0);
  for (const [milliseconds, opened] of [
    [290, 1],
    [20, 2],
    [600, 3],
    [1200, 4],
    [2400, 5],
    [3000, 6],
    [3000, 7],
  ] as const) {
    await vi.advanceTimersByTimeAsync(milliseconds);
    expect(server.opened).toBe(opened);
  }
});

it("and at once where there were frames", async () => {
  begin("unavailable", 2);
  await vi.advanceTimersByTimeAsync(0);
  expect(server.opened).toBe(server.most);
  expect(watcher.frame).toHaveBeenCalledTimes(2 * server.most);
});
