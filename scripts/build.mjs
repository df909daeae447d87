// Fills pkg/ with the npm package: the wasm module, its glue, the TypeScript face and the papers around it.

import { createHash } from 'node:crypto';
import { existsSync } from 'node:fs';
import { copyFile, cp, mkdir, readFile, rm, stat, writeFile } from 'node:fs/promises';
import { setup } from './setup.mjs';
import { at, must, say, script, startedAs, tool } from './shell.mjs';

const COMPILED = 'target/wasm32-unknown-unknown/release/vesicle.wasm';
// Glue and optimised module are kept here between builds: both depend on the compiled module alone.
const GLUE = 'target/glue';

// What the README links to comes along.
const PAPERS = [
  'LICENSE-MIT',
  'LICENSE-APACHE',
  'README.md',
  'ARCHITECTURE.md',
  'CHANGELOG.md',
  'docs/extract.png',
  'docs/reconstruct.jpg',
  'docs/hosts.md',
];

// Between the package and other people's: `vesicle/three` and so on.
const ADAPTERS = ['three', 'niivue', 'vtk'];

async function compile() {
  await must('cargo', [
    ...['rustc', '--locked', '--release', '--lib', '--crate-type', 'cdylib'],
    ...['--target', 'wasm32-unknown-unknown'],
  ]);
}

async function stamp() {
  const hash = createHash('sha256');
  for (const file of [COMPILED, 'Cargo.lock', 'package-lock.json', 'scripts/build.mjs'])
    hash.update(await readFile(at(file)));
  return hash.digest('hex');
}

async function makeGlue() {
  const wanted = await stamp();
  const stampFile = at(GLUE, 'stamp');
  if (existsSync(stampFile) && (await readFile(stampFile, 'utf8')) === wanted) return;
  await rm(at(GLUE), { recursive: true, force: true });
  await must('cargo', [
    ...['run', '--locked', '--quiet', '--package', 'xtask', '--', 'bindgen', at(COMPILED)],
    // A trap loses the instance; the reset function lets a page start a new one without reloading.
    ...['--target', 'web', '--out-dir', at(GLUE), '--experimental-reset-state-function'],
    // The face says where the module is, so that a bundler meets only one address of it.
    ...['--omit-default-module-path', '--remove-producers-section'],
  ]);
  await optimise(at(GLUE, 'vesicle_bg.wasm'));
  await writeFile(stampFile, wanted);
}

async function optimise(module) {
  await must(tool('wasm-opt'), ['-O3', module, '-o', `${module}.opt`]);
  await copyFile(`${module}.opt`, module);
  await rm(`${module}.opt`);
}

async function assemble() {
  await rm(at('pkg'), { recursive: true, force: true });
  await mkdir(at('pkg'));
  for (const file of ['vesicle.js', 'vesicle.d.ts', 'vesicle_bg.wasm']) await copyFile(at(GLUE, file), at('pkg', file));
  await must(tool('tsc'), ['-p', at('js')]);
  for (const file of PAPERS) await cp(at(file), at('pkg', file));
  await writeFile(at('pkg/package.json'), `${JSON.stringify(await manifest(), null, 2)}\n`);
}

const adapter = (name) => ({ types: `./adapters/${name}.d.ts`, default: `./adapters/${name}.js` });

async function manifest() {
  const { description, license, version, engines } = JSON.parse(await readFile(at('package.json'), 'utf8'));
  return {
    name: 'vesicle',
    version,
    description,
    license,
    keywords: ['mesh', 'surface', 'volume', 'isosurface', 'medical imaging', 'deformable model', 'wasm'],
    type: 'module',
    sideEffects: false,
    engines,
    main: './index.js',
    types: './index.d.ts',
    exports: {
      '.': { types: './index.d.ts', default: './index.js' },
      ...Object.fromEntries(ADAPTERS.map((name) => [`./${name}`, adapter(name)])),
      './vesicle_bg.wasm': './vesicle_bg.wasm',
      './package.json': './package.json',
    },
  };
}

/** The whole package; fast where nothing changed. */
export async function build() {
  const started = performance.now();
  await compile();
  await makeGlue();
  await assemble();
  const size = (await stat(at('pkg/vesicle_bg.wasm'))).size;
  say('pkg', `${Math.round(size / 1000)} kB of wasm, ${((performance.now() - started) / 1000).toFixed(1)} s`);
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    await setup({ browser: false });
    await build();
  });
}
