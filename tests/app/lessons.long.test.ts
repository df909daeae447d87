/** The lessons with runs at full size, each to its end; `lesson-answers.test.ts` does their runs of some seconds. */
import { afterAll, beforeAll, expect, test } from 'vitest';
import { type App, openApp } from './browser';
import { doLesson } from './lesson-steps';

let app: App;

beforeAll(async () => {
  app = await openApp({ width: 1400, height: 900 });
});
afterAll(() => app.close());

test.each(['coarse-to-fine', 'forces', 'regularisation', 'heart', 'topology'])(
  '%s is ticked step by step with its settings',
  { timeout: 900_000 },
  async (id) => {
    await doLesson(app, id);
    expect(app.complaints).toEqual([]);
  },
);
