import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    include: ["test/**/*.test.ts"],
    testTimeout: 120_000,
    hookTimeout: 120_000,
    fileParallelism: false,
    // Very seldom, Chromium stops drawing a page that goes on answering. layout.test.ts, where this has been seen, opens another one then.
    retry: { count: 1, condition: /the page answers, but drew nothing/ },
    pool: "threads", // a process that has ended its file may not be heard any more, and vitest waits for it for ever
    expect: { poll: { timeout: 30_000 } }, // the default of one second may pass during a single look at the page
  },
});
