/**
 * The figures of the Track lab: results are as the page says. Run with the package in Node, which gives the same bits.
 */
import { readFile } from 'node:fs/promises';
import { afterAll, beforeAll, expect, test } from 'vitest';
import init, { paramSpecs, type SurfaceTracker, Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { voxelsOf } from '../../www/src/labs/track/box';
import { canny } from '../../www/src/labs/track/canny';
import { beatOf } from '../../www/src/labs/track/curve';
import { interpolateSlice } from '../../www/src/labs/track/interpolate-slice';
import { setupOf } from '../../www/src/labs/track/link';
import { imageById, isTrackPreset, TRACK_PRESETS, variantInForce } from '../../www/src/labs/track/presets';
import { buildTracker, openImage, prepare } from '../../www/src/labs/track/source';
import { votesIn } from '../../www/src/labs/track/votes';
import { invert, sliceOrientations } from '../../www/src/scene/anatomy';
import { LONG } from './long';

let film: Volume;
let volume: Volume;
let tracker: SurfaceTracker;
/** State with the boundaries of all frames, before any surface is found. */
let bounded: Uint8Array;

const [FIGURE] = TRACK_PRESETS;
const setup = setupOf(FIGURE);

beforeAll(async () => {
  await init();
  film = Volume.parse(new Uint8Array(await readFile(at('www/public/data/heart.nii.gz'))));
  volume = prepare(film, setup.preparation, () => undefined);
  tracker = buildTracker(volume, setup, false).tracker;
  tracker.step(tracker.frames);
  bounded = tracker.save();
});
afterAll(() => {
  for (const one of [tracker, volume, film]) one?.free();
});

const figure = (id: string) => {
  const preset = imageById(id);
  if (!isTrackPreset(preset)) throw new Error(`there is no ${id}`);
  return preset;
};

test.each(TRACK_PRESETS.map((preset) => [preset.id, preset] as const))('%s has the same setup', (_, preset) => {
  expect(setupOf(preset)).toEqual(setup);
});

test.each(TRACK_PRESETS.flatMap((preset) => preset.variants.map((one) => [one.id, preset, one] as const)))(
  'the settings of figure %s are recognised as its own',
  (_, preset, variant) => {
    const usual = Object.fromEntries(paramSpecs('tracking').map(({ name, default: value }) => [name, value]));
    const params = { ...usual, ...preset.params, ...variant.params };
    expect(variantInForce(preset, params, { ...preset.params })?.id).toBe(variant.id);
    expect(variantInForce(preset, { ...params, threshold: 77 }, { ...preset.params })).toBeUndefined();
  },
);

test('figure 2: the surface of the first frame runs through the shell of its points', () => {
  tracker.step(1);
  const mesh = tracker.meshAt(0);
  const { positions } = mesh.arrays();
  const { vertices, volume: enclosed } = mesh.info();
  mesh.free();
  const points = tracker.boundary(0);
  const far = [...Array(200).keys()].filter((i) => {
    const v = 3 * Math.floor((i / 200) * vertices);
    for (let p = 0; p < points.length; p += 5) {
      const off = [0, 1, 2].map((k) => (points[p + k] ?? 0) - (positions[v + k] ?? 0));
      if (Math.hypot(...off) < 3) return false;
    }
    return true;
  });
  expect(far.length).toBeLessThan(80);
  expect(enclosed).toBeGreaterThan(30_000);
});

test('figure 3: in this heart prediction makes little difference', () => {
  const [, without] = figure('figure-3').variants;
  tracker.step(3);
  const [predicted, present] = [tracker.volumes(), tracker.save()];
  tracker.restore(bounded);
  tracker.setParams({ ...without?.params });
  tracker.step(4);
  for (const [i, volume] of tracker.volumes().entries())
    expect(Math.abs(volume / (predicted[i] ?? 1) - 1)).toBeLessThan(0.05);
  tracker.restore(present);
});

test('figure 3: in thick slices projections take more steps without prediction', LONG, async () => {
  expect(await stepsIn(true)).toBeLessThan(0.95 * (await stepsIn(false)));
});

/** Returns the mean number of projection steps in the first frames of the computed ventricle in thick slices. */
async function stepsIn(prediction: boolean): Promise<number> {
  const example = imageById('thick-slices');
  if (!example || !('cine' in example.source)) throw new Error('there is no computed ventricle');
  const setup = setupOf(example);
  const film = await openImage(example.source);
  const image = prepare(film, setup.preparation, () => undefined);
  const { tracker } = buildTracker(image, { ...setup, params: { ...setup.params, prediction } }, false);
  tracker.step(tracker.frames + 5);
  const later = tracker.statistics.slice(1);
  for (const one of [tracker, image, film]) one.free();
  return later.reduce((sum, { steps }) => sum + steps, 0) / later.length;
}

test('figure 4: the boundary of a slice goes around the ventricle, where Canny’s has gaps', () => {
  const inverse = invert(volume.affine);
  const view = { dims: volume.dims, spacing: volume.spacing, affine: volume.affine, space: volume.space };
  const [, , side] = sliceOrientations(view);
  if (!side) throw new Error('a volume has three axes');
  const all = tracker.boundary(0);
  const count = all.length / 5;
  const votes = {
    frame: 0,
    points: Float32Array.from({ length: 3 * count }, (_, i) => all[5 * Math.floor(i / 3) + (i % 3)] ?? 0),
    weights: Float32Array.from({ length: count }, (_, i) => all[5 * i + 4] ?? 0),
  };
  const slice = 14;
  const on = { volume: view as Parameters<typeof votesIn>[1]['volume'], inverse, orientation: side, slice };
  const strong = votesIn(votes, on).filter(({ weight }) => weight > 0.3);
  expect(strong.length).toBeGreaterThan(100);
  const [width, height] = volume.dims;
  const edges = canny({ width, height, values: volume.slice(2, slice, 0) }, { deviation: 1, low: 6, high: 14 });
  expect(edges.reduce((sum, one) => sum + one, 0)).toBeGreaterThan(50);
  const { low, high } = voxelsOf(setup.box ?? { min: [0, 0, 0], max: [1, 1, 1] }, inverse, volume.dims);
  expect(high.map((to, k) => to - (low[k] ?? 0)).every((length) => length > 13)).toBe(true);
});

test('figure 5: optical flow replaces a left-out slice better than linear interpolation', () => {
  const inner = Array.from(
    { length: film.dims[2] - 2 },
    (_, i) => interpolateSlice(film, 0, i + 1, film.range).rmsError,
  );
  const mean = (of: 'flow' | 'linear') => inner.reduce((sum, off) => sum + off[of], 0) / inner.length;
  expect(mean('flow')).toBeLessThan(0.83 * mean('linear'));
});

test('figure 6: the ventricle contracts and fills once per beat, closed and without self-intersections', () => {
  let done = false;
  while (!done) done = tracker.step(1).done;
  // The box ends at the valve, and muscles are no part of an open cavity.
  expect(film.warnings).toEqual([]);
  expect(tracker.mesh.warnings.map(({ code }) => code)).toEqual(['touches-box', 'handles']);
  const volumes = [...tracker.volumes()];
  const beat = beatOf(volumes);
  expect(beat?.systole).toBeGreaterThan(8);
  expect(beat?.systole).toBeLessThan(17);
  expect(beat?.ejection).toBeGreaterThan(0.2);
  expect(beat?.ejection).toBeLessThan(0.6);
  const [down, up] = [volumes.slice(0, (beat?.systole ?? 0) + 1), volumes.slice(beat?.systole)];
  for (const [i, volume] of down.slice(1).entries()) expect(volume).toBeLessThan(1.05 * (down[i] ?? 0));
  for (const [i, volume] of up.slice(1).entries()) expect(volume).toBeGreaterThan(0.95 * (up[i] ?? 0));
  for (const frame of [0, beat?.systole ?? 0]) {
    const mesh = tracker.meshAt(frame);
    expect(mesh.check()).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
    mesh.free();
  }
});
