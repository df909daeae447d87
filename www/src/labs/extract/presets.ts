/**
 * Presets of the Extract lab: figures of the paper by Lachaud and Montanvert, on volumes that are served with the page
 * or computed in it.
 */

import type { ParamValues } from '../../engine/protocol';
import { text } from '../../texts';
import { EXAMPLES, type Example } from './examples';

/** Expected result of running a variant of a figure until the model converges; tests run the variant and compare. */
export interface Outcome {
  iterations: number;
  vertices: number;
  components: number;
  genus: number;
}

/**
 * One picture of a figure of the paper, which a button selects: the preset's volume, with the picture's own parameters.
 */
export interface Variant {
  id: string;
  /** Label of the button that selects the variant. */
  name: string;
  params: ParamValues;
  /** Result of the variant in this app, as a sentence; displayed below the result reported in the paper. */
  ourResult: string;
  expected: Outcome;
}

/** A figure of the paper, as an example of the Extract lab. */
export interface Preset extends Example {
  start: { kind: 'enclosing' } | { kind: 'bubbles'; bubbles: number } | { kind: 'isosurface' };
  /** Result of the figure reported in the paper, as a sentence to display. */
  paperResult: string;
  /** The pictures of the figure; the preset opens with the first. */
  variants: [Variant, ...Variant[]];
  /**
   * Whether choosing another variant restarts the model; by default the present surface continues with the new
   * parameters.
   */
  startsOver?: boolean;
  /** Advice to the user on what to look at next, such as a panel of the page; displayed with the figure. */
  hint?: string;
  /** Whether the figure compares a direct with a coarse-to-fine run; if so, the panel of that comparison is opened. */
  compares?: boolean;
}

const ENCLOSING = { kind: 'enclosing' } as const;
const COMPUTED = text('extractPresets.computedHere');
const CONTOUR = { kind: 'contour' } as const;
/** Parameters with which the deformable model works as published: one sampling distance everywhere, and Euler steps. */
export const PAPER = { adaptivity: 0, integrator: 'euler' } as const;
/** Base parameters of the presets: the iso force alone, so that each preset lists every other force that acts. */
const BARE = { ...PAPER, isoForce: -1, gradientNormal: 0, gradientTangent: 0, rigidity: 0, stiffness: 0 };
/**
 * Base parameters without the iso force, for presets with the gradient force, which moves the surface towards maxima of
 * intensity. Gradients are per voxel here, so that a weight of 1 has the effect of 0.1 in the paper.
 */
const RIDGE = { ...BARE, isoForce: 0 };

