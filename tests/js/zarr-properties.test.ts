/** `vesicle/zarr` with generated and damaged metadata: the image that was written, or a refusal in words. */
import fc from 'fast-check';
import { expect, test } from 'vitest';
import { openZarr } from '../../pkg/zarr/index.js';
import { bounded, expectTexts, holds, isSize, LIMITS, REPORT } from './properties.js';

/** An image as it is written, with vectors in the order of its axes. */
interface Made {
  version: 2 | 3;
  axes: ('t' | 'c' | 'z' | 'y' | 'x')[];
  /** Numbers of voxels of each level. */
  shapes: number[][];
  scales: number[][];
  type: 'uint8' | 'uint16' | 'int16' | 'float32';
  unit: string | undefined;
}

type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

const AXES = fc.constantFrom<Made['axes'][]>(
  ['z', 'y', 'x'],
  ['y', 'x'],
  ['c', 'z', 'y', 'x'],
  ['t', 'c', 'z', 'y', 'x'],
  ['x', 'y', 'z'],
);

const IMAGE: fc.Arbitrary<Made> = fc
  .record({ axes: AXES, levels: fc.integer({ min: 1, max: 3 }), seed: fc.nat(0xffff) })
  .chain(({ axes, levels, seed }) =>
    fc.record({
      version: fc.constantFrom<Made['version'][]>(2, 3),
      axes: fc.constant(axes),
      shapes: fc.constant(
        Array.from({ length: levels }, (_, level) =>
          axes.map((name, axis) => sizeAt(seed, axis) >> ('xyz'.includes(name) ? level : 0) || 1),
        ),
      ),
      scales: fc.constant(
        Array.from({ length: levels }, (_, level) =>
          axes.map((name, axis) => ((seed % (7 + axis)) + 1) * 2 ** ('xyz'.includes(name) ? level : 0)),
        ),
      ),
      type: fc.constantFrom<Made['type'][]>('uint8', 'uint16', 'int16', 'float32'),
      unit: fc.constantFrom('millimeter', 'micrometer', undefined),
    }),
  );

const sizeAt = (seed: number, axis: number) => 2 + ((seed >> axis) % 14);

/** Returns the metadata of an image, by file: those of the group, and of the array of each level. */
function metadataOf(made: Made): Map<string, Json> {
  const { version, axes, shapes, scales, unit } = made;
  const types = { t: 'time', c: 'channel', z: 'space', y: 'space', x: 'space' };
  const multiscale = {
    ...(version === 2 && { version: '0.4' }),
    axes: axes.map((name) => ({ name, type: types[name], ...(unit && types[name] === 'space' && { unit }) })),
    datasets: shapes.map((_, level) => ({
      path: `s${level}`,
      coordinateTransformations: [{ type: 'scale', scale: scales[level] ?? [] }],
    })),
  };
  const arrays = shapes.map((shape, level): [string, Json] =>
    version === 2
      ? [`/s${level}/.zarray`, arrayOfTwo(made, shape)]
      : [`/s${level}/zarr.json`, arrayOfThree(made, shape)],
  );
  if (version === 2)
    return new Map<string, Json>([
      ['/.zgroup', { zarr_format: 2 }],
      ['/.zattrs', { multiscales: [multiscale] }],
      ...arrays,
    ]);
  const ome = { version: '0.5', multiscales: [multiscale] };
  return new Map<string, Json>([
    ['/zarr.json', { zarr_format: 3, node_type: 'group', attributes: { ome } }],
    ...arrays,
  ]);
}

const chunksOf = (shape: number[]) => shape.map((size) => Math.min(size, 8));

function arrayOfTwo({ type }: Made, shape: number[]): Json {
  const dtype = { uint8: '|u1', uint16: '<u2', int16: '<i2', float32: '<f4' }[type];
  const rest = { compressor: null, filters: null, fill_value: 0, order: 'C', dimension_separator: '/' };
  return { zarr_format: 2, shape, chunks: chunksOf(shape), dtype, ...rest };
}

function arrayOfThree({ type, axes }: Made, shape: number[]): Json {
  return {
    ...{ zarr_format: 3, node_type: 'array', shape, data_type: type, fill_value: 0, attributes: {} },
    chunk_grid: { name: 'regular', configuration: { chunk_shape: chunksOf(shape) } },
    chunk_key_encoding: { name: 'default', configuration: { separator: '/' } },
    codecs: [{ name: 'bytes', configuration: { endian: 'little' } }],
    dimension_names: axes,
  };
}

/** A store of metadata without chunks: all voxels have the fill value. */
function storeOf(metadata: Map<string, Json>) {
  const bytesOf = (value: Json | undefined) =>
    value === undefined ? undefined : new TextEncoder().encode(JSON.stringify(value));
  return { get: async (key: string) => bytesOf(metadata.get(key)) };
}

