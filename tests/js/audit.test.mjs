// Packages and crates: their audits, and the rules for installing them in package.json and .npmrc.
import { readFile } from 'node:fs/promises';
import { expect, test } from 'vitest';
import { cratesAudited, packagesAudited } from '../../scripts/audit.mjs';
import { at } from '../../scripts/shell.mjs';

const npmReport = (counts) => {
  const vulnerabilities = { info: 0, low: 0, moderate: 0, high: 0, critical: 0, total: 0, ...counts };
  return `npm warn a warning\n${JSON.stringify({ vulnerabilities: {}, metadata: { vulnerabilities } }, null, 2)}\n`;
};

test('npm packages: clean, vulnerable, or not audited', () => {
  expect(packagesAudited(npmReport({}))).toMatchObject({ state: 'clean' });
  expect(packagesAudited(npmReport({ moderate: 2, total: 2 }))).toEqual({
    ...{ name: 'npm', state: 'clean', words: 'vulnerabilities: 2, of which 0 high, 0 critical' },
  });
  expect(packagesAudited(npmReport({ critical: 1, total: 1 }))).toMatchObject({ state: 'found' });
  const refused = `npm error endpoint\n{\n  "message": "405 Method Not Allowed",\n  "error": {}\n}\nnpm error a log\n`;
  expect(packagesAudited(refused)).toEqual({ name: 'npm', state: 'missed', words: '405 Method Not Allowed' });
  for (const output of ['', 'npm: not found', '{', 'null'])
    expect(packagesAudited(output)).toMatchObject({ state: 'missed', words: 'the registry did not answer' });
});

test('crates: clean, vulnerable, or not audited', () => {
  expect(cratesAudited(0, 'advisories ok\n')).toMatchObject({ state: 'clean' });
  const found =
    'error[vulnerability]: Potential segfault in the time crate\n  ┌─ Cargo.lock:2:1\n\nadvisories FAILED\n';
  expect(cratesAudited(1, found)).toEqual({ name: 'crates', state: 'found', words: 'advisories that apply: 1' });
  const unreached = '2026-01-01 00:00:00 [ERROR] failed to fetch advisory database https://…\n';
  expect(cratesAudited(1, unreached)).toMatchObject({ state: 'missed', words: expect.stringMatching(/^failed/) });
  const missing = 'error: no such command: `deny`\n';
  expect(cratesAudited(101, missing)).toMatchObject({ state: 'missed', words: expect.stringMatching(/cargo install/) });
  expect(cratesAudited(127, 'cargo: spawn cargo ENOENT\n')).toMatchObject({ state: 'missed' });
});

test('no scripts of packages run, and npm needs no others of ours', async () => {
  expect(await readFile(at('.npmrc'), 'utf8')).toMatch(/^ignore-scripts=true$/m);
  const { scripts } = JSON.parse(await readFile(at('package.json'), 'utf8'));
  // With that setting, npm runs none of these.
  const skipped = (name) => /^(pre|post)/.test(name) || ['install', 'prepare'].includes(name);
  expect(Object.keys(scripts).filter(skipped)).toEqual([]);
});

test('every override has a reason', async () => {
  const { overrides, '//': notes } = JSON.parse(await readFile(at('package.json'), 'utf8'));
  expect(Object.keys(notes.overrides)).toEqual(Object.keys(overrides));
});
