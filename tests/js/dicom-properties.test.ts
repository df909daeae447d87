/** `vesicle/dicom` with generated, damaged and malicious headers: right volumes, or files that are skipped in words. */
import { readdirSync, readFileSync } from 'node:fs';
import fc from 'fast-check';
import { expect, test } from 'vitest';
import { type DicomVolume, openDicom, readDicom } from '../../pkg/dicom/index.js';
import { expectListing, named, readAny } from './dicom-checks.js';
import {
  DAMAGE,
  DIRECTIONS,
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
import { expectInit, holds, LIMITS, REPORT } from './properties.js';

/** An image series as it is written. */
interface Made {
  syntax: Syntax;
  dims: [number, number, number];
  spacing: [number, number, number];
  origin: [number, number, number];
  directions: string;
  bits: 8 | 16;
  isSigned: boolean;
  slope: number;
  intercept: number;
  name: string;
  form: 'files' | 'frames' | 'chain';
  isOpen: boolean;
  seed: number;
}

const length = fc.integer({ min: 32, max: 400 }).map((value) => value / 64);
const place = fc.integer({ min: -4000, max: 4000 }).map((value) => value / 16);
const LETTERS = fc.string({ unit: fc.constantFrom(...'abc XYZ-äöß漢字µ'), maxLength: 24 });

const SERIES: fc.Arbitrary<Made> = fc.record({
  syntax: fc.constantFrom<Syntax[]>('explicit', 'implicit', 'big'),
  dims: fc.tuple(fc.integer({ min: 1, max: 5 }), fc.integer({ min: 1, max: 5 }), fc.integer({ min: 2, max: 5 })),
  spacing: fc.tuple(length, length, length),
  origin: fc.tuple(place, place, place),
  directions: fc.constantFrom(...DIRECTIONS),
  bits: fc.constantFrom<(8 | 16)[]>(8, 16),
  isSigned: fc.boolean(),
  slope: fc.constantFrom(1, 2, 0.5),
  intercept: fc.constantFrom(0, -1000, 0.25),
  name: LETTERS,
  form: fc.constantFrom<Made['form'][]>('files', 'frames', 'chain'),
  isOpen: fc.boolean(),
  seed: fc.nat(0xffff),
});

/** Returns the stored value of voxel `k` of slice `z`. */
function valueAt({ bits, isSigned, seed }: Made, k: number, z: number): number {
  const value = (seed + 31 * k + 977 * z) % 2 ** bits;
  return isSigned && value >= 2 ** (bits - 1) ? value - 2 ** bits : value;
}

function normalOf({ directions }: Made): number[] {
  const [a = 0, b = 0, c = 0, x = 0, y = 0, z = 0] = directions.split('\\').map(Number);
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

const positionOf = (made: Made, z: number) =>
  made.origin.map((start, axis) => start + z * made.spacing[2] * (normalOf(made)[axis] ?? 0));

function pixelsOf(made: Made, z: number): Buffer {
  const { dims, bits, syntax } = made;
  const bytes = Buffer.alloc((dims[0] * dims[1] * bits) / 8);
  for (let k = 0; k < dims[0] * dims[1]; k++) {
    const value = valueAt(made, k, z) & (2 ** bits - 1);
    if (bits === 8) bytes[k] = value;
    else if (syntax === 'big') bytes.writeUInt16BE(value, 2 * k);
    else bytes.writeUInt16LE(value, 2 * k);
  }
  return bytes;
}

const group = (tag: string, elements: Element[], isOpen: boolean): Element => ({
  tag,
  vr: 'SQ',
  value: [elements],
  isOpen,
});

/** Returns the elements of an image, or of one with several frames. */
function elementsOf(made: Made, slices: number[]): Element[] {
  const { syntax, dims, spacing, bits, isSigned, slope, intercept, name, form, isOpen, directions } = made;
  const [first = 0] = slices;
  const short = (tag: string, value: number) => shortElement(syntax, tag, value);
  const position = (z: number) => textElement('00200032', 'DS', positionOf(made, z).join('\\'));
  const bytes = Buffer.concat(slices.map((z) => pixelsOf(made, z)));
  return sorted([
    textElement('00080005', 'CS', 'ISO_IR 192'),
    textElement('00080016', 'UI', '1.2.840.10008.5.1.4.1.1.2'),
    textElement('00080018', 'UI', `1.2.3.${first + 1}`),
    textElement('00080060', 'CS', 'CT'),
    textElement('0008103e', 'LO', name, 'utf8'),
    textElement('00180088', 'DS', String(spacing[2])),
    textElement('0020000d', 'UI', '1.2.4'),
    textElement('0020000e', 'UI', '1.2.5'),
    ...(form === 'frames' ? [] : [position(first)]),
    textElement('00200037', 'DS', directions),
    short('00280002', 1),
    textElement('00280004', 'CS', 'MONOCHROME2'),
    ...(slices.length > 1 ? [textElement('00280008', 'IS', String(slices.length))] : []),
    ...[short('00280010', dims[1]), short('00280011', dims[0])],
    textElement('00280030', 'DS', `${spacing[1]}\\${spacing[0]}`),
    ...[
      short('00280100', bits),
      short('00280101', bits),
      short('00280102', bits - 1),
      short('00280103', isSigned ? 1 : 0),
    ],
    textElement('00281052', 'DS', String(intercept)),
    textElement('00281053', 'DS', String(slope)),
    group('52009229', [group('00209116', [textElement('00200037', 'DS', directions)], isOpen)], isOpen),
    ...(form === 'frames'
      ? [{ tag: '52009230', vr: 'SQ', isOpen, value: slices.map((z) => [group('00209113', [position(z)], isOpen)]) }]
      : []),
    {
      tag: '7fe00010',
      vr: bits === 8 ? 'OB' : 'OW',
      value: bytes.length % 2 ? Buffer.concat([bytes, Buffer.alloc(1)]) : bytes,
    },
  ]);
}

/** Returns the elements of each file of a series. */
function filesOf(made: Made): Element[][] {
  const slices = Array.from({ length: made.dims[2] }, (_, z) => z);
  return made.form === 'files' ? slices.map((z) => elementsOf(made, [z])) : [elementsOf(made, slices)];
}

test('series are read as they were written', LIMITS, async () => {
  const property = fc.asyncProperty(SERIES, fc.nat(), async (made, turn) => {
    const files = filesOf(made).map((elements) => fileOf(elements, made.syntax));
    const rotated = [...files.slice(turn % files.length), ...files.slice(0, turn % files.length)];
    const listing = await openDicom(named(rotated));
    expectListing(listing);
    const [volume] = listing.volumes as [DicomVolume];
    expect([listing.volumes.length, listing.skipped]).toEqual([1, []]);
    expect([volume.dims, volume.name]).toEqual([made.dims, made.name.trim() || 'CT']);
    const init = await volume.read();
    expectInit(init);
    const isNear = (one: number, k: number, other: ArrayLike<number>) => Math.abs(one - (other[k] ?? 0)) < 1e-9;
    holds(
      made.spacing.every((size, axis) => isNear(size, axis, volume.spacing)),
      `spacing ${volume.spacing}`,
    );
    holds(
      made.origin.every((start, axis) => isNear(start, axis, Array.from(init.affine ?? []).slice(12))),
      `affine ${init.affine}`,
    );
    expect([init.slope, init.intercept]).toEqual([made.slope, made.intercept]);
    const each = made.dims[0] * made.dims[1];
    const values = Array.from({ length: each * made.dims[2] }, (_, i) => valueAt(made, i % each, Math.floor(i / each)));
    expect([...init.data]).toEqual(values);
  });
  await fc.assert(property, REPORT);
});

test('any faults in the data sets are survived', LIMITS, async () => {
  const property = fc.asyncProperty(
    SERIES,
    FAULTS,
    DAMAGE,
    fc.nat(),
    fc.boolean(),
    async (made, faults, damage, at, isAll) => {
      const sets = filesOf(made);
      const files = sets.map((elements, k) => {
        if (!isAll && k !== at % sets.length) return fileOf(elements, made.syntax);
        return damaged(fileOf(withFaults(elements, faults), made.syntax), damage);
      });
      await readAny(files);
    },
  );
  await fc.assert(property, REPORT);
});

test('series with missing, repeated and foreign slices', LIMITS, async () => {
  const rest = fc.record({
    missing: fc.nat(),
    again: fc.nat(),
    other: fc.constantFrom('none', 'localiser', 'beside', 'time'),
  });
  const property = fc.asyncProperty(SERIES, rest, async (given, { missing, again, other }) => {
    const made: Made = { ...given, form: 'files', dims: [given.dims[0], given.dims[1], given.dims[2] + 2] };
    const sets = filesOf(made);
    const kept = sets.filter((_, z) => z !== missing % made.dims[2]);
    const copy = kept[again % kept.length] as Element[];
    const changes: Record<string, Element[]> = {
      none: [],
      localiser: [textElement('00200037', 'DS', '0\\0\\1\\1\\0\\0'), textElement('00080018', 'UI', '1.2.9')],
      beside: [textElement('00200032', 'DS', '900\\900\\900'), textElement('00080018', 'UI', '1.2.9')],
      time: [textElement('00080032', 'TM', '101112'), textElement('00080018', 'UI', '1.2.9')],
    };
    const replaced = changes[other] ?? [];
    const foreign = sorted([...copy.filter(({ tag }) => !replaced.some((one) => one.tag === tag)), ...replaced]);
    const files = [...kept, foreign].map((elements) => fileOf(elements, made.syntax));
    await readAny(files);
    if (other !== 'none') return;
    // The copy counts once, and what is missing between others is said.
    const isInner = missing % made.dims[2] > 0 && missing % made.dims[2] < made.dims[2] - 1;
    const { volumes } = await openDicom(named(files));
    expect(volumes.map(({ images, uneven }) => [images, uneven !== undefined])).toEqual([[made.dims[2] - 1, isInner]]);
    expect(volumes[0]?.warnings.map(({ text }) => text).join()).toContain('One file was there twice');
  });
  await fc.assert(property, REPORT);
});

test('any damage of real files is survived', LIMITS, async () => {
  const folders = ['tests/data/dicom', 'tests/data/volumes/segmentation'];
  const samples = folders.flatMap((folder) => readdirSync(folder).map((name) => readFileSync(`${folder}/${name}`)));
  const property = fc.asyncProperty(fc.constantFrom(...samples), DAMAGE, async (sample, damage) => {
    await readAny([damaged(sample, damage)]);
  });
  await fc.assert(property, REPORT);
});

test('what is read as one volume is read again', LIMITS, async () => {
  const property = fc.asyncProperty(SERIES, async (made) => {
    const files = filesOf(made).map((elements) => fileOf(elements, made.syntax));
    const [one, other] = [await readDicom(named(files)), await readDicom(named(files.toReversed()))];
    expect(other).toEqual(one);
  });
  await fc.assert(property, { ...REPORT, numRuns: Math.ceil(REPORT.numRuns / 10) });
});
