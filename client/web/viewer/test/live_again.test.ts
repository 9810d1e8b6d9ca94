import { expect, it, vi } from "vitest";
import { Live, type LiveWatcher } from "../src/link/live.js";
import type { Status } from "../src/link/status.js";
import { emptyDocument } from "../src/model/document.js";
import { shapeKinds } from "../src/model/shapes.js";

const opened = vi.hoisted(() => ({ times: [] as number[] }));

/** Sessions whose frames fail with an error that is not the library's. */
vi.mock("lpdeform-client", async (original) => ({
  ...(await original<typeof import("lpdeform-client")>()),
  openSession: async () => {
    opened.times.push(performance.now());
    return {
      on: () => undefined,
      update: () => 1,
      close: async () => undefined,
      async *[Symbol.asyncIterator]() {
        throw new RangeError("Array buffer allocation failed");
      },
    };
  },
}));

it("sessions whose frames the page cannot take are opened again, ever more seldom, until it says what fails and stops", async () => {
  vi.useFakeTimers();
  const { mesh } = shapeKinds[0]!.make("coarse");
  const told: Status[] = [];
  const watcher = { status: (status) => told.push(status), report: () => undefined } as Partial<LiveWatcher>;
  const live = new Live(mesh, emptyDocument, "first", "compressed", watcher as LiveWatcher);
  const after = (milliseconds: number) => vi.advanceTimersByTimeAsync(milliseconds);
  const tries = 8;
  await after(600_000);
  expect(opened.times).toHaveLength(tries);
  const pauses = opened.times.slice(1).map((time, k) => time - opened.times[k]!);
  pauses.forEach((pause, k) => expect(pause).toBeGreaterThanOrEqual(Math.min(25 * 2 ** k, 1000)));
  expect(told.map(({ title }) => title)).toContain("This page failed with a frame");
  const end = { kind: "refused", title: "This page fails with every frame", canTryAgain: true };
  expect(live.status).toMatchObject({ ...end, text: "RangeError: Array buffer allocation failed." });

  live.tryAgain();
  live.tryAgain(); // pressed twice
  await after(600_000);
  expect(opened.times).toHaveLength(2 * tries);
  expect(live.status).toMatchObject(end);
  live.close();
  vi.useRealTimers();
});
