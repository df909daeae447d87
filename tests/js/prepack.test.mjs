// Packages that `npm pack` refuses.
import { spawnSync } from 'node:child_process';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';

/** Makes a folder of files, runs the check in it, and returns its exit status and what it says. */
async function checked(files) {
  const folder = await mkdtemp(join(tmpdir(), 'vesicle-packed-'));
  for (const [name, text] of Object.entries(files)) {
    await mkdir(dirname(join(folder, name)), { recursive: true });
    await writeFile(join(folder, name), text);
  }
  const { status, stderr } = spawnSync(process.execPath, [at('scripts/prepack.mjs')], {
    cwd: folder,
    encoding: 'utf8',
  });
  await rm(folder, { recursive: true });
  return [status, stderr.trim()];
}

const exported = (...files) =>
  JSON.stringify({ exports: { '.': { types: './index.js', default: files[0] }, ...files } });
const loads = (file) => `export const module = new URL('./${file}', import.meta.url);`;
const WHOLE = {
  'package.json': exported('./index.js', './one/index.js', './vesicle_bg.wasm'),
  'index.js': loads('vesicle_bg.wasm'),
  'one/index.js': loads('vesicle_bg.wasm'),
  'vesicle_bg.wasm': 'whole',
  'one/vesicle_bg.wasm': 'one',
};

test('a package is packed if all that it names is there, and each entry point has its own module', async () => {
  expect(await checked(WHOLE)).toEqual([0, '']);
  const { 'one/vesicle_bg.wasm': _, ...lacking } = WHOLE;
  expect(await checked(lacking)).toEqual([1, expect.stringContaining('one/vesicle_bg.wasm is missing')]);
  const more = { ...WHOLE, 'package.json': exported('./index.js', './other.js') };
  expect(await checked(more)).toEqual([1, expect.stringContaining('other.js is missing')]);
  const standIn = { ...WHOLE, 'one/vesicle_bg.wasm': 'whole' };
  expect(await checked(standIn)).toEqual([1, expect.stringContaining('one module stands in')]);
});
