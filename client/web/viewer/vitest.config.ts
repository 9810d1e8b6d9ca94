import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    include: ["test/**/*.test.ts"],
    testTimeout: 120_000,
    hookTimeout: 120_000,
    fileParallelism: false,
    pool: "threads", // a process that has ended its file may not be heard any more, and vitest waits for it for ever
    expect: { poll: { timeout: 30_000 } }, // the default of one second may pass during a single look at the page
  },
});
