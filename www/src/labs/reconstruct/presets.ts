/**
 * Presets of the Reconstruct lab: the figures of the paper by Dinh, Turk and Slabaugh, on points that are served with
 * the page or computed in it.
 */
import { text } from '../../texts';
import { CLOUDS, type CloudExample, PAPER } from './examples';
import type { ParamValues } from './protocol';

/**
 * Expected number of components or genus of a surface; a range where rounding errors decide into how many pieces the
 * surface breaks.
 */
export type Count = number | readonly [least: number, most: number];

/** Expected surface of a preset's variant, one picture of a figure; tests run the variant and compare. */
export interface CloudOutcome {
  components: Count;
  genus: Count;
  /**
   * Mean of the absolute mean curvature |H| over the vertices, in 1 / the points' unit; tests allow a deviation of
   * 10 %.
   */
  meanCurvature?: number;
  /** Mean distance of the points from the surface, in the points' units; tests allow a deviation of 10 %. */
  fitness?: number;
}

/** One picture of a figure, as a variant of the preset: the same points with other settings. */
export interface CloudVariant {
  id: string;
  name: string;
  params: ParamValues;
  maxPoints?: number;
  ourResult: string;
  expected: CloudOutcome;
}

/** A figure of the paper, as an example of the Reconstruct lab, with a variant for each of its pictures. */
export interface CloudPreset extends CloudExample {
  paperResult: string;
  variants: [CloudVariant, ...CloudVariant[]];
  hint?: string;
  /** Index, from 0, of the photograph whose camera the preset's view uses; undefined for the usual view. */
  photo?: number;
}

const CARVED = text('reconstructPresets.carvedCredit');
const STEREO = text('reconstructPresets.stereoCredit');
/**
 * Settings shared by the presets that use the carved cow: its points on a voxel grid, of which a subsample is used, as
 * in the paper.
 */
const CARVED_COW = {
  source: { file: 'spot/carved.ply' },
  photographs: 'spot',
  up: 'y',
  front: -1,
  maxPoints: 3000,
  view: { color: 'own' },
  credit: CARVED,
} as const;
const STEREO_COW = {
  source: { file: 'spot/stereo.ply' },
  photographs: 'spot',
  up: 'y',
  front: -1,
  keepComponents: 1,
  view: { color: 'own' },
  credit: STEREO,
} as const;

