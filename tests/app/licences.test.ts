// The notices that accompany app and package, and the licences that are refused.
import { existsSync } from 'node:fs';
import { readFile, rm } from 'node:fs/promises';
import { beforeAll, expect, test } from 'vitest';
import { buildApp } from '../../scripts/app.mjs';
import { refuseOthers, writeNotices } from '../../scripts/licences.mjs';
import { at } from '../../scripts/shell.mjs';
import { openApp } from './browser';
import { LONG } from './long';

let crates: string[] = [];
let notices = '';

beforeAll(async () => {
  if (!existsSync(at('dist/licences.txt'))) await buildApp();
  const manifest = await readFile(at('Cargo.toml'), 'utf8');
  const [, own = ''] = manifest.match(/^\[dependencies\]\n([\s\S]*?)\n\n/m) ?? [];
  const [, wasm = ''] = manifest.match(/^\[target.*wasm32.*\.dependencies\]\n([\s\S]*?)\n\n/m) ?? [];
  crates = [...(own + wasm).matchAll(/^([\w-]+) =/gm)].map(([, name = '']) => name);
  notices = await readFile(at('dist/licences.txt'), 'utf8');
});

/** Returns the names of the crates and packages that a text lists with version and licence. */
const named = (text: string) => [...text.matchAll(/^(\S+) (\d+\.\d\S*) \((.+)\)/gm)].map(([, name = '']) => name);

test('every crate in the module is listed', () => {
  expect(crates.length).toBeGreaterThan(10);
  expect(named(notices)).toEqual(expect.arrayContaining(crates));
});

test('packages of the page, of its workers and beside it are listed, and no tools', () => {
  // geotiff is in a worker only.
  const parts = [
    'three',
    'uplot',
    'geotiff',
    'itk-wasm',
    'dicom-parser',
    'draco3dgltf',
    'meshoptimizer',
    '@cornerstonejs/codec-openjpeg',
    '@niivue/niivue',
    '@kitware/vtk.js',
  ];
  expect(named(notices)).toEqual(expect.arrayContaining(parts));
  const tools = ['vite', 'typescript', 'playwright-core', 'wasm-bindgen-cli', 'thiserror-impl', 'gltf', 'vesicle'];
  expect(named(notices).filter((name) => tools.includes(name))).toEqual([]);
});

test('all include the text of their licence, but for those whose packages have none', () => {
  const blocks = notices.split(/^─+$/m).slice(1);
  expect(blocks.length).toBeGreaterThan(20);
  const cornerstone = ['codec-libjpeg-turbo-8bit', 'codec-openjpeg', 'core', 'metadata', 'tools', 'utils'].map(
    (name) => `@cornerstonejs/${name}`,
  );
  const without = blocks.filter((block) => block.includes('without the text')).flatMap(named);
  expect(without).toEqual([...cornerstone, 'draco3dgltf', 'lerc']);
  // Where several licences apply together, none may be left out.
  expect(notices).toMatch(/^unicode-ident .*AND Unicode-3\.0[^─]*UNICODE LICENSE V3/m);
});

test('the package has its own notices, of the module and of three.js in the element', async () => {
  const file = 'target/licences/package.txt';
  await writeNotices(file, 'element');
  const parts = named(await readFile(at(file), 'utf8'));
  await rm(at(file));
  expect(parts).toEqual(expect.arrayContaining([...crates, 'three']));
  expect(parts).not.toContain('uplot');
});

test.each([
  ['GPL-3.0-only', true],
  ['MIT AND GPL-3.0-only', true],
  ['CC-BY-NC-4.0', true],
  ['SEE LICENSE IN terms.txt', true],
  [undefined, true],
  ['MIT OR GPL-3.0-only', false],
  ['(MIT OR Apache-2.0) AND Unicode-3.0', false],
  ['(WTFPL OR MIT)', false],
])('%s: refused %s', async (licence, refused) => {
  const asked = refuseOthers([{ name: 'a-part', version: '1.0.0', licence }]);
  if (refused) await expect(asked).rejects.toThrow(/a-part 1\.0\.0 .*deny\.toml/);
  else await expect(asked).resolves.toBeUndefined();
});

test('the app links to them', LONG, async () => {
  const app = await openApp();
  try {
    await app.page.click('#help');
    const [notices] = await Promise.all([app.page.waitForEvent('popup'), app.page.click('dialog a[href*=licences]')]);
    await notices.waitForURL(/licences\.txt$/);
    expect((await notices.textContent('body'))?.slice(0, 19)).toBe('Vesicle is licensed');
  } finally {
    await app.close();
  }
});
