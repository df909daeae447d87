// The module for engines without vector instructions, which is compiled for `npm run test:all` only.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, test } from 'vitest';
import { bits, node, root } from './processes.js';
import { SPONGE_BITS } from './sponge.js';

test('an engine without SIMD gets the plain module, with the same bits', { tags: ['long'] }, () => {
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

test('only the plain module is valid without SIMD', { tags: ['long'] }, () => {
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

test('its size is that in sizes.json', { tags: ['long'] }, () => {
  const print = "import('./scripts/sizes.mjs').then(async ({ PLAIN, sizeOf }) => console.log(await sizeOf(PLAIN)))";
  const size = Number(execFileSync(process.execPath, ['--eval', print], { cwd: root, encoding: 'utf8' }));
  const known = JSON.parse(readFileSync(`${root}sizes.json`, 'utf8'))['vesicle_plain_bg.wasm'];
  expect(Math.abs(size / known - 1)).toBeLessThan(0.05);
});
