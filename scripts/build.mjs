// Fills pkg/ with the npm package: the wasm module, its glue, the TypeScript face and the papers around it.

import { createHash } from 'node:crypto';
import { existsSync } from 'node:fs';
import { copyFile, cp, mkdir, readdir, readFile, rm, stat, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { makeElement } from './element.mjs';
import { METHODS, makeEntries, PARTS } from './entries.mjs';
import { makeInline } from './inline.mjs';
import { writeNotices } from './licences.mjs';
import { setup } from './setup.mjs';
import { at, must, say, script, startedAs, tool } from './shell.mjs';

/** The whole library, compiled with vector instructions. */
const WHOLE = { target: 'target', name: 'vesicle_bg' };

/** The whole library for engines without vector instructions. */
const PLAIN = {
  ...{ target: 'target/plain', name: 'vesicle_plain_bg' },
  // After what .cargo/config.toml says of the target: the last word counts.
  env: { CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: '-Ctarget-feature=-simd128' },
};

/** The library with one method, without the readers of files. */
const only = (method) => ({
  ...{ target: 'target', name: `${method}/vesicle_bg` },
  // Few slices are what makes sequences hard to track.
  features: [method, ...(method === 'tracking' ? ['enrich'] : [])],
});

/** The readers of files alone, which have glue of another name, since they have other classes. */
const READERS = { target: 'target', name: 'import/vesicle_bg', features: ['import'], glue: 'files' };

const METHOD_MODULES = METHODS.map(only);

const MODULES = [WHOLE, ...METHOD_MODULES, READERS];

/** How modules are made: as the package has them, or in a quarter of the time, larger and somewhat slower, with the same results. */
const WAYS = {
  release: { profile: 'release', optimises: true },
  quick: { profile: 'quick', optimises: false },
};

/** Folder of a module's glue, and of the module as the glue needs it. */
const folder = ({ name }) => at('target/modules', name);

const glueName = ({ glue = 'vesicle' }) => glue;

const made = (module) => join(folder(module), `${glueName(module)}_bg.wasm`);

// Documents that the README links to.
const PAPERS = ['SECURITY.md', 'LICENSE-MIT', 'LICENSE-APACHE', 'README.md', 'ARCHITECTURE.md', 'CHANGELOG.md', 'docs'];

// Adapters to third-party software: `vesicle/three` and so on.
const ADAPTERS = ['three', 'niivue', 'vtk', 'cornerstone'];

/** Packages that entry points import when they are used: of `vesicle/zarr`, `vesicle/tiff`, `vesicle/gltf`, and `vesicle/dicom`. */
const OPTIONAL_PEERS = [
  ...['zarrita', '@zarrita/storage', 'geotiff'],
  ...['draco3dgltf', 'meshoptimizer'],
  ...['dicom-parser', '@cornerstonejs/codec-libjpeg-turbo-8bit', '@cornerstonejs/jpeg-lossless-decoder-js'],
  ...['@cornerstonejs/codec-charls', '@cornerstonejs/codec-openjpeg', '@cornerstonejs/codec-openjph'],
];

/** Folders of `js` that are an entry point each, for formats of files that other packages help to read. */
const FORMATS = ['dicom', 'gltf', 'tiff', 'zarr'];

/**
 * Compiles a module and returns its path. The core is compiled once for all modules of a target directory with the same
 * features of its own.
 */
async function compile(module, { profile }) {
  const { target, features, env } = module;
  const args = ['build', '--locked', '-p', 'vesicle-bindings', '--profile', profile];
  const selected = features ? ['--no-default-features', '--features', features.join()] : [];
  await must('cargo', [...args, '--target', 'wasm32-unknown-unknown', ...selected, '--target-dir', at(target)], {
    env,
  });
  // The next module of the directory replaces it.
  const compiled = at('target/modules', `${module.name.replace('/', '-')}.wasm`);
  await mkdir(at('target/modules'), { recursive: true });
  await copyFile(at(target, 'wasm32-unknown-unknown', profile, 'vesicle_bindings.wasm'), compiled);
  return compiled;
}

/** The last module of each target directory, whose modules are compiled one after the other. */
const turns = new Map();

function compileInTurn(module, way) {
  const compiled = (turns.get(module.target) ?? Promise.resolve()).then(() => compile(module, way));
  turns.set(module.target, compiled);
  return compiled;
}

/** Files and folders that a module depends on. */
const SOURCES = [
  ...['src', 'xtask', 'Cargo.toml', 'Cargo.lock', '.cargo/config.toml', 'rust-toolchain.toml'],
  ...['package-lock.json', 'scripts/build.mjs'],
];

/** Returns a hash of all that the modules depend on. */
async function sourceHash() {
  const hash = createHash('sha256');
  for (const source of SOURCES) {
    const isFolder = (await stat(at(source))).isDirectory();
    const names = isFolder
      ? (await readdir(at(source), { recursive: true })).sort().map((name) => join(source, name))
      : [source];
    for (const name of names) {
      if ((await stat(at(name))).isFile()) hash.update(`${name}\n`).update(await readFile(at(name)));
    }
  }
  return hash.digest('hex');
}

const stampOf = ({ profile }, sources) => `${profile} ${sources}`;

const stampFile = (module) => join(folder(module), 'stamp');

async function isMade(module, way, sources) {
  const file = stampFile(module);
  return existsSync(file) && (await readFile(file, 'utf8')) === stampOf(way, sources);
}

/** Compiles a module, and makes its glue, unless that was done from the same `sources`. */
async function make(module, way, sources) {
  if (await isMade(module, way, sources)) return;
  const into = folder(module);
  const compiled = await compileInTurn(module, way);
  await rm(into, { recursive: true, force: true });
  await must('cargo', [
    ...['run', '--locked', '--quiet', '--package', 'xtask', '--target-dir', at('target/xtask')],
    ...['--', 'bindgen', compiled, into, glueName(module)],
  ]);
  if (way.optimises) await optimise(made(module));
  await writeFile(stampFile(module), stampOf(way, sources));
}

/** The modules of the whole library are called by the same glue. */
async function compareGlue() {
  const [one, other] = await Promise.all([WHOLE, PLAIN].map((module) => readFile(join(folder(module), 'vesicle.js'))));
  if (!one.equals(other)) throw new Error('the glue of the plain module differs from that of the module with vectors');
}

/**
 * Passes of binaryen: all twice, since the first round leaves work for the second. The one between them lets constant
 * offsets be part of loads; nothing is stored below address 1,024, the far end of the stack. The last puts functions of
 * like names, so of like code, next to each other, where they are compressed better.
 */
const OPTIMISATION = ['-O2', '--low-memory-unused', '-O2', '--reorder-functions-by-name'];

async function optimise(module) {
  await must(tool('wasm-opt'), [...OPTIMISATION, module, '-o', `${module}.opt`]);
  await copyFile(`${module}.opt`, module);
  await rm(`${module}.opt`);
}

async function assemble(modules) {
  await rm(at('pkg'), { recursive: true, force: true });
  await mkdir(at('pkg'));
  for (const file of ['vesicle.js', 'vesicle.d.ts']) await copyFile(join(folder(WHOLE), file), at('pkg', file));
  await must(tool('tsc'), ['-p', at('js')]);
  await makeEntries((entry) => {
    const module = MODULES.find(({ name }) => name.startsWith(`${entry}/`));
    return join(folder(module), glueName(module));
  });
  for (const module of modules) await copyFile(made(module), at('pkg', `${module.name}.wasm`));
  await makeInline();
  await makeElement();
  await writeNotices('pkg/licences.txt', 'element');
  await copyFile(at('scripts/prepack.mjs'), at('pkg/prepack.mjs'));
  for (const file of PAPERS) await cp(at(file), at('pkg', file), { recursive: true });
  await writeFile(at('pkg/package.json'), `${JSON.stringify(await manifest(modules), null, 2)}\n`);
}

const adapter = (name) => ({ types: `./adapters/${name}.d.ts`, default: `./adapters/${name}.js` });

const file = (name) => [`./${name}.wasm`, `./${name}.wasm`];

const entry = (part) => [
  [`./${part}`, { types: `./${part}/index.d.ts`, default: `./${part}/index.js` }],
  file(`${part}/vesicle_bg`),
];

const format = (name) => [`./${name}`, { types: `./${name}/index.d.ts`, default: `./${name}/index.js` }];

async function manifest(modules) {
  const { description, license, version, engines, devDependencies } = JSON.parse(
    await readFile(at('package.json'), 'utf8'),
  );
  return {
    name: 'vesicle',
    version,
    description,
    license,
    keywords: ['mesh', 'surface', 'volume', 'isosurface', 'medical imaging', 'deformable model', 'wasm'],
    type: 'module',
    scripts: { prepack: 'node prepack.mjs' },
    sideEffects: ['./worker-host.js', './element.js'],
    engines,
    // For `FORMATS` only.
    peerDependencies: Object.fromEntries(OPTIONAL_PEERS.map((name) => [name, `^${devDependencies[name]}`])),
    peerDependenciesMeta: Object.fromEntries(OPTIONAL_PEERS.map((name) => [name, { optional: true }])),
    main: './index.js',
    types: './index.d.ts',
    exports: {
      '.': { types: './index.d.ts', default: './index.js' },
      ...Object.fromEntries(PARTS.flatMap(entry)),
      './inline': { types: './index.d.ts', default: './inline.js' },
      './worker': { types: './worker.d.ts', default: './worker.js' },
      './channel': { types: './channel.d.ts', default: './channel.js' },
      './worker-host': { types: './worker-host.d.ts', default: './worker-host.js' },
      ...Object.fromEntries(ADAPTERS.map((name) => [`./${name}`, adapter(name)])),
      ...Object.fromEntries(FORMATS.map(format)),
      './element': { types: './element/index.d.ts', default: './element.js' },
      ...Object.fromEntries([WHOLE, PLAIN].filter((one) => modules.includes(one)).map(({ name }) => file(name))),
      './package.json': './package.json',
    },
  };
}

/**
 * The whole package, or all but its module without vector instructions, which needs a compilation of its own; fast
 * where nothing changed. `quick`: the latter with one module, not optimised as a whole, in place of each other, unless the
 * others are there.
 */
export async function build({ plain = true, quick = false } = {}) {
  const started = performance.now();
  const sources = await sourceHash();
  const areMade = await Promise.all(MODULES.map((module) => isMade(module, WAYS.release, sources)));
  if (quick && areMade.includes(false)) await buildQuick(sources);
  else await buildAll(plain && !quick ? [...MODULES, PLAIN] : MODULES, sources);
  const size = (await stat(at('pkg/vesicle_bg.wasm'))).size;
  say('pkg', `${Math.round(size / 1000)} kB of wasm, ${((performance.now() - started) / 1000).toFixed(1)} s`);
}

async function buildAll(modules, sources) {
  await Promise.all(modules.map((module) => make(module, WAYS.release, sources)));
  if (modules.includes(PLAIN)) await compareGlue();
  await assemble(modules);
}

/** The whole library stands in for its parts, which have the same classes. */
async function buildQuick(sources) {
  for (const module of [WHOLE, READERS]) await make(module, WAYS.quick, sources);
  for (const module of METHOD_MODULES) {
    await rm(folder(module), { recursive: true, force: true });
    await cp(folder(WHOLE), folder(module), { recursive: true });
  }
  await assemble(MODULES);
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    await setup({ browser: false });
    await build();
  });
}
