// Takes the pictures of the README and the docs from the running app, of labs whose examples are done: `npm run pictures`. The
// controls in each are kept in docs/pictures.json; a test of the app fails when the app has other ones, and pictures are outdated.
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { normalNumber, randomNumbers } from '../bench/random.mjs';
import { launchChromium } from './chromium.mjs';
import { SHAPES, surfaceOf } from './made-shapes.mjs';
import { sampled } from './real-clouds.mjs';
import { serveApp } from './serve.mjs';
import { at, say, script, startedAs } from './shell.mjs';

/** Size of the page in pictures. */
export const SIZE = { width: 1440, height: 900 };
/**
 * Pictures with many small dots are JPEG, a third as large.
 *
 * @type {{ file: string, hash: string, part?: string, prepare?: (page: any) => Promise<void>, type?: string, quality?: number }[]}
 */
export const PICTURES = [
  { file: 'docs/extract.png', hash: '#extract' },
  { file: 'docs/reconstruct.jpg', hash: '#reconstruct', type: 'jpeg', quality: 85 },
  { file: 'docs/track.jpg', hash: '#track', type: 'jpeg', quality: 85 },
  { file: 'docs/sculpt.jpg', hash: '#sculpt', type: 'jpeg', quality: 85 },
  { file: 'docs/segment.jpg', hash: '#segment', type: 'jpeg', quality: 85 },
  // The 3D view alone, with uncovered parts marked: for the paper's model, and for the defaults.
  {
    ...{ file: 'docs/coverage-paper.jpg', type: 'jpeg', quality: 85, part: '.view', prepare: measureCoverage },
    hash: '#extract?start=enclosing&p.adaptivity=0&p.integrator=euler&v=2',
  },
  {
    ...{ file: 'docs/coverage-default.jpg', type: 'jpeg', quality: 85, part: '.view', prepare: measureCoverage },
    hash: '#extract',
  },
  // Noisy points with the paper's settings and with those chosen from them; a chamber with its muscles outside, and inside.
  {
    ...{ file: 'docs/noise-paper.jpg', type: 'jpeg', quality: 85, part: '.view' },
    ...{ hash: '#reconstruct?example=two-balls', prepare: (page) => dropFor(page, `${PAPER_LINK}&v=2`, knot()) },
  },
  {
    ...{ file: 'docs/noise-default.jpg', type: 'jpeg', quality: 85, part: '.view' },
    ...{ hash: '#reconstruct?example=two-balls', prepare: (page) => dropFor(page, `${KNOT_LINK}&v=2`, knot()) },
  },
  {
    ...{ file: 'docs/cavity-open.jpg', type: 'jpeg', quality: 85, part: '.view' },
    hash: '#track?example=thick-slices',
  },
  {
    ...{ file: 'docs/cavity-closed.jpg', type: 'jpeg', quality: 85, part: '.view' },
    hash: '#track?example=thick-slices&cavity=closed',
  },
  // Failures of the methods at the defaults, and a mesh of the user's before and after.
  {
    ...{ file: 'docs/fails-extract.jpg', type: 'jpeg', quality: 85, part: '.view' },
    ...{ hash: '#extract?example=linked-rings&v=2', prepare: (page) => dropData(page, plate()) },
  },
  {
    ...{ file: 'docs/fails-reconstruct.jpg', type: 'jpeg', quality: 85, part: '.view' },
    ...{ hash: '#reconstruct?example=two-balls', prepare: (page) => dropData(page, star()) },
  },
  {
    ...{ file: 'docs/fails-track.jpg', type: 'jpeg', quality: 85, part: '.view' },
    hash: '#track?example=ventricle&box=6,6,6,44,64,64',
  },
  {
    ...{ file: 'docs/own-mesh.jpg', type: 'jpeg', quality: 85, part: '.view' },
    ...{ hash: '#sculpt?example=globe', prepare: (page) => dropData(page, bust()) },
  },
  {
    ...{ file: 'docs/fails-sculpt.jpg', type: 'jpeg', quality: 85, part: '.view' },
    ...{ hash: '#sculpt?example=globe', prepare: stopEllipsoid },
  },
];

/** Link to points that are yet to be dropped, and the same with the paper's settings. */
const KNOT_LINK = '#reconstruct?file=knot.xyz';
const PAPER_LINK = `${KNOT_LINK}&p.delta=5&p.lambdaSurface=0.001&p.lambdaExterior=2&p.sides=outside`;

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

async function measureCoverage(page) {
  await page.getByRole('button', { name: 'Measure coverage' }).click();
  await page.getByText('Recall').waitFor({ timeout: 120_000 });
}

