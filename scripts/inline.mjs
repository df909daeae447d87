// Builds the package as a single file with the wasm module inside, for pages that may not fetch anything.
import { readFile } from 'node:fs/promises';
import { gzipSync } from 'node:zlib';
import { bundle } from './bundle.mjs';
import { at } from './shell.mjs';

/** Returns the replacement for `module.js`: the module itself, compressed, as text. */
async function moduleInside() {
  const bytes = gzipSync(await readFile(at('pkg/vesicle_bg.wasm')), { level: 9 });
  return `
const TEXT = '${bytes.toString('base64')}';

export function defaultModule() {
  const bytes = Uint8Array.from(atob(TEXT), (character) => character.charCodeAt(0));
  const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(unpacked).arrayBuffer();
}
`;
}

/** Writes `pkg/inline.js`; needs the rest of the package. */
export async function makeInline() {
  const inside = await moduleInside();
  const plugin = { name: 'module-inside', load: (id) => (id === at('pkg/module.js') ? inside : undefined) };
  // Not minified: it would be hardly smaller, and the minifier would put together the names of Node modules that are
  // hidden from bundlers.
  await bundle('inline', 'pkg/index.js', [plugin], false);
}
