// Takes the pictures of the README and the docs from the running app, of labs whose examples are done: `npm run pictures`. The
// controls in each are kept in docs/pictures.json; a test of the app fails when the app has other ones, and pictures are outdated.
import { mkdir, writeFile } from 'node:fs/promises';
import { launchChromium } from './chromium.mjs';
import { serveApp } from './serve.mjs';
import { at, say, script, startedAs } from './shell.mjs';

/** Size of the page in pictures. */
export const SIZE = { width: 1440, height: 900 };
/** Pictures with many small dots are JPEG, a third as large. */
export const PICTURES = [
  { file: 'docs/extract.png', hash: '#extract' },
  { file: 'docs/reconstruct.jpg', hash: '#reconstruct', type: 'jpeg', quality: 85 },
  { file: 'docs/track.jpg', hash: '#track', type: 'jpeg', quality: 85 },
  { file: 'docs/sculpt.jpg', hash: '#sculpt', type: 'jpeg', quality: 85 },
  { file: 'docs/segment.jpg', hash: '#segment', type: 'jpeg', quality: 85 },
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

/** Names of the controls and headings that a picture of the page shows, from top to bottom, without numbers. */
export function visibleControls(page) {
  return page.evaluate(() => {
    const all = [...document.querySelectorAll('h1, h2, h3, a, button, summary, label, legend')];
    const isShown = (one) => {
      const { top, bottom, width } = one.getBoundingClientRect();
      return one.checkVisibility() && width > 1 && top >= 0 && bottom <= innerHeight;
    };
    const name = (one) => (one.getAttribute('aria-label') ?? one.textContent ?? '').replace(/\d[\d.,]*/g, '').trim();
    return all.filter(isShown).map(name).filter(Boolean);
  });
}

/** Waits for the example to be done, then for the frame that shows it, and takes the picture. Returns the controls in it. */
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
  return coverage ? [] : visibleControls(page);
}

async function takePictures() {
  await mkdir(at('docs'), { recursive: true });
  const server = await serveApp(at('dist'), 0);
  const browser = await launchChromium();
  try {
    const controls = {};
    for (const picture of PICTURES) {
      const found = await shoot(await browser.newPage({ viewport: SIZE }), server.address, picture);
      if (found.length > 0) controls[picture.file] = found;
    }
    await writeFile(at('docs/pictures.json'), `${JSON.stringify(controls, null, 2)}\n`);
  } finally {
    await browser.close();
    await server.close();
  }
}

if (startedAs(import.meta.url)) await script(takePictures);
