/** Session files: what is written is read again, and what cannot be read is refused by name. */
import { readFile } from 'node:fs/promises';
import { strFromU8, strToU8, unzipSync, type Zippable, zipSync } from 'three/addons/libs/fflate.module.js';
import { describe, expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { isSession } from '../../www/src/importers/sessions';
import { describe as describeFiles, matching, writeSession } from '../../www/src/lab/session/file';
import { readSession } from './read-session';

const BYTES = Uint8Array.from({ length: 1000 }, (_, i) => i * i);
const MOMENT = {
  state: BYTES.slice(1),
  model: { levels: 1, iteration: 12, done: false },
  page: {
    choice: { kind: 'contour', bubbles: 5, levels: 1, edge: 0.1 + 0.2 },
    ...{ params: { iso: -0, topology: 'adaptive' }, attractors: [], history: { list: 0, iteration: 12 } },
  },
};
const REPORT = {
  ...{ iteration: 12, done: false, phase: 'level 1', progress: Number.NaN, residual: Number.POSITIVE_INFINITY },
  ...{ tolerance: 1e-6, vertices: 4, triangles: 4, components: 1, euler: 2, times: { forces: 0.5 }, warnings: [] },
  events: { creations: 0, deletions: 0, inversions: 0, axial: 0, annular: 0, vanished: 0, seeds: 0 },
};
const session = async (included = true) => ({
  lab: 'extract' as const,
  hash: '#extract?p.iso=95&v=2',
  source: { name: 'a.nrrd', files: await describeFiles([{ name: 'a.nrrd', bytes: BYTES }], included) },
  content: { ...MOMENT, undo: [{ label: 'step', ...MOMENT, state: Uint8Array.of() }], redo: [], reports: [[REPORT]] },
});
/** Fields that a session has, too, when it is read. */
const NOTHING = { edits: [], undone: [], warnings: [] };

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
  for (const written of [await session(), await session(false)]) {
    const content = { ...written.content, ...NOTHING };
    expect(await readSession(await writeSession(written))).toEqual({ ...written, content });
  }
});

test('a file of version 1 without what came later is read', async () => {
  const { lab, content } = await readSession(
    new Uint8Array(await readFile(at('tests/app/data/version-1.vesicle.zip'))),
  );
  expect(lab).toBe('extract');
  expect(content).toMatchObject({ edits: [], undone: [], warnings: [], model: { iteration: 174 } });
});

test('a session keeps warnings, and calls without arguments in its log', async () => {
  const setup = { start: { kind: 'contour' }, levels: 1, params: {}, attractors: [] };
  const log = {
    setup,
    calls: [
      { call: 'step', given: 2 },
      { call: 'seed', given: undefined },
    ],
  };
  const warnings = [
    ...[
      { code: 'anisotropic', text: 'Voxels are long.' },
      { code: 'reader', text: 'One.', where: { frame: 2 } },
    ],
    { code: 'thin-label', text: 'It is thin.', where: { point: [1, 2.5, -3] } },
  ];
  const written = await session();
  const content = { ...written.content, model: { ...MOMENT.model, log }, warnings };
  expect((await readSession(await writeSession({ ...written, content }))).content).toMatchObject(content);
});

test('a huge session.json is not read', async () => {
  const large = new Uint8Array(2 ** 17 + 1);
  for (const index of [new Uint8Array(2 ** 27 + 1), strToU8(`{"x":[0${',[]'.repeat(5e6)}]}`)])
    await expect(readSession(large, () => ({ 'session.json': index }))).rejects.toThrow('more than 128 MiB or 5');
  const index = new Uint8Array(2 ** 23 + 1);
  await expect(readSession(large.slice(1), () => ({ 'session.json': index }))).rejects.toThrow('more than 8 MiB or 5');
  await expect(readSession(large, () => ({ 'session.json': index }))).rejects.toThrow('damaged');
});

test('one that repeats itself can be read again, however well it packs', async () => {
  const written = await session();
  const calls = Array.from({ length: 20_000 }, () => ({
    call: 'setParams',
    given: { iso: 1, note: 'n'.repeat(190), other: 'n'.repeat(200) },
  }));
  const log = { setup: { start: { kind: 'contour' }, levels: 1, params: {}, attractors: [] }, calls };
  const bytes = await writeSession({ ...written, content: { ...written.content, model: { ...MOMENT.model, log } } });
  const { content } = await readSession(bytes);
  expect(content).toMatchObject({ model: { log: { calls: { length: 20_000 } } } });
});

test('a session that the page takes up at once is refused if it has more than labs have', async () => {
  const warnings = Array.from({ length: 2001 }, (_, index) => ({ code: 'reader', text: String(index) }));
  const attractors = Array.from({ length: 501 }, () => ({ point: [0, 0, 0], strength: 1, radius: 1 }));
  const page = { ...MOMENT.page, attractors };
  for (const [field, value] of Object.entries({ warnings, 'page.attractors': page })) {
    const bytes = await withIndex((index) => Object.assign(index, { [field.split('.')[0] as string]: value }));
    await expect(readSession(bytes)).rejects.toThrow(`${field} is too long`);
  }
});

