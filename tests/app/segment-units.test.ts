/** Parts of the Segment lab that need no browser. */
import { describe, expect, test } from 'vitest';
import { randomNumbers } from '../../bench/random.mjs';
import init, { Volume } from '../../pkg/index.js';
import type { LabelArray } from '../../www/src/engine/labels';
import { freeValue, newLabel, rangeOf, rgbOf } from '../../www/src/engine/labels';
import { withLabels } from '../../www/src/engine/slicer';
import { initialOptions } from '../../www/src/kit/view';
import { UndoStack } from '../../www/src/lab/undo';
import { flood, floodBox, sweep } from '../../www/src/labs/segment/brush';
import { SegmentEditing } from '../../www/src/labs/segment/editing';
import { SEGMENT_EXAMPLES } from '../../www/src/labs/segment/examples';
import { LabelMap } from '../../www/src/labs/segment/label-map';
import { labelHead, labelTooth } from '../../www/src/labs/segment/labelling';
import { fromHash, linkOf, toHash } from '../../www/src/labs/segment/link';
import type { Vec3 } from '../../www/src/labs/segment/protocol';
import { boxOf, grown, union } from '../../www/src/labs/segment/region';
import { openImage } from '../../www/src/labs/segment/source';
import type { ToolSettings } from '../../www/src/labs/segment/tools';
import { SEGMENT_VIEW } from '../../www/src/labs/segment/view';

const DIMS: Vec3 = [9, 7, 5];
const COUNT = DIMS[0] * DIMS[1] * DIMS[2];
const indexOf = ([x, y, z]: Vec3) => (z * DIMS[1] + y) * DIMS[0] + x;
const placeOf = (index: number): Vec3 => [
  index % DIMS[0],
  Math.floor(index / DIMS[0]) % DIMS[1],
  Math.floor(index / (DIMS[0] * DIMS[1])),
];

describe('the brush', () => {
  test('covers the voxels within its radius of the segment, as found by testing all of them', () => {
    const draw = randomNumbers(20261125);
    for (let round = 0; round < 200; round++) {
      const spacing: Vec3 = [1, 1 + draw(), 1 + 3 * draw()];
      const radius = Math.floor(4 * draw());
      const point = () => DIMS.map((size) => (size + 4) * draw() - 2) as Vec3;
      const [from, to] = [point(), point()];
      const found = new Set<number>();
      const box = sweep({ dims: DIMS, spacing }, { radius, axis: undefined }, from, to, (index) => found.add(index));
      const near = Array.from({ length: COUNT }, (_, i) => i).filter(
        (i) => distance(placeOf(i), from, to, spacing) <= radius + 0.5,
      );
      expect(
        [...found].sort((a, b) => a - b),
        `round ${round}`,
      ).toEqual(near);
      const tight = boxOf([...found], DIMS);
      if (tight) expect(union(box, tight)).toEqual(box);
    }
  });

  test('as a disc stays in its slice, and outside the volume reaches nothing', () => {
    const slices = new Set<number>();
    const disc = { radius: 2, axis: 2 as const };
    sweep({ dims: DIMS, spacing: [1, 1, 1] }, disc, [4, 3, 2.3], [6, 3, 2.3], (i) => slices.add(placeOf(i)[2]));
    expect([...slices]).toEqual([2]);
    const out = sweep(
      { dims: DIMS, spacing: [1, 1, 1] },
      { radius: 1, axis: undefined },
      [-9, 0, 0],
      [-5, 0, 0],
      () => {
        throw new Error('reaches a voxel');
      },
    );
    expect(out).toBeUndefined();
  });

  test('of radius 0 reaches the voxel under it', () => {
    const found: number[] = [];
    sweep({ dims: DIMS, spacing: [1, 1, 1] }, { radius: 0, axis: undefined }, [4, 3, 2], [4, 3, 2], (i) =>
      found.push(i),
    );
    expect(found).toEqual([indexOf([4, 3, 2])]);
  });
});

/** Returns the distance of a voxel from a segment by sampling it finely. */
function distance(at: Vec3, from: Vec3, to: Vec3, spacing: Vec3): number {
  const [a, b, p] = [from, to, at].map((point) => point.map((x, axis) => x * (spacing[axis] ?? 1))) as [
    Vec3,
    Vec3,
    Vec3,
  ];
  const along = b.map((x, axis) => x - (a[axis] ?? 0));
  const length = along.reduce((sum, x) => sum + x * x, 0);
  const share = along.reduce((sum, x, axis) => sum + x * ((p[axis] ?? 0) - (a[axis] ?? 0)), 0) / length;
  const t = Math.min(1, Math.max(0, share));
  return Math.hypot(...p.map((x, axis) => x - (a[axis] ?? 0) - t * (along[axis] ?? 0)));
}

