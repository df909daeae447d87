/** The texts that the workers of the app are built with. */
import { readdirSync, readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { describe, expect, test } from 'vitest';
import { filesFrom, keysFrom, textsOf } from '../../www/texts-of-workers';

const SRC = fileURLToPath(new URL('../../www/src/', import.meta.url));
const english = JSON.parse(readFileSync(`${SRC}texts/en.json`, 'utf8'));
const workers = readdirSync(SRC, { recursive: true, encoding: 'utf8' }).filter((path) =>
  /(^|\/)worker\.ts$/.test(path),
);
const count = (catalogue: Record<string, object>) =>
  Object.values(catalogue).reduce((sum, section) => sum + Object.keys(section).length, 0);

describe.each(workers)('%s', (name) => {
  const files = [...filesFrom(SRC + name)].filter((file) => /\.tsx?$/.test(file));
  const kept = textsOf(english, keysFrom(SRC + name));

  test('has the texts that it names, and few others', () => {
    const calls = files.flatMap((file) => [
      ...readFileSync(file, 'utf8').matchAll(/\b(text|plural)\(\s*'(\w+)\.(\w+)'/g),
    ]);
    expect(calls.length).toBeGreaterThan(0);
    for (const [, call, section = '', key = ''] of calls)
      expect(kept[section], `${section}.${key}`).toHaveProperty(call === 'plural' ? `${key}_other` : key);
    expect(count(kept)).toBeLessThan(0.2 * count(english));
  });

  test('names texts by whole keys only, by which they are found', () => {
    for (const file of files) expect(readFileSync(file, 'utf8'), file).not.toMatch(/\b(text|plural)\(\s*`/);
  });
});

test('plural forms belong to their key, and what is not named is left out', () => {
  const catalogue = { a: { one: '1', many_one: '{count} x', many_other: '{count} xs', rest: '' }, b: { c: '' } };
  expect(textsOf(catalogue, new Set(['a.one', 'a.many']))).toEqual({
    a: { one: '1', many_one: '{count} x', many_other: '{count} xs' },
  });
});
