// The package in a worker, in Chromium: from its own files, from another origin, and bundled.
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createServer, type ServerResponse } from 'node:http';
import type { AddressInfo } from 'node:net';
import { tmpdir } from 'node:os';
import { extname, join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import { build } from 'vite';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { SPONGE_BITS, spongeBits } from '../js/sponge';
import { launch } from './browser';
import { LONG } from './long';

let browser: Browser;
let server: Awaited<ReturnType<typeof serve>>;

beforeAll(async () => {
  browser = await launch();
  server = await serve(at('pkg'), 0);
});

afterAll(async () => {
  await browser.close();
  await server.close();
});

/** Runs a module in a page at an address; returns the JSON that it leaves in the title. */
async function told(address: string, content: string): Promise<unknown> {
  const page = await browser.newPage();
  try {
    await page.goto(address);
    await page.addScriptTag({ type: 'module', content: caught(content) });
    return await title(page);
  } finally {
    await page.close();
  }
}

/** Wraps a module: `tell` writes the title, and so does a thrown error. */
const caught = (content: string) => `
  const tell = (value) => { document.title = JSON.stringify(value); };
  try { ${content} } catch (error) { tell(String(error)); }`;

async function title(page: Page): Promise<unknown> {
  await expect.poll(() => page.title()).not.toBe('');
  return JSON.parse(await page.title());
}

const LIBRARY = `const library = await import('/worker.js'); const { default: init, Mesh, Volume, DeformableModel } = library;`;

test('two hundred steps give the same bits as the native core, and the page stays responsive', async () => {
  const content = `${LIBRARY}
    await init();
    let frames = 0;
    const count = () => { frames += 1; requestAnimationFrame(count); };
    requestAnimationFrame(count);
    let during = 0;
    class Watched extends DeformableModel {
      // The two hundred steps at once: in the page itself there would be no frame.
      async step(iterations) {
        const before = frames;
        const report = await super.step(iterations);
        during = Math.max(during, frames - before);
        return report;
      }
    }
    tell([await (${spongeBits})({ Volume, DeformableModel: Watched }), during > 2]);`;
  expect(await told(`${server.address}package.json`, content)).toEqual([SPONGE_BITS, true]);
});

test('a run is aborted from the page, and buffers are transferred', async () => {
  const content = `${LIBRARY}
    await init({ module: 'vesicle_bg.wasm' });
    const data = Uint8Array.from({ length: 8000 }, (_, i) => (i % 20 > 5 && i % 20 < 15 ? 100 : 0));
    const volume = new Volume(library.transfer({ data, dims: [20, 20, 20] }));
    const params = { iso: 50, isoForce: -1, energyTolerance: 1e-12, maxMove: 0.01, timeStep: 0.01 };
    const model = new DeformableModel({ volume, start: { seeds: Float32Array.of(9, 9, 9), radius: 2 }, params });
    const abort = new AbortController();
    const onStep = ({ iteration }) => { if (iteration === 3) abort.abort('enough'); };
    const reason = await model.run({ signal: abort.signal, onStep }).catch((why) => why);
    const { iteration, done } = await model.step();
    const out = await model.mesh.arrays();
    const { vertices } = await model.mesh.copyTo(out);
    const { code, message } = await model.setParams({ bogus: 1 }).catch((error) => error);
    tell([data.length, reason, iteration > 3, done, 3 * vertices === out.positions.length, code, message.slice(0, 5)]);`;
  const expected = [0, 'enough', true, false, true, 'invalid-argument', 'bogus'];
  expect(await told(`${server.address}package.json`, content)).toEqual(expected);
});

test('a worker made by hand works as well; a missing script is reported', async () => {
  const content = `${LIBRARY}
    const make = (name) => new Worker(name, { type: 'module' });
    const failed = await init({ worker: make('/nowhere.js') }).catch(({ message }) => message);
    await init({ worker: make('/worker-host.js') });
    tell([failed, (await (await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })).info()).genus]);`;
  const [failed, genus] = (await told(`${server.address}package.json`, content)) as [string, number];
  expect(failed).toMatch(/^init: the worker could not be started/);
  expect(genus).toBe(0);
});

/** Serves the package on an origin of its own, with the given headers and additional files. */
async function publish(headers: Record<string, string>, files: Record<string, string> = {}) {
  const types: Record<string, string> = { '.js': 'text/javascript', '.html': 'text/html', '.wasm': 'application/wasm' };
  const answer = async (path: string, response: ServerResponse) => {
    const body = files[path] ?? (await readFile(at('pkg', path)));
    response.writeHead(200, { 'Content-Type': types[extname(path)] ?? 'text/plain', ...headers }).end(body);
  };
  const server = createServer((request, response) => {
    answer(request.url ?? '', response).catch(() => response.writeHead(404).end());
  });
  await new Promise<void>((done) => server.listen(0, '127.0.0.1', done));
  const { port } = server.address() as AddressInfo;
  return { address: `http://127.0.0.1:${port}/`, close: () => server.close() };
}

test('a strict content security policy is sufficient', async () => {
  const headers = {
    'Content-Security-Policy': `default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'`,
  };
  const script = `${LIBRARY} await init(); tell((await (await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })).info()).genus);`;
  const page = '<script type="module" src="/page.js"></script>';
  const strict = await publish(headers, { '/page.html': page, '/page.js': caught(script) });
  const tab = await browser.newPage();
  try {
    await tab.goto(`${strict.address}page.html`);
    expect(await title(tab)).toBe(0);
  } finally {
    await tab.close();
    strict.close();
  }
});

test("from another origin the worker starts through a script of the page's own", async () => {
  const network = await publish({ 'Access-Control-Allow-Origin': '*' });
  try {
    const content = `
      const { default: init, Mesh } = await import('${network.address}worker.js');
      await init();
      tell((await (await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })).info()).genus);`;
    expect(await told(`${server.address}package.json`, content)).toBe(0);
  } finally {
    network.close();
  }
});

test('Vite bundles the worker and the module in it', LONG, async () => {
  const folder = await mkdtemp(join(tmpdir(), 'vesicle-'));
  const script = `
    import init, { Mesh } from 'vesicle/worker';
    const tell = (value) => { document.title = JSON.stringify(value); };
    const genus = async () => (await (await Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })).info()).genus;
    init().then(genus).then(tell, (error) => tell(String(error)));`;
  await writeFile(join(folder, 'index.html'), `<script type="module" src="./main.js"></script>`);
  await writeFile(join(folder, 'main.js'), script);
  const alias = { 'vesicle/worker': at('pkg/worker.js') };
  await build({ root: folder, logLevel: 'error', configFile: false, resolve: { alias } });
  const built = await serve(join(folder, 'dist'), 0);
  const page = await browser.newPage();
  try {
    const fetched: string[] = [];
    page.on('request', (request) => fetched.push(new URL(request.url()).pathname));
    await page.goto(built.address);
    expect(await title(page)).toBe(0);
    // All files are from the bundle, which has names of its own.
    expect(fetched.filter((path) => /\.(js|wasm)$/.test(path)).every((path) => path.startsWith('/assets/'))).toBe(true);
  } finally {
    await page.close();
    await built.close();
    await rm(folder, { recursive: true });
  }
});