/** Opens the image that metadata describe, unless they are refused, and tests what holds for any image. */
async function openAny(metadata: Map<string, Json>): Promise<void> {
  const image = await bounded(() => openZarr(storeOf(metadata), { retries: 0 }));
  if (image instanceof Error) return;
  holds(image.levels.length > 0 && image.levels.length <= 32, `${image.levels.length} levels`);
  for (const { dims, chunks, spacing, affine } of image.levels) {
    holds([...dims, ...chunks].every(isSize), `${dims} in ${chunks}`);
    holds(
      spacing.every((one) => one > 0 && Number.isFinite(one)),
      `spacing ${spacing}`,
    );
    holds(affine.every(Number.isFinite), `affine ${affine}`);
  }
  expectTexts(image.warnings.map((warning) => warning.text));
  image.free();
}

test('images have the sizes, voxels and types that were written', LIMITS, async () => {
  const property = fc.asyncProperty(IMAGE, async (made) => {
    const image = await openZarr(storeOf(metadataOf(made)), { retries: 0 });
    const millimetres = made.unit === 'micrometer' ? 1e-3 : 1;
    for (const [level, { dims, spacing, voxelType }] of image.levels.entries()) {
      const along = (values: number[] | undefined, otherwise: number) =>
        (['x', 'y', 'z'] as const).map((axis) => values?.[made.axes.indexOf(axis)] ?? otherwise);
      expect(dims).toEqual(along(made.shapes[level], 1));
      const expected = along(made.scales[level], 1);
      const known = made.axes.includes('z') ? 3 : 2;
      for (let axis = 0; axis < known; axis++)
        expect(spacing[axis]).toBeCloseTo((expected[axis] ?? 1) * millimetres, 9);
      expect(voxelType).toBe({ uint8: 'u8', uint16: 'u16', int16: 'i16', float32: 'f32' }[made.type]);
    }
    expect(image.levels).toHaveLength(made.shapes.length);
    image.free();
  });
  await fc.assert(property, REPORT);
});

/** Values that no field expects, or that are at the ends of what it accepts. */
const ODD: fc.Arbitrary<Json> = fc.constantFrom<Json[]>(
  ...[null, true, 0, -1, 1.5, 1e-300, 1e300, 2 ** 31, 2 ** 53, '', '0', 'x', 'constructor', '__proto__', [], {}],
  ...[[[]], [null], { type: 'scale', scale: [1e308, 1e308, 1e308] }, 'a'.repeat(5000), Array(500).fill('x')],
  ...[Array(3).fill(0), Array(3).fill(2 ** 31), Array(40).fill({ path: 's0', coordinateTransformations: [] })],
);

/** A change of one node: which, and how. */
const FAULT = fc.record({
  file: fc.nat(5),
  steps: fc.array(fc.nat(9), { minLength: 1, maxLength: 8 }),
  how: fc.constantFrom<('replace' | 'remove' | 'copy' | 'wrap')[]>('replace', 'replace', 'remove', 'copy', 'wrap'),
  value: ODD,
});

/** Changes the node at the end of a walk that takes the k-th entry at each step, until there is none. */
function changeNode(root: Json, { steps, how, value }: { steps: number[]; how: string; value: Json }): Json {
  const [step = 0, ...rest] = steps;
  if (typeof root !== 'object' || root === null) return how === 'wrap' ? [root] : value;
  const keys = Object.keys(root);
  const key = keys[step % keys.length];
  if (key === undefined) return value;
  const node = (root as { [key: string]: Json })[key] as Json;
  const isLast = rest.length === 0 || typeof node !== 'object' || node === null;
  const changed = isLast ? { replace: value, wrap: [node], copy: node, remove: null }[how] : undefined;
  const put = (isLast ? changed : changeNode(node, { steps: rest, how, value })) as Json;
  if (Array.isArray(root)) {
    const [before, after] = [root.slice(0, Number(key)), root.slice(Number(key) + 1)];
    if (isLast && how === 'remove') return [...before, ...after];
    return isLast && how === 'copy' ? [...before, node, node, ...after] : [...before, put, ...after];
  }
  const { [key]: _, ...others } = root;
  return isLast && how === 'remove' ? others : { ...root, [key]: put };
}

test('any faults in metadata are survived', LIMITS, async () => {
  const faults = fc.array(FAULT, { minLength: 1, maxLength: 4 });
  const property = fc.asyncProperty(IMAGE, faults, async (made, list) => {
    const metadata = metadataOf(made);
    for (const fault of list) {
      const file = [...metadata.keys()][fault.file % metadata.size] ?? '';
      metadata.set(file, changeNode(metadata.get(file) ?? null, fault));
    }
    await openAny(metadata);
  });
  await fc.assert(property, REPORT);
});
