// Takes docs/extract.png, the README's picture, from the running app: the built-in example when it is done.
import { mkdir } from 'node:fs/promises';
import { launchChromium } from './chromium.mjs';
import { serve } from './serve.mjs';
import { at, say, script } from './shell.mjs';

const SIZE = { width: 1440, height: 900 };

/** Waits for the example to be done, then for the frame that shows it. */
async function shoot(page, address, file) {
  await page.goto(address);
  await page.waitForSelector('[data-state=done]', { timeout: 120_000 });
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  await page.screenshot({ path: file });
}

await script(async () => {
  const file = at('docs/extract.png');
  await mkdir(at('docs'), { recursive: true });
  const server = await serve(at('dist'), 0);
  const browser = await launchChromium();
  try {
    await shoot(await browser.newPage({ viewport: SIZE }), server.address, file);
    say('picture', file);
  } finally {
    await browser.close();
    await server.close();
  }
});
