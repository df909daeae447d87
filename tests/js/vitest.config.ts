import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vitest/config';

export default defineConfig({
  test: {
    dir: fileURLToPath(new URL('.', import.meta.url)),
    // A busy machine is slow, not wrong.
    testTimeout: 300_000,
    tags: [{ name: 'long', description: 'Too long for every change: for `npm run test:all`.' }],
  },
});
