import { defineConfig } from 'vitest/config';

export default defineConfig({
  test: {
    // A software-rendered page on two cores: slow machines need patience, nothing waits for a fixed time.
    testTimeout: 60_000,
    hookTimeout: 60_000,
    expect: { poll: { timeout: 30_000 } },
    // One browser at a time; two would only take the cores from each other.
    fileParallelism: false,
  },
});