/** Returns two balls with an oblique plate between them that is .8 voxels thick, as a NIfTI file. */
async function plate() {
  const { default: init, Volume } = await import('../pkg/index.js');
  await init();
  const size = 64;
  const data = new Uint8Array(size ** 3);
  // Coverage of the voxel by the object, for an edge that is a voxel wide.
  const share = (distance) => Math.min(1, Math.max(0, 0.5 - distance));
  for (let z = 0, at = 0; z < size; z++)
    for (let y = 0; y < size; y++)
      for (let x = 0; x < size; x++, at++) {
        const balls = [16, 48].map((middle) => Math.hypot(x - middle, y - 32, z - middle) - 9);
        const wall = Math.max(
          Math.abs(0.8 * x - 0.6 * z - 6.4 - 0.13 * (y - 32)) - 0.4,
          Math.hypot(x - 32, y - 32, z - 32) - 24,
        );
        data[at] = Math.round(200 * Math.max(...balls.map(share), share(wall)));
      }
  return { name: 'plate.nii', bytes: new Volume({ data, dims: [size, size, size] }).toNifti() };
}

/** Returns points on a star of blades about as thin as their noise. */
async function star() {
  const library = await import('../pkg/index.js');
  await library.default();
  const mesh = surfaceOf(library, SHAPES.star());
  const { points } = sampled(mesh, { noise: 0.01, seed: 2 });
  mesh.free();
  const lines = Array.from({ length: points.length / 3 }, (_, i) => points.subarray(3 * i, 3 * i + 3).join(' '));
  return { name: 'star.xyz', bytes: new TextEncoder().encode(lines.join('\n')) };
}

/** Returns points on a tube along a trefoil knot, with noise of a tenth of its diameter. */
async function knot() {
  const random = randomNumbers(5);
  const along = (t) => [Math.sin(t) + 2 * Math.sin(2 * t), Math.cos(t) - 2 * Math.cos(2 * t), -Math.sin(3 * t)];
  const point = () => {
    const t = 2 * Math.PI * random();
    const [middle, ahead] = [along(t), along(t + 1e-3)];
    const tangent = ahead.map((x, k) => x - middle[k]);
    // A direction at random, without its part along the tube.
    const free = [0, 1, 2].map(() => normalNumber(random));
    const dot = (u, v) => u.reduce((sum, x, k) => sum + x * v[k], 0);
    const away = free.map((x, k) => x - (dot(free, tangent) / dot(tangent, tangent)) * tangent[k]);
    const length = Math.hypot(...away);
    return middle.map((x, k) => x + (0.45 * away[k]) / length + 0.09 * normalNumber(random)).join(' ');
  };
  const text = Array.from({ length: 5000 }, point).join('\n');
  return { name: 'knot.xyz', bytes: new TextEncoder().encode(text) };
}

async function bust() {
  return { name: 'bust.ply', bytes: await readFile(at('www/public/data/nefertiti.ply')) };
}

/** Opens data as a file that is dropped on the page, and waits until it is done. */
async function dropData(page, data) {
  const { name, bytes } = await data;
  const base64 = Buffer.from(bytes).toString('base64');
  await page.evaluate(
    ({ name, base64 }) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([Uint8Array.from(atob(base64), (one) => one.charCodeAt(0))], name));
      for (const type of ['dragover', 'drop'])
        window.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
    },
    { name, base64 },
  );
  await page.waitForFunction((name) => document.querySelector('.facts')?.textContent?.includes(name), name);
  await page.waitForSelector('[data-state=done]', { timeout: 120_000 });
}

/** Follows a link that waits for data, and drops these. */
async function dropFor(page, hash, data) {
  await page.evaluate((hash) => location.assign(hash), hash);
  await dropData(page, data);
}

/** Opens a mesh, and moves an ellipsoid further than its surface can follow. */
async function stopEllipsoid(page) {
  await dropData(page, bust());
  await page.click('[data-ellipsoid="1"]');
  const field = page.locator('.numbers input').first();
  await field.fill(String(Number(await field.inputValue()) + 200));
  await field.press('Enter');
  await page.getByText('handle-stopped').or(page.locator('.warnings li')).first().waitFor({ timeout: 120_000 });
  await page.waitForSelector('[data-state=done]', { timeout: 120_000 });
}

/** Waits for the example to be done, then for the frame that shows it, and takes the picture. Returns the controls in it. */
async function shoot(page, address, { hash, file, part, prepare, ...format }) {
  await page.goto(address + hash);
  await page.waitForSelector('[data-state=done]', { timeout: 120_000 });
  await prepare?.(page);
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  await (part ? page.locator(part) : page).screenshot({ path: at(file), ...format });
  say('picture', at(file));
  return part ? [] : visibleControls(page);
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
