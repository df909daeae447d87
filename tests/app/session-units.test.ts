/** Session files: what is written is read again, and what cannot be read is refused by name. */
import { strFromU8, strToU8, unzipSync, type Zippable, zipSync } from 'three/addons/libs/fflate.module.js';
import { describe, expect, test } from 'vitest';
import { describe as describeFiles, matching, readSession, writeSession } from '../../www/src/session/file';
import { isSession } from '../../www/src/session/recognise';

const BYTES = Uint8Array.from({ length: 1000 }, (_, i) => i * i);
const session = async (included = true) => ({
  lab: 'extract' as const,
  hash: '#extract?p.iso=95&v=2',
  source: { name: 'a.nrrd', files: await describeFiles([{ name: 'a.nrrd', bytes: BYTES }], included) },
  content: {
    state: BYTES.slice(1),
    model: { iteration: 12, numbers: [0.1 + 0.2, Number.NaN, -0, Number.POSITIVE_INFINITY] },
    undo: [{ label: 'step', state: Uint8Array.of(), positions: new Float32Array([1.5, Number.NaN]) }],
  },
});

/** Returns a session's file with its parts changed. */
async function changed(change: (files: Record<string, Uint8Array>) => void): Promise<Uint8Array> {
  const files = unzipSync(await writeSession(await session()));
  change(files);
  return zipSync(files as Zippable);
}

/** Returns a session's file with `session.json` changed. */
function withIndex(change: (index: Record<string, unknown>) => void): Promise<Uint8Array> {
  return changed((files) => {
    const index = JSON.parse(strFromU8(files['session.json'] ?? Uint8Array.of()));
    change(index);
    files['session.json'] = strToU8(JSON.stringify(index));
  });
}

test('a session that was written is read again, bit for bit', async () => {
  const written = await session();
  expect(await readSession(await writeSession(written))).toStrictEqual(written);
  const without = await session(false);
  expect(await readSession(await writeSession(without))).toStrictEqual(without);
});

test('a session is recognised by its name or by its first entry, and other archives are not', async () => {
  const bytes = (await writeSession(await session())) as Uint8Array<ArrayBuffer>;
  const other = zipSync({ 'image.zarr/session.json': strToU8('{}') }) as Uint8Array<ArrayBuffer>;
  expect(await isSession(new File([bytes], 'renamed.zip'))).toBe(true);
  expect(await isSession(new File([other], 'a.vesicle.zip'))).toBe(true);
  expect(await isSession(new File([other], 'image.zip'))).toBe(false);
  expect(await isSession(new File([], 'empty.zip'))).toBe(false);
});

test('the files of a session are found by their content', async () => {
  const { source } = await session(false);
  const other = { name: 'other', bytes: Uint8Array.of(1) };
  const renamed = { name: 'b.nrrd', bytes: BYTES };
  expect(await matching(source.files, [other, renamed])).toEqual([{ name: 'a.nrrd', bytes: BYTES }]);
  await expect(matching(source.files, [other])).rejects.toThrow('It needs the file a.nrrd');
  await expect(matching(source.files, [{ ...other, name: 'a.nrrd' }])).rejects.toThrow('has other content');
});

describe('a file is refused that', () => {
  const refused: [string, () => Promise<Uint8Array>, string][] = [
    ['is no ZIP', async () => strToU8('PK? no'), 'no ZIP'],
    ['is empty', async () => Uint8Array.of(), 'no ZIP'],
    ['ends early', async () => (await writeSession(await session())).slice(0, -40), 'no ZIP'],
    ['has no session.json', () => changed((files) => delete files['session.json']), 'no session.json'],
    ['has a damaged index', () => changed((files) => (files['session.json'] = strToU8('{"for'))), 'is damaged'],
    ['is of another program', () => withIndex((index) => (index.format = 'other')), 'not of a session of this app'],
    ['is of a newer version', () => withIndex((index) => (index.version = 2)), 'format 2; this one reads up to 1'],
    ['is of a lab of a newer version', () => withIndex((index) => (index.lab = 'cut')), 'does not have: cut'],
    ['lacks a part', () => changed((files) => delete files['state.bin']), 'state.bin is missing'],
    ['has a part changed', () => changed((files) => files['state.bin']?.fill(1)), 'state.bin is damaged'],
    ['names a part unlisted', () => withIndex((index) => (index.state = { $part: 'x', type: 'Uint8Array' })), 'x is'],
    ['uses a part twice', () => withIndex((index) => (index.again = index.state)), 'state.bin is missing'],
    ['has an unknown array', () => withIndex((index) => (index.state = { $part: 'state.bin', type: 'X' })), 'damaged'],
    ['has no source', () => withIndex((index) => delete index.source), 'damaged'],
    [
      'has a source without a checksum',
      () => withIndex((index) => (index.source = { name: '', files: [{}] })),
      'damaged',
    ],
    ['has a broken list of parts', () => withIndex((index) => (index.parts = 7)), 'is missing'],
    ['declares more bytes than fit', () => declaring(0xffff_fff0), 'more than 1000 parts or 1 GiB'],
    ['has too many parts', () => changed((files) => addMany(files)), 'more than 1000 parts or 1 GiB'],
  ];
  test.each(refused)('%s', async (_, make, message) => {
    await expect(readSession(await make())).rejects.toThrow(message);
  });
});

/** Returns a session's file in whose directory an entry has another size after unpacking. */
async function declaring(size: number): Promise<Uint8Array> {
  const bytes = await writeSession(await session());
  const entry = Buffer.from(bytes).lastIndexOf('PK\u0001\u0002', undefined, 'latin1');
  new DataView(bytes.buffer, bytes.byteOffset).setUint32(entry + 24, size, true);
  return bytes;
}

function addMany(files: Record<string, Uint8Array>): void {
  for (let i = 0; i < 1000; i++) files[`${i}`] = Uint8Array.of();
}
