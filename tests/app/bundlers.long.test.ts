// The package as it would be published, used with bundlers and in plain pages.
import { mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser } from 'playwright-core';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';
import { at, must } from '../../scripts/shell.mjs';
import { SPONGE_BITS, spongeBits } from '../js/sponge';
import { launch, openPage } from './browser';

let browser: Browser;
/** A project with the packed package installed, and nothing else. */
let project = '';

const main = (from: string, options = '') => `
  import * as vesicle from '${from}';
  await vesicle.default(${options});
  document.title = await (${spongeBits})(vesicle);`;

const page = (script: string, policy = '') => `<!doctype html>
<html lang="en">
  <head>
    <meta charset="utf-8">${policy && `<meta http-equiv="Content-Security-Policy" content="${policy}">`}
    <link rel="icon" href="data:,">
  </head>
  <body>${script}</body>
</html>`;

const write = (path: string, text: string) => writeFile(join(project, path), text);

beforeAll(async () => {
  project = await mkdtemp(join(tmpdir(), 'vesicle-bundled-'));
  browser = await launch();
  const packed = await must('npm', ['pack', '--silent', '--pack-destination', project, at('pkg')]);
  await write('package.json', '{ "name": "a-page", "private": true, "type": "module" }');
  const install = [
    'install',
    '--offline',
    '--no-audit',
    '--no-fund',
    join(project, packed.trim().split('\n').at(-1) ?? ''),
  ];
  await must('npm', install, { cwd: project });
  await mkdir(join(project, 'dist'));
});
afterAll(async () => {
  await browser.close();
  await rm(project, { recursive: true, force: true });
});

/** Opens a page in `folder` of the project, at `address`, and asserts its title; console errors fail. */
async function titleOf(folder: string, address = ''): Promise<void> {
  const server = await serve(join(project, folder), 0);
  const complaints: string[] = [];
  const opened = await openPage(browser, complaints);
  try {
    await opened.goto(server.address + address);
    await expect.poll(async () => complaints[0] ?? (await opened.title())).toBe(SPONGE_BITS);
    expect(complaints).toEqual([]);
  } finally {
    await opened.close();
    await server.close();
  }
}

/** Entry points with the deformable model, which the pages run. */
const ENTRIES = ['vesicle', 'vesicle/deformable'];

test.each(ENTRIES)('Vite, %s', async (entry) => {
  await write('index.html', page('<script type="module" src="./main.js"></script>'));
  await write('main.js', main(entry));
  const { build } = await import('vite');
  const target = { target: 'es2022', outDir: join(project, 'dist/vite') };
  await build({ root: project, configFile: false, logLevel: 'error', build: target });
  await titleOf('dist/vite');
});

test.each(ENTRIES)('webpack, %s', async (entry) => {
  await write('main.js', main(entry));
  const { default: webpack } = await import('webpack');
  const output = { path: join(project, 'dist/webpack'), publicPath: '', filename: 'main.js' };
  const compiler = webpack({
    ...{
      context: project,
      entry: './main.js',
      mode: 'production',
      target: 'web',
      output,
      performance: { hints: false },
    },
  });
  const stats = await new Promise<{ compilation: { errors: Error[]; warnings: Error[] } }>((resolve, reject) =>
    compiler?.run((error, stats) => (stats ? resolve(stats) : reject(error))),
  );
  expect(stats.compilation.errors).toEqual([]);
  expect(stats.compilation.warnings).toEqual([]);
  await write('dist/webpack/index.html', page('<script type="module" src="./main.js"></script>'));
  await titleOf('dist/webpack');
});

test('esbuild, with the address of the module', async () => {
  await write('main.js', main('vesicle', `{ module: new URL('./vesicle_bg.wasm', import.meta.url) }`));
  const { build } = await import('esbuild');
  const outdir = join(project, 'dist/esbuild');
  const built = await build({
    ...{ absWorkingDir: project, entryPoints: ['main.js'], bundle: true, format: 'esm', outdir, logLevel: 'silent' },
  });
  expect(built.errors).toEqual([]);
  await writeFile(
    join(outdir, 'vesicle_bg.wasm'),
    await readFile(join(project, 'node_modules/vesicle/vesicle_bg.wasm')),
  );
  await write('dist/esbuild/index.html', page('<script type="module" src="./main.js"></script>'));
  await titleOf('dist/esbuild');
});

test('esbuild with the module inside, without an address', async () => {
  await write('main.js', main('vesicle/inline'));
  const { build } = await import('esbuild');
  const outdir = join(project, 'dist/esbuild-inline');
  const entry = { absWorkingDir: project, entryPoints: ['main.js'], outdir };
  await build({ ...entry, bundle: true, format: 'esm', logLevel: 'silent' });
  await write('dist/esbuild-inline/index.html', page('<script type="module" src="./main.js"></script>'));
  await titleOf('dist/esbuild-inline');
});

test.each(['', 'deformable/'])('a plain page without a bundler, %sindex.js', async (folder) => {
  await write('plain.html', page(`<script type="module">${main(`./node_modules/vesicle/${folder}index.js`)}</script>`));
  await titleOf('.', 'plain.html');
});

test('one file, under a policy that forbids all requests', async () => {
  const policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'none'; img-src data:";
  await write('strict.js', main('./node_modules/vesicle/inline.js'));
  await write('strict.html', page('<script type="module" src="./strict.js"></script>', policy));
  await titleOf('.', 'strict.html');
});

test('one file, from a blob address, as in notebooks', async () => {
  const script = `
    const text = await (await fetch('./node_modules/vesicle/inline.js')).text();
    const address = URL.createObjectURL(new Blob([text], { type: 'text/javascript' }));
    const vesicle = await import(address);
    await vesicle.default();
    document.title = await (${spongeBits})(vesicle);`;
  await write('blob.html', page(`<script type="module">${script}</script>`));
  await titleOf('.', 'blob.html');
});

test.each(['bundler', 'node16', 'nodenext'])(
  'types resolve in TypeScript with moduleResolution %s',
  async (resolution) => {
    const entries = ['vesicle', 'vesicle/inline'];
    const lines = entries.map((entry, k) => `import init${k}, { Mesh as Mesh${k} } from '${entry}';`);
    const uses = entries.map(
      (_, k) =>
        `await init${k}(); const n${k}: number = Mesh${k}.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 }).vertexCount;`,
    );
    await write('main.ts', [...lines, ...uses, `console.log(${entries.map((_, k) => `n${k}`)});`].join('\n'));
    const module = resolution === 'bundler' ? 'esnext' : resolution;
    const lib = 'ES2023,ESNext.Disposable,DOM';
    const options = [
      '--module',
      module,
      '--moduleResolution',
      resolution,
      '--target',
      'es2022',
      '--lib',
      lib,
      '--strict',
    ];
    await must(at('node_modules/.bin/tsc'), ['--noEmit', ...options, 'main.ts'], { cwd: project });
  },
);
