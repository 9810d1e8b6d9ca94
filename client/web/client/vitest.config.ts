import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    include: ["test/**/*.test.ts"],
    pool: "threads", // a process that has ended its file may not be heard any more, and vitest waits for it for ever
    testTimeout: 30_000,
    hookTimeout: 120_000,
  },
});
