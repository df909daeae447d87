// The documentation beside the app: its links.
import { existsSync } from 'node:fs';
import { readdir, readFile } from 'node:fs/promises';
import { dirname, join, relative } from 'node:path';
import { beforeAll, expect, test } from 'vitest';
import { buildApp } from '../../scripts/app.mjs';
import { at } from '../../scripts/shell.mjs';
import { exampleById } from '../../www/src/presets';
import { cloudById } from '../../www/src/reconstruct/presets';
import { sceneById } from '../../www/src/sculpt/presets';
import { imageById } from '../../www/src/track/presets';

const DOCS = at('dist/docs');
const LABS: Record<string, (id: string) => { id: string } | undefined> = {
  extract: exampleById,
  reconstruct: cloudById,
  sculpt: sceneById,
  track: imageById,
};

interface Link {
  page: string;
  /** Path of the file that the link leads to; the part after `#` is separate. */
  file: string;
  hash: string;
}

let links: Link[] = [];

beforeAll(async () => {
  if (!existsSync(DOCS)) await buildApp();
  const names = await readdir(DOCS, { recursive: true });
  const pages = names.filter((name) => name.endsWith('.html'));
  links = (await Promise.all(pages.map(linksOf))).flat();
});

async function linksOf(page: string): Promise<Link[]> {
  const text = await readFile(join(DOCS, page), 'utf8');
  const addresses = [...text.matchAll(/(?:href|src)="([^"]*)"/g)].map(([, address = '']) =>
    address.replaceAll('&amp;', '&'),
  );
  return addresses.filter((address) => !/^(https?|data):/.test(address)).map((address) => linkAt(page, address));
}

function linkAt(page: string, address: string): Link {
  const [path = '', hash = ''] = address.split('#');
  return { page, file: path ? join(DOCS, dirname(page), decodeURI(path)) : join(DOCS, page), hash };
}

test('every link leads to a file, and anchors exist in their page', async () => {
  expect(links.length).toBeGreaterThan(500);
  const broken = links
    .filter(({ file }) => !existsSync(file))
    .map(({ page, file }) => `${page}: ${relative(DOCS, file)}`);
  expect(broken).toEqual([]);
  const inside = links.filter(({ file, hash }) => hash && file.startsWith(DOCS) && file.endsWith('.html'));
  const texts = new Map(await Promise.all([...new Set(inside.map(({ file }) => file))].map(readPage)));
  const lost = inside.filter(({ file, hash }) => !texts.get(file)?.includes(`id="${hash}"`));
  expect(lost).toEqual([]);
});

const readPage = async (file: string): Promise<[string, string]> => [file, await readFile(file, 'utf8')];

test('every method has a page, and its examples exist in the lab', () => {
  const named = links.filter(({ file }) => file === at('dist/index.html') && !file.startsWith(DOCS));
  const [labs, examples] = [new Set<string>(), [] as string[]];
  for (const { hash } of named.filter(({ hash }) => hash)) {
    const [lab = '', query] = hash.split('?');
    labs.add(lab);
    const id = new URLSearchParams(query).get('example');
    if (id) examples.push(`${lab} ${LABS[lab]?.(id)?.id === id ? id : 'has none of that name'}`);
  }
  expect([...labs].sort()).toEqual(Object.keys(LABS).sort());
  expect(examples.length).toBeGreaterThan(9);
  expect(examples.filter((example) => example.endsWith('name'))).toEqual([]);
});
