import { defineConfig } from 'vitest/config';

const factor = Number(process.env.MBCOSIM_TIME_FACTOR ?? 1);

/** The page in a browser, before a real daemon: one file after the other, since each starts a browser. */
export default defineConfig({
  test: {
    include: ['e2e/**/*.test.ts'],
    fileParallelism: false,
    testTimeout: 60_000 * factor,
    hookTimeout: 60_000 * factor,
  },
});
