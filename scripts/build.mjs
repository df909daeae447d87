// Fills pkg/ with the npm package: the wasm module, its glue, the TypeScript face and the papers around it.

import { createHash } from 'node:crypto';
import { existsSync } from 'node:fs';
import { copyFile, cp, mkdir, readFile, rm, stat, writeFile } from 'node:fs/promises';
import { makeElement } from './element.mjs';
import { makeInline } from './inline.mjs';
import { writeNotices } from './licences.mjs';
import { setup } from './setup.mjs';
import { at, must, say, script, startedAs, tool } from './shell.mjs';

// The module is compiled with vectors and, for engines without them, plain. Glue and optimised module are kept between builds:
// both depend on the compiled module alone.
const WITH_VECTORS = { target: 'target', glue: 'target/glue', module: 'vesicle_bg.wasm', env: {} };
const PLAIN = {
  ...{ target: 'target/plain', glue: 'target/plain-glue', module: 'vesicle_plain_bg.wasm' },
  // After what .cargo/config.toml says of the target: the last word counts.
  env: { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: '-Ctarget-feature=-simd128' },
};

const compiled = ({ target }) => at(target, 'wasm32-unknown-unknown/release/vesicle.wasm');

// Documents that the README links to.
const PAPERS = ['LICENSE-MIT', 'LICENSE-APACHE', 'README.md', 'ARCHITECTURE.md', 'CHANGELOG.md', 'docs'];

// Adapters to third-party software: `vesicle/three` and so on.
const ADAPTERS = ['three', 'niivue', 'vtk'];

async function compile({ target, env }) {
  const args = [
    'rustc',
    '--locked',
    '--release',
    '--lib',
    '--crate-type',
    'cdylib',
    '--target',
    'wasm32-unknown-unknown',
  ];
  await must('cargo', [...args, '--target-dir', at(target)], { env });
}

async function stamp(kind) {
  const hash = createHash('sha256');
  for (const file of [compiled(kind), at('Cargo.lock'), at('package-lock.json'), at('scripts/build.mjs')])
    hash.update(await readFile(file));
  return hash.digest('hex');
}

async function makeGlue(kind) {
  const wanted = await stamp(kind);
  const stampFile = at(kind.glue, 'stamp');
  if (existsSync(stampFile) && (await readFile(stampFile, 'utf8')) === wanted) return;
  await rm(at(kind.glue), { recursive: true, force: true });
  await must('cargo', [
    ...['run', '--locked', '--quiet', '--package', 'xtask', '--', 'bindgen', compiled(kind)],
    // A trap loses the instance; the reset function lets a page start a new one without reloading.
    ...['--target', 'web', '--out-dir', at(kind.glue), '--experimental-reset-state-function'],
    // The face says where the module is, so that a bundler meets only one address of it.
    ...['--omit-default-module-path', '--remove-producers-section'],
  ]);
  await optimise(at(kind.glue, 'vesicle_bg.wasm'));
  await writeFile(stampFile, wanted);
}

/** Both modules are called by the same glue. */
async function compareGlue() {
  const [one, other] = await Promise.all(
    [WITH_VECTORS, PLAIN].map(({ glue }) => readFile(at(glue, 'vesicle.js'), 'utf8')),
  );
  if (one !== other) throw new Error('the glue of the plain module is another than that of the module with vectors');
}

async function optimise(module) {
  await must(tool('wasm-opt'), ['-O3', module, '-o', `${module}.opt`]);
  await copyFile(`${module}.opt`, module);
  await rm(`${module}.opt`);
}

async function assemble() {
  await rm(at('pkg'), { recursive: true, force: true });
  await mkdir(at('pkg'));
  for (const file of ['vesicle.js', 'vesicle.d.ts']) await copyFile(at(WITH_VECTORS.glue, file), at('pkg', file));
  for (const { glue, module } of [WITH_VECTORS, PLAIN]) await copyFile(at(glue, 'vesicle_bg.wasm'), at('pkg', module));
  await must(tool('tsc'), ['-p', at('js')]);
  await makeInline();
  await makeElement();
  await writeNotices('pkg/licences.txt', 'element');
  for (const file of PAPERS) await cp(at(file), at('pkg', file), { recursive: true });
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
    sideEffects: ['./worker-host.js', './element.js'],
    engines,
    main: './index.js',
    types: './index.d.ts',
    exports: {
      '.': { types: './index.d.ts', default: './index.js' },
      './inline': { types: './index.d.ts', default: './inline.js' },
      './worker': { types: './worker.d.ts', default: './worker.js' },
      './worker-host': { types: './worker-host.d.ts', default: './worker-host.js' },
      ...Object.fromEntries(ADAPTERS.map((name) => [`./${name}`, adapter(name)])),
      './element': { types: './element/index.d.ts', default: './element.js' },
      './vesicle_bg.wasm': './vesicle_bg.wasm',
      './vesicle_plain_bg.wasm': './vesicle_plain_bg.wasm',
      './package.json': './package.json',
    },
  };
}

/** The whole package; fast where nothing changed. */
export async function build() {
  const started = performance.now();
  // Side by side: each is linked by one thread.
  await Promise.all([WITH_VECTORS, PLAIN].map(compile));
  for (const kind of [WITH_VECTORS, PLAIN]) await makeGlue(kind);
  await compareGlue();
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
