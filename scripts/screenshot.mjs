// Takes the pictures of the README and the docs from the running app, of labs whose examples are done.
import { mkdir } from 'node:fs/promises';
import { launchChromium } from './chromium.mjs';
import { serve } from './serve.mjs';
import { at, say, script } from './shell.mjs';

const SIZE = { width: 1440, height: 900 };
/** Pictures with many small dots are JPEG, a third as large. */
const PICTURES = [
  { file: 'docs/extract.png', hash: '#extract' },
  { file: 'docs/reconstruct.jpg', hash: '#reconstruct', type: 'jpeg', quality: 85 },
  { file: 'docs/track.jpg', hash: '#track', type: 'jpeg', quality: 85 },
  { file: 'docs/sculpt.jpg', hash: '#sculpt', type: 'jpeg', quality: 85 },
  // The 3D view alone, with uncovered parts marked: for the paper's model, and for the defaults.
  {
    file: 'docs/coverage-paper.jpg',
    hash: '#extract?start=enclosing&p.adaptivity=0&p.integrator=euler&v=2',
    coverage: true,
    type: 'jpeg',
    quality: 85,
  },
  { file: 'docs/coverage-default.jpg', hash: '#extract', coverage: true, type: 'jpeg', quality: 85 },
];

/** Waits for the example to be done, then for the frame that shows it, and takes the picture. */
async function shoot(page, address, { hash, file, coverage = false, ...format }) {
  await page.goto(address + hash);
  await page.waitForSelector('[data-state=done]', { timeout: 120_000 });
  if (coverage) {
    await page.getByRole('button', { name: 'Measure coverage' }).click();
    await page.getByText('Recall').waitFor({ timeout: 120_000 });
  }
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  await (coverage ? page.locator('.view') : page).screenshot({ path: at(file), ...format });
  say('picture', at(file));
}

await script(async () => {
  await mkdir(at('docs'), { recursive: true });
  const server = await serve(at('dist'), 0);
  const browser = await launchChromium();
  try {
    const [wanted = ''] = process.argv.slice(2);
    for (const picture of PICTURES.filter(({ file }) => file.includes(wanted)))
      await shoot(await browser.newPage({ viewport: SIZE }), server.address, picture);
  } finally {
    await browser.close();
    await server.close();
  }
});