test('a session without an option of the view, which was declared later, has its initial value', async () => {
  const { content } = await readSession(await withView({ options: { surface: false } }));
  expect(content).toMatchObject({ view: { options: { ...OPTIONS, surface: false } } });
});

test('long names are cut', async () => {
  const bytes = await withIndex((index) => Object.assign(index.source as object, { name: 'n'.repeat(20_000) }));
  expect((await readSession(bytes)).source.name).toBe('n'.repeat(200));
});

test('fields that no session has are left out', async () => {
  const { content } = await readSession(await withField('{"y":[1]}'));
  expect(content).not.toHaveProperty('x');
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
  const refused: [string, () => Promise<Uint8Array>, string | RegExp][] = [
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
    [
      'uses a part twice',
      () => withIndex((index) => (index.again = index.state)),
      'state.bin stands for several arrays',
    ],
    ['has an unknown array', () => withIndex((index) => (index.state = { $part: 'state.bin', type: 'X' })), 'damaged'],
    ['has no source', () => withIndex((index) => delete index.source), 'damaged'],
    [
      'has a source without a checksum',
      () => withIndex((index) => (index.source = { name: '', files: [{}] })),
      'damaged',
    ],
    ['has a broken list of parts', () => withIndex((index) => (index.parts = 7)), 'damaged'],
    ['has a reserved name in the list of parts', () => withPart('constructor'), 'constructor is missing'],
    ['has a word as a coordinate', () => withView({ crosshair: ['x', 1, 2] }), 'view.crosshair[0] is not a number'],
    ['has no finite coordinate', () => withView({ crosshair: [0, NAN, 0] }), 'view.crosshair[1] is not a number'],
    ['has a coordinate too far', () => withView({ crosshair: [0, 0, 1e308] }), 'view.crosshair[2] is not a number'],
    ['has a point of two numbers', () => withView({ crosshair: [0, 0] }), 'view.crosshair'],
    ['has an unknown option', () => withView({ options: { ...OPTIONS, slices: 'x' } }), 'view.options.slices is none'],
    ['lacks the camera', () => withView({ camera: undefined }), 'view.camera is missing'],
    ['has an infinite parameter', () => withPage({ params: { iso: INFINITY } }), 'page.params'],
    ['has too many attractors', () => withPage({ attractors: Array(20_000).fill(0) }), 'page.attractors is too long'],
    [
      'refers to reports it lacks',
      () => withPage({ history: { list: 1, iteration: 0 } }),
      'page.history.list does not',
    ],
    [
      'has an unknown call',
      () => withLog([{ call: 'x();', given: 1 }]),
      'model.log.calls[0].call is none of the known',
    ],
    ['has an unknown edit', () => withIndex((index) => (index.edits = [{ op: 'free' }])), 'edits[0].op is none of'],
    [
      'has a warning that is none',
      () => withIndex((index) => (index.warnings = [{ code: '=x()' }])),
      'warnings[0].code',
    ],
    ['has a path too long to tell', () => withPage({ params: { ['p'.repeat(5000)]: 1 } }), /^.{20,300}$/],
    ['has a name that objects have', () => withField('{"__proto__":{}}'), 'json is damaged.'],
    ['has too many levels', () => withField(nested(40)), 'json is damaged.'],
    ['has levels without end', () => withField(nested(1e5)), 'json is damaged.'],
    ['declares more bytes than fit', () => declaring(0xffff_fff0), 'more than 1000 parts or 1 GiB'],
    ['has too many parts', () => changed((files) => addMany(files)), 'more than 1000 parts or 1 GiB'],
  ];
  test.each(refused)('%s', async (_, make, message) => {
    await expect(readSession(await make())).rejects.toThrow(message);
  });
});

/** Numbers that JSON does not have. */
const [NAN, INFINITY] = [{ $number: 'NaN' }, { $number: 'Infinity' }];
const OPTIONS = { surface: true, edges: false, color: 'plain', slices: 'walls' };
const POINT = [0, 0, 0];
const VIEW = { camera: { position: POINT, target: POINT }, crosshair: POINT, options: OPTIONS };

const withView = (view: object) =>
  withIndex((index) => {
    index.view = { ...VIEW, ...view };
  });
const withPage = (page: object) => withIndex((index) => Object.assign(index.page as object, page));
const withPart = (name: string) => withIndex((index) => Object.assign(index.parts as object, { [name]: '' }));
const withLog = (calls: unknown[]) =>
  withIndex((index) => {
    const setup = { start: { kind: 'contour' }, levels: 1, params: {}, attractors: [] };
    index.model = { ...MOMENT.model, log: { setup, calls } };
  });

/** Returns a session's file with another field in `session.json`, which no session has. */
function withField(json: string): Promise<Uint8Array> {
  return changed((files) => {
    const index = strFromU8(files['session.json'] ?? Uint8Array.of());
    files['session.json'] = strToU8(index.replace('"page":', `"x":${json},"page":`));
  });
}

const nested = (levels: number) => '['.repeat(levels) + ']'.repeat(levels);

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
