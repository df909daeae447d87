// The pictures of the README and the docs: they show the app as it is.
import { readFile } from 'node:fs/promises';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { PICTURES, SIZE, visibleControls } from '../../scripts/pictures.mjs';
import { at } from '../../scripts/shell.mjs';
import { type App, open, openApp, reach } from './browser';

let app: App;
let recorded: Record<string, string[]>;

beforeAll(async () => {
  recorded = JSON.parse(await readFile(at('docs/pictures.json'), 'utf8'));
  app = await openApp(SIZE, 'bench.html');
});
afterAll(() => app.close());

describe('pictures of the documentation', () => {
  test.each(PICTURES.filter(({ part }) => !part))('$file shows the present controls', async ({ file, hash }) => {
    await open(app, hash.slice(1));
    await reach(app.page, 'done');
    const advice = 'controls have changed since the picture was taken: `npm run pictures`, then look at the pictures';
    expect(await visibleControls(app.page), advice).toEqual(recorded[file]);
  });
});
