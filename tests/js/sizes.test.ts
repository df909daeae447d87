// Compares the sizes of the package's parts with those recorded in sizes.json.
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { beforeAll, expect, test } from 'vitest';

const root = fileURLToPath(new URL('../..', import.meta.url));
// The plain module has a test of its own.
const { 'vesicle_plain_bg.wasm': _, ...known }: Record<string, number> = JSON.parse(
  readFileSync(`${root}sizes.json`, 'utf8'),
);
let present: Record<string, number> = {};

beforeAll(() => {
  const print = "import('./scripts/sizes.mjs').then(async ({ sizes }) => console.log(JSON.stringify(await sizes())))";
  present = JSON.parse(execFileSync(process.execPath, ['--eval', print], { cwd: root, encoding: 'utf8' }));
});

test.each(Object.keys(known))('the size of %s is that in sizes.json', (name) => {
  const growth = (present[name] ?? Number.POSITIVE_INFINITY) / (known[name] ?? 0) - 1;
  const advice = `${name} changed by ${(100 * growth).toFixed(1)} %: npm run sizes, and say why in CHANGELOG.md`;
  expect(Math.abs(growth), advice).toBeLessThan(0.05);
});

test('every part is listed, and adapters are small', () => {
  expect(Object.keys(present)).toEqual(Object.keys(known));
  for (const name of ['three', 'niivue', 'vtk']) expect(present[`vesicle/${name}`], name).toBeLessThan(15_000);
});
