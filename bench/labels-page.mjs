// Times the surfaces of a label map in a page: on the main thread in slices of work, in `vesicle/worker`, by our adapter
// for Cornerstone3D, and by the package that Cornerstone3D calls for them, in a worker as there. Runs in Node; what a page
// runs is `window.measureLabels`.
import { readdir, readFile } from 'node:fs/promises';
import { launchChromium } from '../scripts/chromium.mjs';
import { serve } from '../scripts/serve.mjs';
import { at, root } from '../scripts/shell.mjs';

/** Voxels along each side of the label map, its labels, and the radius of the ball that they fill. */
const GIVEN = [256, 20, 120];

/** Cornerstone3D's package for surfaces, if it is installed beside ours: `npm install --no-save @icr/polyseg-wasm`. */
const POLYSEG = 'node_modules/@icr/polyseg-wasm';

const WAYS = {
  slices: 'Vesicle, main thread',
  worker: 'Vesicle, vesicle/worker',
  adapter: 'Vesicle, vesicle/cornerstone',
  polyseg: 'Cornerstone3D, @icr/polyseg-wasm',
};

/** Returns the figures of each way that is installed: times in milliseconds, and memory in bytes. */
export async function measure() {
  const installed = await readdir(at(POLYSEG)).catch(() => undefined);
  const rows = [];
  for (const [way, name] of Object.entries(WAYS)) {
    if (way === 'polyseg' && !installed)
      rows.push({ name, skipped: `not installed: npm install --no-save @icr/polyseg-wasm` });
    else rows.push({ name, ...(await inBrowser(way)) });
  }
  return { size: GIVEN[0], labels: GIVEN[1], rows };
}

/** Measures one way in a browser of its own. */
async function inBrowser(way) {
  const server = await serve(root);
  const browser = await launchChromium();
  try {
    const page = await browser.newPage();
    await page.goto(`${server.address}bench/labels-page.html`);
    await page.waitForFunction(() => 'measureLabels' in window);
    const measured = await page.evaluate(([way, given]) => window.measureLabels(way, ...given), [way, GIVEN]);
    return { ...measured, bytes: await mostMemory(browser) };
  } finally {
    await browser.close();
    await server.close();
  }
}

/** Returns the most memory that a renderer of the browser has had; undefined where the system does not tell. */
async function mostMemory(browser) {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  const renderers = processInfo.filter(({ type }) => type === 'renderer');
  const most = renderers.map(async ({ id }) => {
    const status = await readFile(`/proc/${id}/status`, 'utf8').catch(() => '');
    return 1024 * Number(status.match(/VmHWM:\s*(\d+)/)?.[1] ?? Number.NaN);
  });
  const bytes = Math.max(...(await Promise.all(most)));
  return Number.isNaN(bytes) ? undefined : bytes;
}
