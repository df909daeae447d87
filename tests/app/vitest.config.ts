import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vitest/config';

export default defineConfig({
  // As in the app's own build, for tests of its workers' code.
  resolve: { alias: { vesicle: fileURLToPath(new URL('../../pkg/index.js', import.meta.url)) } },
  test: {
    // Pages are rendered in software on two cores: slow machines need time, and nothing waits for a fixed duration.
    testTimeout: 300_000,
    hookTimeout: 300_000,
    expect: { poll: { timeout: 120_000 } },
    // One browser at a time; two would compete for the cores.
    fileParallelism: false,
  },
});
