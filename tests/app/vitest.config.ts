import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vitest/config';

const at = (path: string) => fileURLToPath(new URL(path, import.meta.url));

/** Tests that count frames, measure how soon a page responds, or pause a run that takes a second. */
const ALONE = ['extract', 'frames', 'sculpt', 'worker-package'].map((name) => `${name}.test.ts`);

/** Files of whole figures and lessons, and third-party programs: for `npm run test:all`. */
const LONG = ['**/*.long.test.ts'];
/** Files that need no page, but the built package. */
const UNITS = ['**/*-units.test.ts', '**/units.test.ts'];

const globalSetup = at('setup.ts');

export default defineConfig({
  // As in the app's own build, for tests of its workers' code.
  resolve: {
    alias: [
      { find: /^vesicle(\/index)?$/, replacement: at('../../pkg/index.js') },
      { find: 'vesicle/channel', replacement: at('../../pkg/channel.js') },
      { find: /^vesicle\/(import|gltf|tiff|zarr)$/, replacement: at('../../pkg/$1/index.js') },
    ],
  },
  test: {
    dir: at('.'),
    // Pages are rendered in software on two cores: slow machines need time, and nothing waits for a fixed duration.
    testTimeout: 300_000,
    hookTimeout: 300_000,
    expect: { poll: { timeout: 120_000 } },
    tags: [{ name: 'long', description: 'Too long for every change: for `npm run test:all`.' }],
    projects: [
      {
        extends: true,
        test: { name: 'units', include: UNITS, maxWorkers: 2, sequence: { groupOrder: 0 } },
      },
      // Two files at a time: a page that waits for its worker, or for a test, leaves a core free.
      {
        extends: true,
        test: {
          ...{ name: 'together', exclude: [...ALONE, ...LONG, ...UNITS], globalSetup },
          ...{ maxWorkers: 2, sequence: { groupOrder: 0 } },
        },
      },
      {
        extends: true,
        test: { name: 'alone', include: ALONE, globalSetup, fileParallelism: false, sequence: { groupOrder: 1 } },
      },
      {
        extends: true,
        test: { name: 'long', include: LONG, globalSetup, maxWorkers: 2, sequence: { groupOrder: 2 } },
      },
    ],
  },
});
