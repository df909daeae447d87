// The package itself in Chromium, without the app.
import { expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { SPONGE_BITS, spongeBits } from '../js/sponge';
import { launch } from './browser';

test('two hundred steps give the same bits as the native core', async () => {
  const server = await serve(at('pkg'), 0);
  const browser = await launch();
  try {
    const page = await browser.newPage();
    await page.goto(`${server.address}package.json`);
    const content = `
      import * as vesicle from '/index.js';
      await vesicle.default();
      document.title = await (${spongeBits})(vesicle);`;
    await page.addScriptTag({ type: 'module', content });
    await expect.poll(() => page.title()).toBe(SPONGE_BITS);
  } finally {
    await browser.close();
    await server.close();
  }
});