test('fill reaches the connected voxels of one label in one slice', () => {
  const voxels = new Uint8Array(COUNT);
  for (let y = 0; y < DIMS[1]; y++) voxels[indexOf([4, y, 2])] = 1;
  voxels[indexOf([6, 6, 2])] = 2;
  const found = new Set<number>();
  const box = flood(voxels, { dims: DIMS }, 2, [6, 3, 2], (index) => found.add(index));
  expect(found.size).toBe(4 * 7 - 1);
  expect([...found].every((index) => placeOf(index)[0] > 4 && placeOf(index)[2] === 2)).toBe(true);
  expect(box).toEqual({ min: [5, 0, 2], dims: [4, 7, 1] });
});

test('fill in three dimensions reaches what repeated growth reaches, within its box and mask', () => {
  const draw = randomNumbers(20261126);
  const isOpen = (at: Vec3, low: Vec3, high: Vec3) => at.every((x, k) => x >= (low[k] ?? 0) && x <= (high[k] ?? 0));
  for (let round = 0; round < 100; round++) {
    const voxels = Uint8Array.from({ length: COUNT }, () => Math.floor(2.5 * draw()) % 2);
    const mask = round % 2 === 0 ? undefined : Uint8Array.from({ length: COUNT }, () => Number(draw() < 0.8));
    const seed = DIMS.map((size) => Math.floor(size * draw())) as Vec3;
    const box = grown({ min: seed, dims: [1, 1, 1] }, 1 + Math.floor(4 * draw()), DIMS);
    const high = box.min.map((low, axis) => low + (box.dims[axis] ?? 0) - 1) as Vec3;
    const label = voxels[indexOf(seed)];
    const reached = new Set<number>();
    const open = (index: number) =>
      voxels[index] === label && (!mask || mask[index] === 1) && isOpen(placeOf(index), box.min, high);
    if (open(indexOf(seed))) reached.add(indexOf(seed));
    for (let before = -1; before < reached.size; ) {
      before = reached.size;
      for (let index = 0; index < COUNT; index++) {
        const at = placeOf(index);
        const isBeside = [...reached].some((one) => {
          const other = placeOf(one);
          return at.reduce((sum, x, axis) => sum + Math.abs(x - (other[axis] ?? 0)), 0) === 1;
        });
        if (isBeside && open(index)) reached.add(index);
      }
    }
    const found: number[] = [];
    const filled = floodBox(voxels, { dims: DIMS }, { box, ...(mask && { mask }) }, seed, (index) => found.push(index));
    expect(found.sort((a, b) => a - b)).toEqual([...reached].sort((a, b) => a - b));
    expect(filled).toEqual(boxOf(found, DIMS));
  }
});

describe('a label map', () => {
  const types: LabelArray[] = [new Uint8Array(COUNT), new Int16Array(COUNT), new Int32Array(COUNT)];

  test.each(types)('restores the voxels of random strokes, back and forth', (voxels) => {
    const draw = randomNumbers(7);
    const map = new LabelMap(DIMS, voxels);
    const stack = new UndoStack<ReturnType<LabelMap['end']>>({ entries: 50, bytes: 1e6 });
    const states = [[...voxels]];
    for (let stroke = 0; stroke < 20; stroke++) {
      for (let i = 0; i < 30; i++) map.set(Math.floor(COUNT * draw()), Math.floor(4 * draw()));
      stack.push({ label: '', bytes: 1, state: map.end() });
      states.push([...voxels]);
    }
    const travel = (direction: 'undo' | 'redo') => {
      const patch = direction === 'undo' ? stack.past : stack.future;
      if (patch) map.exchange(patch);
      stack[direction]({ bytes: 1, state: patch });
      return [...voxels];
    };
    for (let k = 19; k >= 0; k--) expect(travel('undo')).toEqual(states[k]);
    for (let k = 1; k <= 20; k++) expect(travel('redo')).toEqual(states[k]);
    expect([...map.block({ min: [1, 2, 3], dims: [2, 1, 1] }).data]).toEqual(
      [[1, 2, 3] as Vec3, [2, 2, 3] as Vec3].map((at) => voxels[indexOf(at)]),
    );
  });

  test('knows what fits its type', () => {
    expect(types.map(rangeOf)).toEqual([
      [0, 255],
      [-32768, 32767],
      [-(2 ** 31), 2 ** 31 - 1],
    ]);
  });
});

test('boxes of voxels grow within the grid, and unite', () => {
  expect(grown({ min: [1, 0, 4], dims: [2, 3, 1] }, 2, DIMS)).toEqual({ min: [0, 0, 2], dims: [5, 5, 3] });
  expect(union({ min: [0, 5, 1], dims: [1, 1, 1] }, { min: [2, 2, 2], dims: [2, 2, 2] })).toEqual({
    min: [0, 2, 1],
    dims: [4, 4, 3],
  });
});

