// Measures the download size of the package: `npm run sizes` prints it and writes sizes.json, which the tests compare
// with.
import { readFile, writeFile } from 'node:fs/promises';
import { gzipSync } from 'node:zlib';
import { PARTS } from './entries.mjs';
import { at, say, script, startedAs } from './shell.mjs';

const MODULES = ['vesicle_bg.wasm', ...PARTS.map((part) => `${part}/vesicle_bg.wasm`)];

/** The module without vector instructions, which `npm test` does not build. */
export const PLAIN = 'vesicle_plain_bg.wasm';

/** Entry points, each bundled with all that it imports; wasm modules are fetched separately. */
const ENTRIES = {
  vesicle: 'index.js',
  ...Object.fromEntries(PARTS.map((part) => [`vesicle/${part}`, `${part}/index.js`])),
  'vesicle/inline': 'inline.js',
  'vesicle/worker': 'worker.js',
  'vesicle/worker-host': 'worker-host.js',
  'vesicle/channel': 'channel.js',
  'vesicle/three': 'adapters/three.js',
  'vesicle/niivue': 'adapters/niivue.js',
  'vesicle/vtk': 'adapters/vtk.js',
  'vesicle/cornerstone': 'adapters/cornerstone.js',
  'vesicle/dicom': 'dicom/index.js',
  'vesicle/gltf': 'gltf/index.js',
  'vesicle/tiff': 'tiff/index.js',
  'vesicle/zarr': 'zarr/index.js',
  'vesicle/element': 'element.js',
};

async function bundled(file) {
  const { build } = await import('esbuild');
  const { outputFiles } = await build({
    entryPoints: [at('pkg', file)],
    ...{ bundle: true, minify: true, format: 'esm', target: 'es2022', write: false, logLevel: 'error' },
    // Imported in Node only, or brought by the page.
    external: ['node:*', 'zarrita', '@zarrita/*', 'geotiff', 'dicom-parser'],
  });
  return outputFiles[0].contents;
}

/** Returns the gzipped size of a file of the package in bytes. */
export const sizeOf = async (name) => gzipSync(await readFile(at('pkg', name)), { level: 9 }).length;

/** Returns the gzipped size of each part of the package but `PLAIN` in bytes. */
export async function sizes() {
  const all = {};
  for (const name of MODULES) all[name] = await sizeOf(name);
  for (const [name, file] of Object.entries(ENTRIES)) all[name] = gzipSync(await bundled(file), { level: 9 }).length;
  return all;
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    const all = { ...(await sizes()), [PLAIN]: await sizeOf(PLAIN) };
    for (const [name, bytes] of Object.entries(all)) say(name, `${(bytes / 1000).toFixed(1)} kB`);
    await writeFile(at('sizes.json'), `${JSON.stringify(all, null, 2)}\n`);
  });
}