export const PRESETS: Preset[] = [
  {
    id: 'figure-7',
    name: text('extractPresets.figure7Name'),
    source: { shape: 'chain' },
    unit: '',
    start: ENCLOSING,
    levels: 0,
    // Makes the gap between the rings four δ wide.
    edge: 3.15,
    params: { ...BARE, iso: 127.5, rigidity: 0.1, stiffness: 0.1 },
    credit: text('extractPresets.figure7Credit'),
    paperResult: text('extractPresets.figure7Paper'),
    variants: [
      {
        id: '7',
        name: text('extractPresets.figure7PictureName'),
        params: {},
        ourResult: text('extractPresets.figure7PictureHere'),
        expected: { iterations: 73, vertices: 464, components: 2, genus: 2 },
      },
    ],
  },
  {
    id: 'figure-8',
    name: text('extractPresets.figure8Name'),
    source: { shape: 'chain' },
    unit: '',
    start: { kind: 'bubbles', bubbles: 11 },
    levels: 0,
    edge: 1.65,
    params: { ...BARE, iso: 127.5 },
    credit: text('extractPresets.figure8Credit'),
    paperResult: text('extractPresets.figure8Paper'),
    variants: [
      {
        id: '8',
        name: text('extractPresets.figure8PictureName'),
        params: {},
        ourResult: text('extractPresets.figure8PictureHere'),
        expected: { iterations: 37, vertices: 2596, components: 2, genus: 2 },
      },
    ],
  },
  {
    id: 'figure-14',
    name: text('extractPresets.figure14Name'),
    source: { shape: 'deep sponge' },
    unit: '',
    start: ENCLOSING,
    levels: 3,
    params: { ...BARE, iso: 102, rigidity: 0.05, stiffness: 0.001 },
    credit: text('extractPresets.figure14Credit'),
    paperResult: text('extractPresets.figure14Paper'),
    variants: [
      {
        id: '14',
        name: text('extractPresets.figure14PictureName'),
        params: {},
        ourResult: text('extractPresets.figure14PictureHere'),
        expected: { iterations: 236, vertices: 66966, components: 1, genus: 1409 },
      },
    ],
  },
  {
    id: 'figure-15-16',
    name: text('extractPresets.figure15And16Name'),
    source: { shape: 'head phantom' },
    unit: '',
    start: ENCLOSING,
    levels: 3,
    params: { ...BARE, iso: 130, rigidity: 0.4 },
    credit: `${COMPUTED} ${text('extractPresets.figure15And16Credit')}`,
    paperResult: text('extractPresets.figure15And16Paper'),
    variants: [
      {
        id: '16',
        name: text('extractPresets.figure15And16PictureName'),
        params: {},
        ourResult: text('extractPresets.figure15And16PictureHere'),
        expected: { iterations: 202, vertices: 15870, components: 1, genus: 5 },
      },
    ],
    compares: true,
    hint: text('extractPresets.figure15And16Hint'),
  },
  {
    id: 'figure-20',
    name: text('extractPresets.figure20Name'),
    source: { shape: 'vessel tree' },
    unit: '',
    start: ENCLOSING,
    levels: 3,
    params: { ...BARE, iso: 12.75, rigidity: 0.07 },
    credit: `${COMPUTED} ${text('extractPresets.figure20Credit')}`,
    paperResult: text('extractPresets.figure20Paper'),
    variants: [
      {
        id: '20',
        name: text('extractPresets.figure20PictureName'),
        params: {},
        ourResult: text('extractPresets.figure20PictureHere'),
        expected: { iterations: 240, vertices: 7883, components: 1, genus: 1 },
      },
    ],
    compares: true,
    hint: text('extractPresets.figure20Hint'),
  },
  {
    id: 'figure-21',
    name: text('extractPresets.figure21Name'),
    source: { shape: 'head phantom' },
    unit: '',
    start: ENCLOSING,
    levels: 2,
    params: { ...BARE, iso: 130, rigidity: 0.2 },
    credit: `${COMPUTED} ${text('extractPresets.figure21Credit')}`,
    paperResult: text('extractPresets.figure21Paper'),
    variants: [
      {
        id: '21c',
        name: text('extractPresets.figure21cName'),
        params: {},
        ourResult: text('extractPresets.figure21cHere'),
        expected: { iterations: 169, vertices: 16267, components: 1, genus: 5 },
      },
      {
        id: '21d',
        name: text('extractPresets.figure21dName'),
        params: { iso: 38 },
        ourResult: text('extractPresets.figure21dHere'),
        expected: { iterations: 93, vertices: 15666, components: 1, genus: 0 },
      },
      {
        id: '21e',
        name: text('extractPresets.figure21eName'),
        params: { ...RIDGE, gradientNormal: 1, gradientTangent: 0.5, rigidity: 0.4, stiffness: 0.1 },
        ourResult: text('extractPresets.figure21eHere'),
        expected: { iterations: 345, vertices: 8828, components: 1, genus: 0 },
      },
    ],
    startsOver: true,
  },
  {
    id: 'figure-22',
    name: text('extractPresets.figure22Name'),
    source: { shape: 'marked nucleus' },
    unit: '',
    start: ENCLOSING,
    levels: 1,
    params: { ...RIDGE, iso: 120, gradientNormal: 1, stiffness: 0.2, rigidity: 1.5, integrator: 'runge-kutta' },
    credit: `${COMPUTED} ${text('extractPresets.figure22Credit')}`,
    paperResult: text('extractPresets.figure22Paper'),
    variants: [
      {
        id: '22',
        name: text('extractPresets.figure22PictureName'),
        params: {},
        ourResult: text('extractPresets.figure22PictureHere'),
        expected: { iterations: 245, vertices: 3149, components: 1, genus: 0 },
      },
    ],
  },
  {
    id: 'figure-23',
    name: text('extractPresets.figure23Name'),
    source: { file: 'visible-human-head.nii.gz' },
    unit: 'mm',
    start: { kind: 'isosurface' },
    levels: 0,
    params: { ...BARE, iso: 95, rigidity: 0.3 },
    credit: text('extractPresets.figure23Credit'),
    paperResult: text('extractPresets.figure23Paper'),
    variants: [
      {
        id: '23',
        name: text('extractPresets.figure23PictureName'),
        params: {},
        ourResult: text('extractPresets.figure23PictureHere'),
        expected: { iterations: 139, vertices: 33987, components: 5, genus: 46 },
      },
    ],
  },
  {
    id: 'figure-24',
    name: text('extractPresets.figure24Name'),
    source: { shape: 'cell' },
    unit: '',
    start: ENCLOSING,
    levels: 1,
    params: { ...BARE, iso: 76.5, rigidity: 0.2 },
    credit: `${COMPUTED} ${text('extractPresets.figure24Credit')}`,
    paperResult: text('extractPresets.figure24Paper'),
    variants: [
      {
        id: '24b',
        name: text('extractPresets.figure24bName'),
        params: {},
        ourResult: text('extractPresets.figure24bHere'),
        expected: { iterations: 86, vertices: 5182, components: 1, genus: 0 },
      },
      {
        id: '24c',
        name: text('extractPresets.figure24cName'),
        params: { iso: 114.75 },
        ourResult: text('extractPresets.figure24cHere'),
        expected: { iterations: 100, vertices: 3802, components: 1, genus: 0 },
      },
      {
        id: '24d',
        name: text('extractPresets.figure24dName'),
        params: { iso: 191.25 },
        ourResult: text('extractPresets.figure24dHere'),
        expected: { iterations: 141, vertices: 1038, components: 3, genus: 0 },
      },
    ],
  },
];

/** Returns the example or preset of the Extract lab with this id, undefined if there is none. */
export function exampleById(id: string): Example | undefined {
  return [...EXAMPLES, ...PRESETS].find((one) => one.id === id);
}

export function isPreset(example: Example | undefined): example is Preset {
  return example !== undefined && 'variants' in example;
}

/**
 * Returns the first variant of `preset` whose parameters, together with the preset's, all have the same values in
 * `params`, to highlight its button; undefined if there is none. Other parameters are ignored.
 */
export function variantInForce(preset: Preset, params: ParamValues): Variant | undefined {
  return preset.variants.find((one) =>
    Object.entries({ ...preset.params, ...one.params }).every(([name, value]) => Object.is(params[name], value)),
  );
}

/**
 * Returns the initial surface that is used by default: a preset's own, or the contour for other examples and, with
 * undefined, for the user's files.
 */
export function defaultStart(example: Example | undefined): Preset['start'] | typeof CONTOUR {
  return isPreset(example) ? example.start : CONTOUR;
}
