// Entry points of the package other than `vesicle`, in Node.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { expect, test } from 'vitest';
import { SPONGE_BITS, spongeBits } from './sponge.js';

const root = fileURLToPath(new URL('../..', import.meta.url));

/** Runs a script in a separate Node process, in a folder of the project, and returns what it prints. */
function node(script: string, cwd = root): string {
  const args = ['--input-type=module', '--eval', script];
  return execFileSync(process.execPath, args, { cwd, encoding: 'utf8', timeout: 120_000 }).trim();
}

const bits = (address: string, options = '') => `
  const vesicle = await import('${address}');
  await vesicle.default(${options});
  console.log(await (${spongeBits})(vesicle));`;

test('the file with the module inside gives the same bits, whatever folder it is run in', () => {
  expect(node(bits(`${root}pkg/inline.js`), '/')).toBe(SPONGE_BITS);
});

test('an engine without SIMD gets the plain module, with the same bits', () => {
  const without = `
    const { readFile } = (await import('node:fs')).promises;
    const read = [];
    WebAssembly.validate = () => false;
    const { compile } = WebAssembly;
    WebAssembly.compile = (bytes) => { read.push(bytes.length); return compile(bytes); };`;
  const sizes = `
    const lengths = await Promise.all(['plain_bg', 'bg'].map((name) => readFile('pkg/vesicle_' + name + '.wasm')));
    console.log(...lengths.map(({ length }) => read.includes(length)));`;
  expect(node(`${without}${bits('./pkg/index.js')}${sizes}`)).toBe(`${SPONGE_BITS}\ntrue false`);
});

test('only the plain module is valid without SIMD', () => {
  const check = (...args: string[]) =>
    spawnSync('node_modules/.bin/wasm-opt', ['--all-features', ...args], { cwd: root }).status;
  const isValid = (module: string) => {
    // The module's own feature section would enable SIMD again.
    const bare = join(mkdtempSync(join(tmpdir(), 'vesicle-')), 'bare.wasm');
    expect(check('--strip-target-features', `pkg/${module}`, '-o', bare)).toBe(0);
    return check('--disable-simd', bare, '-o', bare) === 0;
  };
  expect(isValid('vesicle_plain_bg.wasm')).toBe(true);
  expect(isValid('vesicle_bg.wasm')).toBe(false);
});
