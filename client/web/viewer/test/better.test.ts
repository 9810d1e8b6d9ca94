import { afterEach, expect, it, vi } from "vitest";
import { LpdeformError, type Notice, type Update } from "lpdeform-client";
import { Live } from "../src/link/live.js";
import { addHandle, changeHandle, type Document, emptyDocument } from "../src/model/document.js";
import { lowerText, percent, someOf } from "../src/model/words.js";
import { betterText } from "../src/ui/messages.js";

/** A session that the test speaks for. */
const session = vi.hoisted(() => ({
  meshReport: { notices: [] },
  newestInput: 0,
  notice: undefined as Notice | undefined,
  tell: (_: Notice | undefined) => {},
  takeBetterShape: vi.fn<() => Promise<unknown>>(),
  on(name: string, listener: (notice: Notice | undefined) => void) {
    if (name === "notice") this.tell = listener;
  },
  updates: [] as Update[],
  update(update: Update) {
    this.updates.push(update);
    return ++this.newestInput;
  },
  solve: vi.fn<() => Promise<unknown>>(),
  poll: () => undefined,
  close: () => Promise.resolve(),
  async *[Symbol.asyncIterator]() {
    await new Promise(() => {});
    yield undefined;
  },
}));

vi.mock("lpdeform-client", async (original) => ({
  ...(await original<typeof import("lpdeform-client")>()),
  openSession: () => Promise.resolve(session),
}));

const rest = new Float32Array(9);
const one: Document = addHandle(emptyDocument, [0], rest, { name: "tip" });
const mesh = { name: "a", positions: rest, faces: Uint32Array.of(0, 1, 2) };
const better: Notice = { reason: "better_shape", text: "Better.", inputSeq: 1, energy: 3, savedShare: 0.07 };
const watcher = {
  frame: vi.fn(),
  status: vi.fn(),
  report: vi.fn(),
  problem: vi.fn(),
  notice: vi.fn(),
  better: vi.fn(() => void shares.push(live.better?.savedShare)),
};
let live: Live;
/** What the page is told of better shapes, one after the other. */
let shares: (number | undefined)[] = [];

function say(notice: Notice | undefined): void {
  session.notice = notice;
  session.tell(notice);
}

/** A document on the server, which knows a better shape for it. */
async function told(): Promise<void> {
  Object.assign(session, { newestInput: 0, notice: undefined, updates: [] });
  live = new Live(mesh, one, "first", "float32", watcher);
  await vi.waitFor(() => expect(session.newestInput).toBe(1));
  shares = [];
  say(better);
}

afterEach(() => {
  live.close();
  vi.clearAllMocks();
});

it("a better shape is offered by what it saves, without a line of text, and no more once it is being taken", async () => {
  await told();
  session.takeBetterShape.mockImplementation(() => {
    say(undefined);
    return Promise.resolve({});
  });
  await live.takeBetter();
  await live.takeBetter();
  expect(shares).toEqual([0.07, undefined, undefined, undefined]);
  expect([session.takeBetterShape.mock.calls.length, watcher.notice.mock.calls.length]).toEqual([1, 0]);
});

it("a better shape is not offered any more once there is a newer input, also before a frame answers it", async () => {
  await told();
  live.show(changeHandle(one, "tip", { vertices: [0, 1] }));
  expect([session.newestInput, live.better]).toEqual([2, undefined]);
  await live.takeBetter();
  expect(session.takeBetterShape).not.toHaveBeenCalled();
});

it("a better shape that the server does not have any more is told in one line", async () => {
  await told();
  const error = new LpdeformError("failed_precondition", "None is known.", { reason: "NO_BETTER_SHAPE" });
  session.takeBetterShape.mockImplementation(() => {
    say(undefined);
    return Promise.reject(error);
  });
  await live.takeBetter();
  expect(watcher.notice.mock.calls).toEqual([["None is known."]]);
  expect(live.better).toBeUndefined();
});

it("what the server says about itself is told once, also if it applies again after a better shape", async () => {
  await told();
  const overloaded: Notice = { reason: "overloaded", text: "Too much." };
  session.tell(overloaded); // while the better shape is still there
  say(overloaded);
  expect(watcher.notice.mock.calls).toEqual([["Too much."]]);
});

it("how far to look is told with the next update, and again to a new session", async () => {
  await told();
  const solver = () => session.updates.map(({ settings }) => settings?.solver?.search);
  expect(solver()).toEqual([undefined]); // as the server decides
  const search = { effort: 4, leastShare: 0.05 };
  live.lookFor(search);
  live.lookFor(search);
  live.show(changeHandle(one, "tip", { vertices: [0, 1] }));
  expect(solver()).toEqual([undefined, search, undefined]);
  live.close();
  live = new Live(mesh, one, "first", "float32", watcher);
  live.lookFor(search);
  await vi.waitFor(() => expect(solver()).toEqual([undefined, search, undefined, search]));
});

it("the result for a file is that of the minimum that is shown: nothing is searched meanwhile", async () => {
  await told();
  live.lookFor({ effort: 4, show: true });
  live.status = { ...live.status, kind: "live" };
  session.solve.mockImplementation(() => {
    expect(session.updates.at(-1)!.settings!.solver!.search).toEqual({ effort: 0, show: true });
    return Promise.reject(new LpdeformError("unavailable", "Away."));
  });
  await expect(live.solve(1000)).rejects.toThrow("Away.");
  expect(session.updates.at(-1)!.settings!.solver!.search).toEqual({ effort: 4, show: true });
  const count = session.updates.length;
  live.lookFor({ effort: 0 });
  await expect(live.solve(1000)).rejects.toThrow();
  expect(session.updates.length).toBe(count + 1);
});

it("one better shape is offered by what it saves, several by the most that one of them saves", () => {
  expect(betterText([0.0714])).toBe("Take a shape with 7\u00a0% less energy");
  expect(betterText([0.03, 0.0714])).toBe("Take shapes with up to 7\u00a0% less energy");
});

it("what a better shape saves is rounded down", () => {
  expect([0, 0.00012, 0.003, 0.0096, 0.0149, 0.066, 0.07, 0.999].map(percent)).toEqual(
    [0, 0.01, 0.3, 0.9, 1, 6, 7, 99].map((value) => `${value}\u00a0%`),
  );
});

it("beside the gap stands what is known of lower minima, and otherwise that there may be one", () => {
  expect(lowerText(0.0714)).toBe("known, 7\u00a0% less energy");
  expect(lowerText(undefined)).toBe("may exist");
});

it("of many names a line has the first ones", () => {
  expect(someOf(["a", "b"])).toBe("a, b");
  expect(someOf(Array.from({ length: 2005 }, (_, k) => `${k}`))).toBe("0, 1, 2, 3, 4 and 2,000 more");
  expect(someOf(["a".repeat(1e6)])).toHaveLength(81);
});
