import { expect, it, vi } from "vitest";
import { Live, type LiveWatcher } from "../src/link/live.js";
import { emptyDocument } from "../src/model/document.js";
import { shapeKinds } from "../src/model/shapes.js";

const opened = vi.hoisted(() => ({ count: 0 }));

/** Sessions whose frames fail with an error that is not the library's. */
vi.mock("lpdeform-client", async (original) => ({
  ...(await original<typeof import("lpdeform-client")>()),
  openSession: async () => {
    ++opened.count;
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

it("a session whose frames the page cannot take is opened again, and the status says why", async () => {
  const { mesh } = shapeKinds[0]!.make("coarse");
  const titles: string[] = [];
  const watcher = { status: ({ title }) => titles.push(title), report: () => undefined } as Partial<LiveWatcher>;
  const live = new Live(mesh, emptyDocument, "first", "compressed", watcher as LiveWatcher);
  await vi.waitFor(() => expect(opened.count).toBeGreaterThan(1), 5000);
  expect(titles).toContain("This page failed with a frame");
  live.close();
});
