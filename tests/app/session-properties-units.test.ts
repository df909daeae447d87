/**
 * Sessions with anything in them are read as what the labs can use, or refused in words. `PROPERTY_RUNS` is the number
 * of runs of each property.
 */
import fc from 'fast-check';
import { strFromU8, strToU8, unzipSync, zipSync } from 'three/addons/libs/fflate.module.js';
import { assert, expect, test } from 'vitest';
import { ArchiveTooLarge } from '../../www/src/kit/archive';
import { History } from '../../www/src/kit/history';
import { writeSession } from '../../www/src/lab/session/file';
import { unpackMoments } from '../../www/src/lab/session/moments';
import { lastFrame, poseAt } from '../../www/src/labs/sculpt/film';
import { unpackTrack } from '../../www/src/labs/track/session';
import { crossSection } from '../../www/src/scene/cross-section';
import { anySession } from './made-sessions';
import { type Contents, readSession, type AnySession as Session } from './read-session';

const RUNS = Number(process.env.PROPERTY_RUNS ?? 100);
const LIMITS = { timeout: 60_000 + 20 * RUNS };
/** Longest time that a session may take to be read, milliseconds of this process. */
const MOST_MS = 1000;

type Json = null | boolean | number | string | Json[] | { [name: string]: Json };
type Files = Record<string, Uint8Array>;

const indexIn = (files: Files): Record<string, Json> => JSON.parse(strFromU8(files['session.json'] ?? Uint8Array.of()));
const withIndex = (files: Files, index: unknown) => ({ ...files, 'session.json': strToU8(JSON.stringify(index)) });

/** Values that are wrong nearly everywhere, or stand for others. */
const ODD = fc.constantFrom<Json>(
  ...[{ $number: 'NaN' }, { $number: '-Infinity' }, { $number: {} }, { $number: '7' }, 1e308, -1e308, -1, 0.5, 2 ** 53],
  ...[
    { $part: 'state.bin' },
    { $part: 'state.bin', type: 'Float64Array' },
    { $part: 7 },
    { $part: 'x', type: 'constructor' },
  ],
  ...['x'.repeat(20_000), '\ud800', '', '__proto__', 'constructor', [], {}, [[[]]], Array<Json>(2000).fill(0)],
  ...[JSON.parse('{"__proto__":{"crosshair":[0,0,0]}}'), JSON.parse('{"constructor":{"prototype":{"x":1}}}')],
  nested(200),
);
const JSON_VALUE = fc.oneof(ODD, fc.jsonValue({ maxDepth: 3 }) as fc.Arbitrary<Json>);

function nested(levels: number): Json {
  return JSON.parse('['.repeat(levels) + ']'.repeat(levels));
}

/** Returns the paths to all values within a value. */
function pathsIn(value: Json, path: string[] = []): string[][] {
  if (typeof value !== 'object' || value === null) return [path];
  return [path, ...Object.entries(value).flatMap(([name, one]) => pathsIn(one, [...path, name]))];
}

/** Returns a value with what is at a path replaced; undefined removes it. */
function replaced(value: Json, [name, ...path]: string[], by: Json | undefined): Json | undefined {
  if (name === undefined || typeof value !== 'object' || value === null) return by;
  const copy = (Array.isArray(value) ? [...value] : { ...value }) as Record<string, Json>;
  const one = replaced(copy[name] as Json, path, by);
  // JSON has null in place of what is missing in a list.
  if (one === undefined) delete copy[name];
  else Object.defineProperty(copy, name, { value: one, enumerable: true, configurable: true, writable: true });
  return copy;
}

/** Reads the files of a session, and tests the result: a session that the labs can use, or an error in words. */
async function readAny(files: Files): Promise<Session | undefined> {
  const before = process.cpuUsage();
  try {
    const session = await readSession(Uint8Array.of(), () => ({ ...files }));
    expectUsable(session);
    return session;
  } catch (error) {
    expectWords(error);
    return undefined;
  } finally {
    const { user, system } = process.cpuUsage(before);
    expect((user + system) / 1000).toBeLessThan(MOST_MS);
  }
}

