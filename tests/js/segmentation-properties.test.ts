/** `vesicle/dicom` with generated segmentations: the labels and names that were written, or a refusal in words. */
import fc from 'fast-check';
import { expect, test } from 'vitest';
import { openDicom } from '../../pkg/dicom/index.js';
import { expectListing, named, readAny } from './dicom-checks.js';
import {
  DAMAGE,
  damaged,
  type Element,
  FAULTS,
  fileOf,
  type Syntax,
  shortElement,
  sorted,
  textElement,
  withFaults,
} from './made-dicom.js';
import { expectInit, holds, isWhole, LIMITS, REPORT } from './properties.js';

type Kind = 'BINARY' | 'FRACTIONAL' | 'LABELMAP';

/** A segmentation as it is written: numbers and names of segments, and the slices that each has frames of. */
interface Made {
  syntax: 'explicit' | 'implicit';
  kind: Kind;
  dims: [number, number];
  step: number;
  segments: { number: number; name: string; slices: number[] }[];
  isOpen: boolean;
  seed: number;
}

const NAME = fc.oneof(
  fc.string({ unit: fc.constantFrom(...'abc XYZ-äöß漢字🫀'), minLength: 1, maxLength: 30 }),
  fc.constantFrom('x'.repeat(20_000), '🫀'.repeat(300), ' ', '=', 'a\\b'),
);
const SEGMENT = fc.record({
  number: fc.oneof(fc.integer({ min: 1, max: 9 }), fc.constantFrom(255, 256, 65_535)),
  name: NAME,
  slices: fc.uniqueArray(fc.nat(6), { minLength: 1, maxLength: 4 }),
});

const SEGMENTATION: fc.Arbitrary<Made> = fc.record({
  syntax: fc.constantFrom<('explicit' | 'implicit')[]>('explicit', 'implicit'),
  kind: fc.constantFrom<Kind[]>('BINARY', 'FRACTIONAL', 'LABELMAP'),
  dims: fc.tuple(fc.integer({ min: 1, max: 6 }), fc.integer({ min: 1, max: 6 })),
  step: fc.integer({ min: 2, max: 20 }).map((value) => value / 4),
  segments: fc.uniqueArray(SEGMENT, { minLength: 1, maxLength: 4, selector: ({ number }) => number }),
  isOpen: fc.boolean(),
  seed: fc.nat(0xffff),
});

/** A frame: its slice, and the number of its segment. */
interface Frame {
  z: number;
  number: number;
}

function framesOf({ kind, segments }: Made): Frame[] {
  const frames = segments.flatMap(({ number, slices }) => slices.map((z) => ({ z, number })));
  if (kind !== 'LABELMAP') return frames;
  return [...new Set(frames.map(({ z }) => z))].map((z) => ({ z, number: 0 }));
}

/** Whether a segment has voxel `k` of a slice. */
const isIn = ({ seed }: Made, number: number, z: number, k: number) => (seed + 7 * number + 13 * z + 5 * k) % 3 > 0;

/** Returns the labels of a slice: of several segments at a voxel, the one of the largest number. */
function labelsOf(made: Made, z: number): number[] {
  const owners = made.segments.filter(({ slices }) => slices.includes(z)).toSorted((a, b) => b.number - a.number);
  return Array.from(
    { length: made.dims[0] * made.dims[1] },
    (_, k) => owners.find(({ number }) => isIn(made, number, z, k))?.number ?? 0,
  );
}

function pixelsOf(made: Made, frames: Frame[]): Buffer {
  const { kind, dims } = made;
  const each = dims[0] * dims[1];
  if (kind === 'LABELMAP') {
    const labels = frames.flatMap(({ z }) => labelsOf(made, z));
    return Buffer.from(Uint16Array.from(labels).buffer);
  }
  const bits = frames.flatMap(({ z, number }) => Array.from({ length: each }, (_, k) => isIn(made, number, z, k)));
  if (kind === 'FRACTIONAL') return Buffer.from(bits.map((bit) => (bit ? 200 : 90)));
  const bytes = Buffer.alloc(Math.ceil(bits.length / 8));
  for (const [k, bit] of bits.entries()) if (bit) bytes[k >> 3] = (bytes[k >> 3] ?? 0) | (1 << (k & 7));
  return bytes;
}

