// Times the head CT in Node and in Chromium; prints a table and writes bench.json.
import { readFile, writeFile } from 'node:fs/promises';
import { cpus } from 'node:os';
import { build } from './build.mjs';
import { launchChromium } from './chromium.mjs';
import { serve } from './serve.mjs';
import { setup } from './setup.mjs';
import { at, root, script } from './shell.mjs';

const SCAN = 'www/public/data/visible-human-head-full.nii.gz';
const REPEATS = 3;

async function inNode() {
  const { measure } = await import('../bench/head.mjs');
  return {
    host: `Node ${process.versions.node}`,
    ...(await measure(new Uint8Array(await readFile(at(SCAN))), REPEATS)),
  };
}

async function inChromium() {
  const server = await serve(root);
  const browser = await launchChromium();
  try {
    const page = await browser.newPage();
    await page.goto(`${server.address}bench/index.html`);
    await page.waitForFunction(() => 'measure' in window);
    const measured = await page.evaluate(([scan, repeats]) => window.measure(scan, repeats), [`/${SCAN}`, REPEATS]);
    return { host: `Chromium ${browser.version()}`, ...measured };
  } finally {
    await browser.close();
    await server.close();
  }
}

const seconds = (milliseconds) => `${(milliseconds / 1000).toFixed(2)} s`;

function rows({ host, cubes, model, ratio }) {
  const parts = Object.entries(model.parts).sort(([, a], [, b]) => b - a);
  return [
    [host, '', ''],
    ['  marching cubes', seconds(cubes.milliseconds), `${cubes.vertices} vertices`],
    ['  deformable model', seconds(model.milliseconds), `${model.vertices} vertices, ${model.iterations} iterations`],
    ['  model / marching cubes', ratio.toFixed(1), model.converged ? 'converged' : 'NOT CONVERGED'],
    ['  crossing pairs', String(model.selfIntersections), model.closed ? 'closed' : 'NOT CLOSED'],
    ...parts.map(([part, milliseconds]) => [`    ${part}`, seconds(milliseconds), '']),
  ];
}

function print(results) {
  for (const [what, figure, remark] of results.flatMap(rows)) {
    process.stdout.write(`${what.padEnd(28)}${figure.padStart(10)}  ${remark}\n`);
  }
}

await script(async () => {
  await setup();
  await build();
  const results = [await inNode(), await inChromium()];
  print(results);
  const report = { scan: SCAN, bestOf: REPEATS, processor: cpus()[0]?.model, results };
  await writeFile(at('bench.json'), `${JSON.stringify(report, null, 2)}\n`);
});