test('labels have free values and colours of their own', () => {
  const labels = [newLabel(1), newLabel(2), newLabel(4), newLabel(-2)];
  expect(freeValue(labels)).toBe(3);
  expect(new Set(labels.map(({ color }) => color)).size).toBe(4);
  expect(rgbOf({ color: '#0a64ff' })).toEqual([10, 100, 255]);
});

/** Returns intensities of a sphere within another one, around the middle of a grid of 40³. */
function spheres(outer: number, inner: number, [outside, shell, inside]: [number, number, number]): Float32Array {
  return Float32Array.from({ length: 40 ** 3 }, (_, i) => {
    const radius = Math.hypot((i % 40) - 20, (Math.floor(i / 40) % 40) - 20, Math.floor(i / 1600) - 20);
    return radius > outer ? outside : radius > inner ? shell : inside;
  });
}

test('the tooth: what is enclosed is pulp, unless it is open above', () => {
  const count = (labels: Uint8Array, label: number) => labels.filter((one) => one === label).length;
  const intensities = spheres(15, 6, [400, 820, 500]);
  const closed = labelTooth(intensities, [40, 40, 40]);
  const inside = spheres(15, 6, [0, 0, 1]).filter(Boolean).length;
  expect([1, 2, 3].map((label) => count(closed, label))).toEqual([
    0,
    spheres(15, 6, [0, 1, 0]).filter(Boolean).length,
    inside,
  ]);
  // A second, smaller cavity that is open above is a pit.
  for (let z = 30; z < 40; z++)
    for (let y = 18; y < 23; y++) for (let x = 18; x < 23; x++) intensities[(z * 40 + y) * 40 + x] = 400;
  expect(count(labelTooth(intensities, [40, 40, 40]), 3)).toBe(inside);
});

test('the head: bone, without specks', () => {
  const intensities = spheres(15, 9, [0, 60, 120]);
  intensities[5] = 200;
  const labels = labelHead(intensities, [40, 40, 40]);
  const at = (z: number) => labels[(z * 40 + 20) * 40 + 20];
  expect([at(20), at(31), at(38), labels[5]]).toEqual([1, 0, 0, 0]);
});

test('links contain what differs from the defaults, and are parsed again', () => {
  const [, head] = SEGMENT_EXAMPLES;
  const defaults = { smoothing: 20, edge: 1 };
  const settings = {
    example: head,
    file: '',
    params: { smoothing: 5, edge: 1 },
    defaults,
    view: { ...initialOptions(SEGMENT_VIEW), opacity: 0.8 },
  };
  const hash = toHash(linkOf(settings));
  expect(hash).toBe('#segment?example=head&opacity=0.8&p.smoothing=5');
  expect(fromHash(hash)).toEqual({ example: 'head', params: { smoothing: 5 }, view: { opacity: 0.8 } });
  expect(
    toHash(linkOf({ ...settings, example: SEGMENT_EXAMPLES[0], params: defaults, view: initialOptions(SEGMENT_VIEW) })),
  ).toBe('#segment');
  expect(fromHash('#track?example=x')).toBeUndefined();
});

