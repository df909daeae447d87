import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vitest/config';

export default defineConfig({
  // As in the app's own build, for tests of what its workers do.
  resolve: { alias: { vesicle: fileURLToPath(new URL('../../pkg/index.js', import.meta.url)) } },
  test: {
    // A software-rendered page on two cores: slow machines need patience, nothing waits for a fixed time.
    testTimeout: 300_000,
    hookTimeout: 300_000,
    expect: { poll: { timeout: 120_000 } },
    // One browser at a time; two would only take the cores from each other.
    fileParallelism: false,
  },
});