function elementsOf(made: Made): Element[] {
  const { syntax, kind, dims, step, segments, isOpen } = made;
  const short = (tag: string, value: number) => shortElement(syntax as Syntax, tag, value);
  const group = (tag: string, ...elements: Element[]): Element => ({ tag, vr: 'SQ', value: [elements], isOpen });
  const frames = framesOf(made);
  const bits = { BINARY: 1, FRACTIONAL: 8, LABELMAP: 16 }[kind];
  const pixels = pixelsOf(made, frames);
  const place = (z: number) => group('00209113', textElement('00200032', 'DS', `1\\2\\${z * step}`));
  const owner = (number: number) => (kind === 'LABELMAP' ? [] : [group('0062000a', short('0062000b', number))]);
  return sorted([
    textElement('00080005', 'CS', 'ISO_IR 192'),
    textElement('00080016', 'UI', `1.2.840.10008.5.1.4.1.1.66.${kind === 'LABELMAP' ? 7 : 4}`),
    textElement('00080018', 'UI', '1.2.3'),
    textElement('0020000e', 'UI', '1.2.5'),
    short('00280002', 1),
    textElement('00280008', 'IS', String(frames.length)),
    ...[short('00280010', dims[1]), short('00280011', dims[0])],
    ...[short('00280100', bits), short('00280101', bits), short('00280102', bits - 1), short('00280103', 0)],
    ...(kind === 'LABELMAP' ? [] : [textElement('00620001', 'CS', kind)]),
    {
      ...{ tag: '00620002', vr: 'SQ', isOpen },
      value: segments.map(({ number, name }) => [
        short('00620004', number),
        textElement('00620005', 'UT', name, 'utf8'),
      ]),
    },
    ...(kind === 'FRACTIONAL' ? [short('0062000e', 255)] : []),
    group(
      '52009229',
      group('00209116', textElement('00200037', 'DS', '1\\0\\0\\0\\1\\0')),
      group('00289110', textElement('00180088', 'DS', String(step)), textElement('00280030', 'DS', '1\\1')),
    ),
    { tag: '52009230', vr: 'SQ', isOpen, value: frames.map(({ z, number }) => [place(z), ...owner(number)]) },
    {
      tag: '7fe00010',
      vr: kind === 'LABELMAP' ? 'OW' : 'OB',
      value: pixels.length % 2 ? Buffer.concat([pixels, Buffer.alloc(1)]) : pixels,
    },
  ]);
}

test('segmentations are read as they were written', LIMITS, async () => {
  const property = fc.asyncProperty(SEGMENTATION, async (made) => {
    const listing = await openDicom(named([fileOf(elementsOf(made), made.syntax)]));
    expectListing(listing);
    const [volume] = listing.volumes;
    if (!volume) throw new Error(listing.skipped[0]?.reason);
    const slices = framesOf(made).map(({ z }) => z);
    const [first, last] = [Math.min(...slices), Math.max(...slices)];
    expect([volume.dims, volume.spacing]).toEqual([
      [...made.dims, last - first + 1],
      [1, 1, made.step],
    ]);
    const names = made.segments.map(({ name }) => name.trim());
    expect(volume.segments.map(({ value }) => value)).toEqual(made.segments.map(({ number }) => number));
    for (const [k, { name = '' }] of volume.segments.entries())
      holds((names[k] ?? '').length <= 200 ? name === names[k] : isWhole(name) && name.length <= 200, name);
    const init = await volume.read();
    expectInit(init);
    const labels = Array.from({ length: last - first + 1 }, (_, z) => labelsOf(made, first + z)).flat();
    // Of equal fractions the first in the order of segments counts.
    if (made.kind === 'FRACTIONAL')
      holds(
        init.data.every((label, k) => (label === 0) === (labels[k] === 0)),
        'labels',
      );
    else expect([...init.data]).toEqual(labels);
  });
  await fc.assert(property, REPORT);
});

test('any faults in segmentations are survived', LIMITS, async () => {
  const property = fc.asyncProperty(SEGMENTATION, FAULTS, DAMAGE, async (made, faults, damage) => {
    await readAny([damaged(fileOf(withFaults(elementsOf(made), faults), made.syntax), damage)]);
  });
  await fc.assert(property, REPORT);
});

test('frames of segments that do not exist, or of none, are said', LIMITS, async () => {
  const property = fc.asyncProperty(SEGMENTATION, fc.nat(0xffff), async (given, number) => {
    const made: Made = { ...given, kind: 'BINARY' };
    const elements = elementsOf(made).map((one): Element => {
      if (one.tag !== '00620002') return one;
      return { ...one, value: [[shortElement(made.syntax, '00620004', number), textElement('00620005', 'LO', 'x')]] };
    });
    const { volumes } = await openDicom(named([fileOf(elements, made.syntax)]));
    const isMissing = made.segments.some((segment) => segment.number !== number);
    const told = volumes[0]?.warnings.map(({ text }) => text).join() ?? '';
    expect(told.includes('does not describe')).toBe(isMissing);
    const init = await volumes[0]?.read();
    const used = new Set(made.segments.map((segment) => segment.number));
    holds(
      [...(init?.data ?? [])].every((label) => label === 0 || used.has(label)),
      'a label of no segment',
    );
  });
  await fc.assert(property, REPORT);
});

test('segmentations of thousands of segments and frames', LIMITS, async () => {
  const counts = fc.tuple(fc.integer({ min: 1, max: 3000 }), fc.integer({ min: 1, max: 3000 }));
  const property = fc.asyncProperty(counts, SEGMENTATION, async ([segments, frames], made) => {
    const many = Array.from({ length: segments }, (_, k) => [shortElement(made.syntax, '00620004', k + 1)]);
    const elements = elementsOf(made).map((one): Element => {
      if (one.tag === '00620002') return { ...one, value: many };
      if (one.tag === '00280008') return textElement('00280008', 'IS', String(frames));
      return one.tag === '7fe00010' ? { ...one, value: Buffer.alloc(36 * 2 * frames) } : one;
    });
    await readAny([fileOf(elements, made.syntax)]);
  });
  await fc.assert(property, { ...REPORT, numRuns: Math.ceil(REPORT.numRuns / 100) });
});