export const CLOUD_PRESETS: CloudPreset[] = [
  {
    id: 'figure-2',
    name: text('reconstructPresets.figure2Name'),
    source: { shape: 'cube corner' },
    up: 'z',
    front: -1,
    params: { ...PAPER, kernel: 'thin-plate' },
    view: { color: 'mean curvature' },
    credit: text('reconstructPresets.figure2Credit'),
    paperResult: text('reconstructPresets.figure2Paper'),
    variants: [
      {
        id: '2b',
        name: 'λ = 0.001',
        params: {},
        ourResult: text('reconstructPresets.figure2bHere'),
        expected: { components: 1, genus: 0, meanCurvature: 3.59 },
      },
      {
        id: '2a',
        name: 'λ = 0',
        params: { lambdaSurface: 0 },
        ourResult: text('reconstructPresets.figure2aHere'),
        expected: { components: [3, 12], genus: [70, 140], meanCurvature: 19.6 },
      },
      {
        id: '2c',
        name: 'λ = 0.03',
        params: { lambdaSurface: 0.03 },
        ourResult: text('reconstructPresets.figure2cHere'),
        expected: { components: 1, genus: 0, meanCurvature: 2.09 },
      },
      {
        id: '2d',
        name: 'λ = 2',
        params: { lambdaSurface: 2 },
        ourResult: text('reconstructPresets.figure2dHere'),
        expected: { components: 1, genus: 0, meanCurvature: 1.88, fitness: 0.0149 },
      },
    ],
    hint: text('reconstructPresets.figure2Hint'),
  },
  {
    id: 'figure-3',
    name: text('reconstructPresets.figure3Name'),
    ...CARVED_COW,
    params: PAPER,
    paperResult: text('reconstructPresets.figure3Paper'),
    variants: [
      {
        id: '3e',
        name: text('reconstructPresets.figure3eName'),
        params: {},
        ourResult: text('reconstructPresets.figure3eHere'),
        expected: { components: 1, genus: 0, meanCurvature: 3.61 },
      },
      {
        id: '3b',
        name: text('reconstructPresets.figure3bName'),
        params: { kernel: 'thin-plate', lambdaSurface: 0 },
        ourResult: text('reconstructPresets.figure3bHere'),
        expected: { components: [35, 70], genus: [75, 145], meanCurvature: 14.9 },
      },
      {
        id: '3c',
        name: text('reconstructPresets.figure3cName'),
        params: { kernel: 'thin-plate' },
        ourResult: text('reconstructPresets.figure3cHere'),
        expected: { components: [2, 6], genus: [3, 9], meanCurvature: 3.87 },
      },
      {
        id: '3d',
        name: text('reconstructPresets.figure3dName'),
        params: { kernel: 'gaussian' },
        ourResult: text('reconstructPresets.figure3dHere'),
        expected: { components: [110, 200], genus: [50, 95], meanCurvature: 25.3 },
      },
    ],
    hint: text('reconstructPresets.figure3Hint'),
  },
  {
    id: 'figure-4',
    name: text('reconstructPresets.figure4Name'),
    source: { shape: 'torus' },
    up: 'z',
    params: { ...PAPER, delta: 10, tau: 0.01 },
    credit: text('reconstructPresets.figure4Credit'),
    paperResult: text('reconstructPresets.figure4Paper'),
    variants: [
      {
        id: '4b',
        name: 'δ = 10, τ = 0.01',
        params: {},
        ourResult: text('reconstructPresets.figure4bHere'),
        expected: { components: 1, genus: 1, meanCurvature: 2.72 },
      },
      {
        id: '4c',
        name: 'δ = 10, τ = 0.025',
        params: { tau: 0.025 },
        ourResult: text('reconstructPresets.figure4cHere'),
        expected: { components: 1, genus: 1, meanCurvature: 2.08 },
      },
      {
        id: '4b2',
        name: 'δ = 40, τ = 0.01',
        params: { delta: 40 },
        ourResult: text('reconstructPresets.figure4b2Here'),
        expected: { components: 1, genus: 1, meanCurvature: 4.42 },
      },
      {
        id: '4a',
        name: text('reconstructPresets.figure4aName'),
        params: { kernel: 'thin-plate' },
        ourResult: text('reconstructPresets.figure4aHere'),
        expected: { components: [1, 3], genus: [3, 12], meanCurvature: 1.82 },
      },
    ],
    hint: text('reconstructPresets.figure4Hint'),
  },
  {
    id: 'figure-5',
    name: text('reconstructPresets.figure5Name'),
    ...CARVED_COW,
    params: { ...PAPER, delta: 10, tau: 0.025 },
    paperResult: text('reconstructPresets.figure5Paper'),
    variants: [
      {
        id: '5b',
        name: text('reconstructPresets.figure5bName'),
        params: {},
        ourResult: text('reconstructPresets.figure5bHere'),
        expected: { components: 1, genus: 0, meanCurvature: 3.54 },
      },
      {
        id: '5c',
        name: 'τ = 0.01',
        params: { tau: 0.01 },
        ourResult: text('reconstructPresets.figure5cHere'),
        expected: { components: 1, genus: 0, meanCurvature: 3.88 },
      },
    ],
  },
  {
    id: 'figure-7',
    name: text('reconstructPresets.figure7Name'),
    ...CARVED_COW,
    maxPoints: 20_000,
    params: PAPER,
    paperResult: text('reconstructPresets.figure7Paper'),
    variants: [
      {
        id: '7l',
        name: text('reconstructPresets.figure7lName'),
        params: {},
        ourResult: text('reconstructPresets.figure7lHere'),
        expected: { components: 1, genus: 0, fitness: 0.00533 },
      },
      {
        id: '7r',
        name: text('reconstructPresets.figure7rName'),
        params: {},
        maxPoints: 1040,
        ourResult: text('reconstructPresets.figure7rHere'),
        expected: { components: 1, genus: 0, fitness: 0.00722 },
      },
    ],
  },
  {
    id: 'figure-8',
    name: text('reconstructPresets.figure8Name'),
    ...STEREO_COW,
    maxPoints: 2168,
    params: { ...PAPER, delta: 10, tau: 0.01, lambdaSurface: 0.002 },
    view: { color: 'own', constraints: true },
    paperResult: text('reconstructPresets.figure8Paper'),
    variants: [
      {
        id: '8',
        name: text('reconstructPresets.figure8PictureName'),
        params: {},
        ourResult: text('reconstructPresets.figure8PictureHere'),
        expected: { components: 1, genus: 0, meanCurvature: 3.51, fitness: 0.00934 },
      },
      {
        id: '8l',
        name: 'λ = 0.001',
        params: { lambdaSurface: 0.001 },
        ourResult: text('reconstructPresets.figure8lHere'),
        expected: { components: 1, genus: 1, meanCurvature: 4.23, fitness: 0.00891 },
      },
      {
        id: '8all',
        name: text('reconstructPresets.figure8AllName'),
        params: { delta: 5, tau: 0.025, lambdaSurface: 0.001 },
        maxPoints: 20_000,
        ourResult: text('reconstructPresets.figure8AllHere'),
        expected: { components: 1, genus: 0 },
      },
    ],
    hint: text('reconstructPresets.figure8Hint'),
  },
  {
    id: 'figure-9',
    name: text('reconstructPresets.figure9Name'),
    ...STEREO_COW,
    params: PAPER,
    photo: 3,
    view: { color: 'own', points: false },
    paperResult: text('reconstructPresets.figure9Paper'),
    variants: [
      {
        id: '9',
        name: text('reconstructPresets.figure9PictureName'),
        params: {},
        ourResult: text('reconstructPresets.figure9PictureHere'),
        expected: { components: 1, genus: 0 },
      },
    ],
    hint: text('reconstructPresets.figure9Hint'),
  },
  {
    id: 'figure-10',
    name: text('reconstructPresets.figure10Name'),
    ...CARVED_COW,
    params: { ...PAPER, delta: 10, tau: 0.01 },
    paperResult: text('reconstructPresets.figure10Paper'),
    variants: [
      {
        id: '10',
        name: text('reconstructPresets.figure10PictureName'),
        params: {},
        ourResult: text('reconstructPresets.figure10PictureHere'),
        expected: { components: 1, genus: 0, meanCurvature: 3.88 },
      },
    ],
  },
];

/** Returns the Reconstruct lab's example or preset with this id, undefined if there is none. */
export function cloudById(id: string): CloudExample | undefined {
  return [...CLOUDS, ...CLOUD_PRESETS].find((one) => one.id === id);
}

export function isCloudPreset(example: CloudExample | undefined): example is CloudPreset {
  return example !== undefined && 'variants' in example;
}

/**
 * Returns the first variant of a figure that the current settings match, to mark its button; undefined if none does.
 * Parameters that neither the variant nor the figure sets must equal `defaults`.
 */
export function variantInForce(
  preset: CloudPreset,
  params: ParamValues,
  maxPoints: number | undefined,
  defaults: ParamValues,
): CloudVariant | undefined {
  return preset.variants.find(
    (one) =>
      (one.maxPoints ?? preset.maxPoints) === maxPoints &&
      Object.entries({ ...defaults, ...preset.params, ...one.params }).every(([name, value]) =>
        Object.is(params[name], value),
      ),
  );
}