describe('fill', () => {
  const settings: ToolSettings = {
    ...{
      tool: 'fill',
      radius: 0,
      shape: 'ball',
      range: [1, 2],
      extent: 'box',
      reach: 50,
      inRange: true,
      protect: false,
    },
  };

  /** Editing of a map of which the voxels with x = 0 have the label 3; `said` are the reasons of fills that reached nothing. */
  function opened() {
    const said: string[] = [];
    const nothing = () => undefined;
    const lab = {
      onLabels: nothing,
      onVoxels: nothing,
      onUpdate: nothing,
      onBusy: nothing,
      onStopped: nothing,
      onUndo: nothing,
    };
    const client = { request: async () => ({ surfaces: [], milliseconds: 0, done: true }) };
    const editing = new SegmentEditing(client as never, {
      ...{ ...lab, onNothing: (reason) => said.push(reason) },
      onError: (_, error) => {
        throw error;
      },
    });
    const voxels = Uint8Array.from({ length: COUNT }, (_, index) => (placeOf(index)[0] === 0 ? 3 : 0));
    const map = { map: 1, voxels, surfaces: [], known: [], labelFile: undefined, milliseconds: 0, warnings: [] };
    editing.adopt({ dims: DIMS, spacing: [1, 1, 1] }, map, ['One']);
    const filled = () => [...voxels].filter((label) => label === 1).length;
    return { editing, filled, said };
  }

  test('waits until it is known which voxels are in the range of intensities', () => {
    const { editing, filled, said } = opened();
    editing.apply([4, 3, 2], 2, settings);
    editing.apply([8, 3, 2], 2, settings);
    expect(filled()).toBe(0);
    editing.mask = Uint8Array.from({ length: COUNT }, (_, index) => Number(placeOf(index)[0] % 4 === 0));
    expect(filled()).toBe(2 * DIMS[1] * DIMS[2]);
    // Fills that another range or another map makes pointless are not made.
    editing.mask = undefined;
    editing.apply([0, 3, 2], 2, settings);
    editing.mask = undefined;
    editing.mask = new Uint8Array(COUNT).fill(1);
    expect(filled()).toBe(2 * DIMS[1] * DIMS[2]);
    expect(said).toEqual([]);
  });

  test('keeps other labels if told to, and says so', () => {
    for (const extent of ['slice', 'box'] as const) {
      const { editing, filled, said } = opened();
      const kept: ToolSettings = { ...settings, extent, inRange: false, protect: true };
      editing.apply([0, 3, 2], 2, kept);
      expect([filled(), said.length]).toEqual([0, 1]);
      editing.apply([4, 3, 2], 2, kept);
      expect([filled(), said.length]).toEqual([(DIMS[0] - 1) * DIMS[1] * (extent === 'slice' ? 1 : DIMS[2]), 1]);
      editing.apply([0, 3, 2], 2, { ...kept, protect: false });
      expect(filled()).toBeGreaterThan((DIMS[0] - 1) * DIMS[1] * (extent === 'slice' ? 1 : DIMS[2]));
    }
  });
});

test('a volume that looks like a label map is one, too, but a mask may be an image', async () => {
  await init();
  const opened = async (value: (share: number, index: number) => number) => {
    const data = Uint8Array.from({ length: 16 ** 3 }, (_, i) => value(i / 16 ** 3, i));
    const bytes = new Volume({ data, dims: [16, 16, 16] }).toNifti();
    const { map, looksLike } = await openImage({ files: [{ name: 'a.nii', bytes }] } as never);
    return [looksLike, Math.max(...map.voxels)];
  };
  expect(await opened((share) => 4 * share)).toEqual([3, 3]);
  expect(await opened((share) => 2 * share)).toEqual([1, 0]);
  expect(await opened((_, index) => index % 7)).toEqual([0, 0]);
});

test('a volume whose name alone says that it is a label map opens as an image, and says so', async () => {
  await init();
  const data = Uint8Array.from({ length: 16 ** 3 }, (_, i) => i % 7);
  const warnings = async (name: string, values: Uint8Array | Float32Array = data) => {
    const bytes = new Volume({ data: values, dims: [16, 16, 16] }).toNifti();
    return (await openImage({ files: [{ name, bytes }] } as never)).map.warnings;
  };
  expect(await warnings('labels.nii')).toMatchObject([
    { code: 'reader', text: expect.stringContaining('labels.nii is open as an image') },
  ]);
  expect(await warnings('a.nii')).toEqual([]);
  expect(
    await warnings(
      'labels.nii',
      Float32Array.from(data, (one) => one + 0.5),
    ),
  ).toEqual([]);
});

test('a label map of more labels than the list can show is refused', async () => {
  await init();
  const side = 17;
  const file = (name: string, labels: number) => {
    const data = Uint16Array.from({ length: side ** 3 }, (_, i) => i % labels);
    return { name, bytes: new Volume({ data, dims: [side, side, side] }).toNifti() };
  };
  const opened = (labels: number) => openImage({ files: [file('a.nii', 300), file('label.nii', labels)] } as never);
  const { map } = await opened(4001);
  expect(Math.max(...map.voxels)).toBe(4000);
  await expect(opened(4002)).rejects.toThrow('4001 labels; the app shows at most 4000');
});

test('labels that a small file describes count, even without voxels', async () => {
  await init();
  const data = Uint16Array.from({ length: 512 }, (_, i) => Number(i > 300));
  const opened = (count: number, isSmall: boolean) => {
    const labels = Array.from({ length: count }, (_, i) => ({ value: i + 1, name: `part ${i}`, color: '#ff0000' }));
    const bytes = withLabels(new Volume({ data, dims: [8, 8, 8] }).toBytes('nrrd'), labels, [8, 8, 8]);
    return openImage({ files: [{ name: 'a.seg.nrrd', bytes }] } as never, isSmall);
  };
  expect((await opened(400, true)).map.known.length).toBe(400);
  await expect(opened(401, true)).rejects.toThrow('401');
  expect((await opened(401, false)).map.known.length).toBe(401);
  await expect(opened(4001, false)).rejects.toThrow('4001 labels; the app shows at most 4000');
});