function expectWords(error: unknown): void {
  // An error of another kind is a fault.
  if (!(error instanceof Error) || ![Error, ArchiveTooLarge].includes(error.constructor as typeof Error)) throw error;
  expect(error.message.length).toBeLessThan(1000);
}

const isPoint = (point: unknown) =>
  Array.isArray(point) && point.length === 3 && point.every((x) => Number.isFinite(x) && Math.abs(x) < 1e39);

/** Uses the content of a session as its lab does. */
const USES: { [Lab in Session['lab']]: (content: Contents[Lab]) => void } = {
  extract: (content) => {
    const { now, undo, redo } = unpackMoments(content);
    for (const { saved, page } of [now, ...[...undo, ...redo].map(({ state }) => state)]) {
      new History().rewind(page.mark());
      assert(Number.isSafeInteger(saved.iteration));
      assert(page.attractors.every(({ point, radius }) => isPoint(point) && Number.isFinite(radius)));
    }
    if (content.view) assert(isPoint(content.view.crosshair));
  },
  reconstruct: ({ model: { setup }, undo }) => {
    for (const { added, removed } of [setup.edits, ...undo.map(({ state }) => state.edits)])
      assert(added.every(isPoint) && removed.every(Number.isSafeInteger));
  },
  sculpt: ({ page: { film, names }, model, undo, log }) => {
    for (const { center, axes } of [...model.start, ...undo.flatMap((state) => state.model.start)])
      assert(isPoint(center) && axes.length === 3 && axes.every(isPoint));
    assert(names.every(({ length }) => length <= 200));
    assert(!log || log.calls.every(({ call }) => ['step', 'setParams', 'setEllipsoids'].includes(call)));
    if (!film) return;
    assert(lastFrame(film) >= 0);
    for (const frame of [0, 1, lastFrame(film)]) assert(poseAt(film, frame).every(({ center }) => isPoint(center)));
  },
  track: (content) => {
    const { now } = unpackTrack(content);
    new History().rewind(now.page.record.mark(now.saved.iteration));
    for (const { surface } of content.frames) {
      const { vertices, triangles, positions, indices } = surface;
      assert(positions.length >= 3 * vertices && indices.length >= 3 * triangles);
      assert(indices.subarray(0, 3 * triangles).every((vertex) => vertex < vertices));
    }
    for (const { surface } of now.page.record.frames)
      assert(crossSection(surface, { origin: [0, 0, 0], normal: [1, 0, 0] }).length % 6 === 0);
    if (content.view) assert(isPoint(content.view.crosshair));
  },
  segment: ({ labels, active, hidden, tools, view }) => {
    const values = new Set(labels.map(({ value }) => value));
    assert(values.size === labels.length && [active, ...hidden].every((value) => values.has(value)));
    assert(labels.every(({ name, color }) => name.length <= 200 && /^#[0-9a-f]{6}$/i.test(color)));
    if (tools) assert(tools.range[0] <= tools.range[1] && Number.isFinite(tools.radius));
    if (view) assert(isPoint(view.crosshair) && view.options.opacity <= 1);
  },
};

/** Tests what all labs need of a session, and that its lab can use it. */
function expectUsable({ lab, hash, source, content }: Session): void {
  assert(hash.length <= 2 ** 20 && source.name.length <= 200);
  assert(source.files.every(({ content }) => content === undefined || content instanceof Uint8Array));
  expectPlain(content);
  if (content.view) assert(isPoint(content.view.camera.position) && isPoint(content.view.camera.target));
  for (const { where } of content.warnings) if (where && 'point' in where) assert(isPoint(where.point));
  (USES[lab] as (content: unknown) => void)(content);
}

/** Tests that a value and all in it are lists, typed arrays, and objects of no other class, without reserved names. */
function expectPlain(value: unknown): void {
  if (typeof value !== 'object' || value === null || ArrayBuffer.isView(value)) return;
  assert(Array.isArray(value) || Object.getPrototypeOf(value) === Object.prototype);
  for (const [name, one] of Object.entries(value)) {
    assert(!['__proto__', 'constructor', 'prototype'].includes(name));
    expectPlain(one);
  }
}

/** Files of sessions to change, made once: making one takes longer than reading it. */
const MADE = fc.sample(anySession, { numRuns: 40, seed: 7 });
const ALL = MADE.map(async (session) => unzipSync(await writeSession(session)));

test('any value at any path of a session is read as what the labs can use, or refused in words', LIMITS, async () => {
  const indices = (await Promise.all(ALL)).map((one) => ({ files: one, index: indexIn(one) }));
  const known = indices.map((one) => ({ ...one, paths: pathsIn(one.index) }));
  let readable = 0;
  const change = fc.tuple(fc.nat(), fc.option(JSON_VALUE, { nil: undefined }));
  const changes = fc.array(change, { minLength: 1, maxLength: 2 });
  const property = fc.asyncProperty(fc.nat(MADE.length - 1), changes, async (which, changes) => {
    const { files, index, paths } = known[which] as (typeof known)[number];
    let changed: Json | undefined = index;
    for (const [at, by] of changes) changed = replaced(changed ?? null, paths[at % paths.length] ?? [], by);
    if (await readAny(withIndex(files, changed ?? null))) readable += 1;
  });
  // Some changes are harmless, such as those of texts: a few of a hundred, and by chance none. So they are counted with a seed.
  await fc.assert(property, { numRuns: 100, seed: 1 });
  expect(readable).toBeGreaterThan(0);
  await fc.assert(property, { numRuns: RUNS });
});

test('a surface that lacks vertices of its triangles is refused', async () => {
  const index = MADE.findIndex(({ lab }) => lab === 'track');
  const files = await ALL[index];
  const [frame] = indexIn(files ?? {}).frames as { surface: Json }[];
  for (const counts of [{ vertices: 2 }, { vertices: 4 }, { triangles: 2 }]) {
    const frames = [{ ...frame, surface: { ...(frame?.surface as object), ...counts } }];
    const changed = withIndex(files ?? {}, { ...indexIn(files ?? {}), frames });
    await expect(readSession(Uint8Array.of(), () => ({ ...changed }))).rejects.toThrow(
      'frames[0].surface is of the wrong',
    );
  }
});

test('what is written is read', LIMITS, async () => {
  const property = fc.asyncProperty(anySession, async (session) => {
    const { lab, hash, source, content } = await readSession(await writeSession(session));
    expect({ lab, hash, source, content }).toEqual(session);
    expectUsable({ lab, hash, source, content } as Session);
  });
  await fc.assert(property, { numRuns: Math.ceil(RUNS / 4) });
});

test('bytes of any kind in place of a session, or of a part of it, are refused in words', LIMITS, async () => {
  const all = await Promise.all(ALL);
  const zips = all.map((one) => zipSync(one));
  const index = fc.oneof(
    fc.uint8Array(),
    fc.string({ unit: 'binary' }).map(strToU8),
    JSON_VALUE.map((json) => strToU8(JSON.stringify(json))),
  );
  const flips = fc.array(fc.tuple(fc.nat(), fc.nat(255)), { maxLength: 4 });
  const property = fc.asyncProperty(fc.nat(zips.length - 1), index, flips, async (which, bytes, flips) => {
    await readAny({ ...all[which], 'session.json': bytes });
    const [zip = Uint8Array.of(), start = 0] = [zips[which]?.slice(), flips[0]?.[0]];
    for (const [at, by] of flips) zip[at % zip.length] = by;
    for (const file of [bytes, zip, zip.subarray(0, start % zip.length)])
      await readSession(file).then(expectUsable, expectWords);
  });
  await fc.assert(property, { numRuns: RUNS });
});
