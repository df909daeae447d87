import type { ParamValues, Unit, Vec3 } from '../../engine/protocol';
import { text } from '../../texts';
import { type CineSpec, centreOf } from './cine';
import type { Box, Preparation } from './protocol';

/** An example of the Track lab: a 4D image, suitable settings and credits. */
export interface TrackExample {
  id: string;
  name: string;
  source: { file: string } | { cine: CineSpec };
  unit: Unit;
  preparation: Preparation;
  box?: Box;
  at?: Vec3;
  /** Initial position of the crosshair in world coordinates; by default `at`. */
  crosshair?: Vec3;
  params: ParamValues;
  credit: string;
}

/** Neither binning nor in-between slices, for images with nearly cubic voxels. */
const PLAIN: Preparation = { binning: 1, enrichment: 'none', factor: 0 };

/** Default preparation of the user's own images: in-between slices are inserted where slices are thick. */
export const OWN_PREPARATION: Preparation = { binning: 1, enrichment: 'flow', factor: 0 };

/** A point in the blood of the left ventricle of the measured heart, world coordinates (mm). */
const LEFT_VENTRICLE: Vec3 = [1.47, 37.05, -13.99];
/** Returns a region of interest: the cube around a point, with its faces at the distance `reach`. */
const around = (middle: Vec3, reach: number): Box => ({
  min: middle.map((x) => x - reach) as Vec3,
  max: middle.map((x) => x + reach) as Vec3,
});

export const HEART_CREDIT = text('trackPresets.heartCredit');

/** Image and settings of the example with a measured heart, which all presets use, too. */
export const HEART = {
  source: { file: 'heart.nii.gz' },
  unit: 'mm',
  preparation: { binning: 1, enrichment: 'flow', factor: 0 },
  // From the apex to below the valves, where the signal is weak and the blood is connected to that of the next chamber.
  box: { min: [38.01, 78.55, -16.5], max: [-41.86, 5.87, -24.59] },
  at: LEFT_VENTRICLE,
  crosshair: LEFT_VENTRICLE,
  params: { threshold: 25, cyclic: true },
  credit: HEART_CREDIT,
} satisfies Partial<TrackExample>;

const VENTRICLE: CineSpec = {
  dims: [36, 36, 36],
  spacing: [2, 2, 2],
  frames: 12,
  noise: 8,
  size: 24,
  papillary: false,
};
const THICK: CineSpec = { dims: [48, 48, 12], spacing: [1.6, 1.6, 5], frames: 12, noise: 8, size: 26, papillary: true };

/** The examples of the Track lab. The first one opens by default. */
export const IMAGES: [TrackExample, ...TrackExample[]] = [
  { id: 'heart', name: text('trackPresets.heartName'), ...HEART },
  {
    id: 'ventricle',
    name: text('trackPresets.ventricleName'),
    source: { cine: VENTRICLE },
    unit: 'mm',
    preparation: PLAIN,
    box: around(centreOf(VENTRICLE), 29),
    at: centreOf(VENTRICLE),
    params: { threshold: 60, cyclic: true },
    credit: text('trackPresets.ventricleCredit'),
  },
  {
    id: 'thick-slices',
    name: text('trackPresets.thickSlicesName'),
    source: { cine: THICK },
    unit: 'mm',
    preparation: { binning: 1, enrichment: 'flow', factor: 0 },
    box: around(centreOf(THICK), 32),
    at: centreOf(THICK),
    params: { threshold: 60, cyclic: true },
    credit: text('trackPresets.thickSlicesCredit'),
  },
];
