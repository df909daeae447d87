/** The policies that the built app is under: in its pages, from the local server, and in docs/security.md. */
import { readdir, readFile } from 'node:fs/promises';
import { basename, join } from 'node:path';
import { expect, test } from 'vitest';
import { APP_POLICY, DOCS_POLICY, EXTRACT_WORKER_POLICY, WORKER_POLICY } from '../../scripts/policy.mjs';
import { serveApp } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { ball, dracoGlb, dracoStream, meshoptGlb } from '../js/made-gltf';
import { drop, LABS, launch, open, openApp, openPage, QUICK, reach, recordStates } from './browser';

const DIST = at('dist');
const POLICIES = [APP_POLICY, WORKER_POLICY, EXTRACT_WORKER_POLICY, DOCS_POLICY];

const filesOf = async (ending: string) =>
  (await readdir(DIST, { recursive: true }))
    .map((name) => name.replaceAll('\\', '/'))
    .filter((name) => name.endsWith(ending));

test('every page has the policy that the server sends with it', async () => {
  const server = await serveApp(DIST);
  const pages = await filesOf('.html');
  expect(pages.length).toBeGreaterThan(100);
  for (const page of pages) {
    const response = await fetch(server.address + page);
    const [, inPage = ''] =
      (await response.text()).match(/<meta http-equiv="Content-Security-Policy" content="([^"]*)"/) ?? [];
    const sent = response.headers.get('Content-Security-Policy');
    expect([page, inPage.replaceAll('&#39;', "'")]).toEqual([page, sent]);
    expect([page, sent]).toEqual([page, page.startsWith('docs/') ? DOCS_POLICY : APP_POLICY]);
  }
  await server.close();
});

test('one worker alone may read from other servers', async () => {
  const server = await serveApp(DIST);
  const policies = new Map<string, string | null>();
  for (const script of await filesOf('.js'))
    policies.set(script, (await fetch(server.address + script)).headers.get('Content-Security-Policy'));
  const having = (policy: string) => [...policies.keys()].filter((script) => policies.get(script) === policy);
  expect(having(EXTRACT_WORKER_POLICY)).toEqual([expect.stringMatching(/^assets\/extract-worker-[\w-]{8}\.js$/)]);
  expect(POLICIES.filter((policy) => /https?:|'unsafe-eval'/.test(policy))).toEqual([EXTRACT_WORKER_POLICY]);
  expect(POLICIES.join()).not.toMatch(/\*\.|script-src [^;]*unsafe-inline/);
  // All that a page starts as a worker.
  const started = new Set<string>();
  for (const script of policies.keys()) {
    const text = await readFile(join(DIST, script), 'utf8');
    for (const [, name = ''] of text.matchAll(/new Worker\([^`]{0,30}`([\w-]+\.js)`/g)) started.add(`assets/${name}`);
  }
  expect(started.size).toBeGreaterThan(7);
  expect([...started, 'offline.js'].sort()).toEqual(
    [...having(WORKER_POLICY), ...having(EXTRACT_WORKER_POLICY)].sort(),
  );
  await server.close();
});

test('the examples in docs/security.md have these policies', async () => {
  const text = await readFile(at('docs/security.md'), 'utf8');
  const examples = [...text.matchAll(/^```text\n(.*?)^```/gms)];
  expect(examples.length).toBe(3);
  for (const [example] of examples) {
    const policies = new Set([...example.matchAll(/default-src [^"\n]*/g)].map(String));
    expect(POLICIES).toEqual(expect.arrayContaining([...policies]));
    expect([...policies]).toEqual(expect.arrayContaining([WORKER_POLICY, EXTRACT_WORKER_POLICY]));
  }
});

/** Returns the kind of an answer from an address, which needs no permission of its server, or the error. */
const reading = (url: string) => fetch(url, { mode: 'no-cors' }).then(({ type }) => type, String);

const REFUSED = 'TypeError: Failed to fetch';

test('in Chromium, neither a page nor the workers of the other labs reach another server', async () => {
  const app = await openApp();
  const other = await serveApp(DIST);
  for (const lab of LABS) {
    await open(app, QUICK[lab]);
    await reach(app.page, 'done', 'running');
    expect(app.complaints.splice(0)).toEqual([]);
    expect(await app.page.evaluate(reading, other.address)).toBe(REFUSED);
    const answers = await Promise.all(app.page.workers().map((worker) => worker.evaluate(reading, other.address)));
    expect([lab, answers]).toEqual([lab, [lab === 'extract' ? 'opaque' : REFUSED]]);
    app.complaints.splice(0);
  }
  await app.close();
  await other.close();
});

/** Files that are decoded by each of the decoders. */
const ENCODED = [
  ...['htj2k', 'jpeg', 'jpeg-2000', 'jpeg-lossless', 'jpeg-ls'].map((name) => `dicom/${name}.dcm`),
  ...['jpeg', 'u1-be-zstd-2'].map((name) => `tiff/${name}.tif`),
  ...['v2-blosc-tczyx', 'v3-zstd-zyx'].map((name) => `zarr/${name}.zip`),
];

test('all decoders work under the policies', async () => {
  const app = await openApp();
  await open(app, QUICK.extract);
  await reach(app.page, 'done');
  for (const file of ENCODED) {
    const states = await recordStates(app.page);
    await drop(app.page, [{ name: basename(file), bytes: await readFile(at('tests/data', file)) }]);
    const opened = async () => (await states()).includes('running') || app.page.textContent('.banner');
    await expect.poll(opened, { message: file }).toBe(true);
  }
  await app.close();
});

test('the decoder of Draco works under the policies', async () => {
  const app = await openApp();
  await open(app, QUICK.sculpt);
  await reach(app.page, 'done');
  await drop(app.page, [{ name: 'ball.glb', bytes: dracoGlb([dracoStream(ball())]) }]);
  await expect.poll(() => app.page.textContent('.facts dd')).toMatch(/^ball\.glb/);
  await reach(app.page, 'done');
  await drop(app.page, [{ name: 'packed.glb', bytes: await meshoptGlb(ball()) }]);
  await expect.poll(() => app.page.textContent('.facts dd')).toMatch(/^packed\.glb/);
  expect(app.complaints.splice(0)).toEqual([]);
  await app.close();
});

test('the documentation works under its policy, search and theme included', async () => {
  const server = await serveApp(DIST);
  const browser = await launch();
  const complaints: string[] = [];
  const page = await openPage(browser, complaints);
  const pages = await filesOf('.html');
  const folders = new Set(pages.map((name) => name.replace(/[^/]*$/, '')));
  // One page of each kind, and all that were written by hand.
  for (const name of pages.filter(
    (name) => name.startsWith('docs/documents/') || folders.delete(name.replace(/[^/]*$/, '')),
  ))
    if (name.startsWith('docs/')) await page.goto(server.address + name);
  expect(await page.evaluate(() => document.documentElement.dataset.theme)).toBe('os');
  await page.click('#tsd-search-trigger');
  await page.keyboard.type('DeformableModel');
  await page.locator('#tsd-search-results li').first().waitFor();
  expect(complaints).toEqual([]);
  await browser.close();
  await server.close();
});
