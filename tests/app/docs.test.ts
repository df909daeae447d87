// The documentation beside the app: its links; and the addresses that the tests open.
import { existsSync } from 'node:fs';
import { readdir, readFile } from 'node:fs/promises';
import { dirname, join, relative } from 'node:path';
import { beforeAll, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import type { LabId } from '../../www/src/lab/address';
import { exampleById } from '../../www/src/labs/extract/presets';
import { cloudById } from '../../www/src/labs/reconstruct/presets';
import { sceneById } from '../../www/src/labs/sculpt/presets';
import { segmentExampleById } from '../../www/src/labs/segment/examples';
import { imageById } from '../../www/src/labs/track/presets';

const DOCS = at('dist/docs');
const LABS: Record<LabId, (id: string) => { id: string } | undefined> = {
  extract: exampleById,
  reconstruct: cloudById,
  sculpt: sceneById,
  track: imageById,
  segment: segmentExampleById,
};
/** Returns the id of a lab's example; undefined if it has none of that name. */
const exampleOf = (lab: string, id: string) => (lab in LABS ? LABS[lab as LabId](id)?.id : undefined);

interface Link {
  page: string;
  /** Path of the file that the link leads to, without a query; the part after `#` is separate. */
  file: string;
  hash: string;
}

let links: Link[] = [];

beforeAll(async () => {
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
  const [path = '', hash = ''] = address.replace(/^([^?#]*)\?[^#]*/, '$1').split('#');
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
    if (id) examples.push(`${lab} ${exampleOf(lab, id) === id ? id : 'has none of that name'}`);
  }
  expect([...labs].sort()).toEqual(Object.keys(LABS).sort());
  expect(examples.length).toBeGreaterThan(9);
  expect(examples.filter((example) => example.endsWith('name'))).toEqual([]);
});

test('every example that a test opens exists, except those that a test says do not', async () => {
  const folder = at('tests/app');
  // Unit tests only parse addresses.
  const sources = (await readdir(folder)).filter((name) => name.endsWith('.ts') && !name.endsWith('units.test.ts'));
  const opened: string[] = [];
  for (const source of sources) {
    const text = await readFile(join(folder, source), 'utf8');
    for (const [, lab = '', id = ''] of text.matchAll(/\b(\w+)\?(?:[^'"`\s]*&)?example=([\w-]+)/g))
      if (id !== 'nowhere' && lab in LABS)
        opened.push(`${source}: ${lab} ${exampleOf(lab, id) === id ? id : 'has none'}`);
  }
  expect(opened.length).toBeGreaterThan(40);
  expect(opened.filter((one) => one.endsWith('none'))).toEqual([]);
});
