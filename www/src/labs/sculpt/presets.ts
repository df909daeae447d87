/**
 * Presets of the Sculpt lab: the figures of the paper by Kobbelt, Bareuther and Seidel, on meshes that are served with
 * the page or computed in it.
 */
import { text } from '../../texts';
import { ball, moved, samePose, scaled, turned, upright } from './ellipsoids';
import { BUST, BUST_MESHES, BUST_NAMES, LAVA, LOOKING_ASIDE, NEFERTITI, SCENES, type SculptExample } from './examples';
import { poseAt } from './film';
import type { ParamValues, Pose, StageKind } from './protocol';

/**
 * Expected result of a preset's variant once its pose is reached, as ranges, each from least to largest; tests compute
 * the pose and compare.
 */
export interface SculptOutcome {
  components: [number, number];
  folded: [number, number];
  areaLow?: [number, number];
  areaHigh?: [number, number];
}

/** One picture of a figure, as a variant of the preset: the same scene with another pose or other parameters. */
export interface SculptVariant {
  id: string;
  name: string;
  params: ParamValues;
  /** Pose that the ellipsoids move to; if undefined, the figure's own pose. */
  pose?: Pose;
  ourResult: string;
  expected?: SculptOutcome;
}

/** A figure of the paper, as an example of the Sculpt lab, with a variant for each of its pictures. */
export interface SculptPreset extends SculptExample {
  paperResult: string;
  variants: [SculptVariant, ...SculptVariant[]];
  hint?: string;
  /** Series of restructuring stages to display instead of the model's meshes; undefined to display the model. */
  stages?: StageKind;
}

const BUST_SCENE = {
  ...BUST_MESHES,
  up: 'y',
  start: BUST,
  names: BUST_NAMES,
  params: { supersample: 2 },
  credit: NEFERTITI,
} as const;

/** Returns the pose of the Nefertiti bust with each ellipsoid changed by a function of it and its index. */
function bustWith(change: (ellipsoid: Pose[number], index: number) => Pose[number]): Pose {
  return BUST.map(change);
}

const LONG_NECK = bustWith((one, index) => {
  if (index < 2) return moved(one, [0, 90, 10]);
  return index === 2 ? moved(scaled(one, [0.85, 1.6, 0.85]), [0, 45, 5]) : one;
});

const WIDE_CROWN = bustWith((one, index) => (index === 0 ? scaled(one, [1.45, 1, 1.25]) : one));

const BALL_SCENE = { up: 'y', params: {} } as const;
const ONE_BALL: Pose = [ball(0, 0, 0, 0.98)];
/**
 * Start pose of the globe in figure 10: three ellipsoids in the same place; when they separate, each takes its part of
 * the map along.
 */
const GLOBE_START: Pose = [ball(0, 0, 0, 0.98), ball(0, 0, 0, 0.97), ball(0, 0, 0, 0.96)];
const APART: Pose = [ball(-0.6, 0, 0, 0.85), ball(0.1, 0.1, 0, 0.5), ball(0.8, 0.3, 0, 0.6)];
const LENS: Pose = [0, 1, 2].map(() => upright([0, 0, 0], [1.5, 0.55, 1.2]));
const BOW: Pose = [
  turned(upright([-0.8, -0.25, 0], [0.75, 0.5, 0.5]), [0, 0, 1], 0.7),
  upright([0, 0.25, 0], [0.7, 0.5, 0.5]),
  turned(upright([0.8, -0.25, 0], [0.75, 0.5, 0.5]), [0, 0, 1], -0.7),
];

const BLOBS: Pose = [ball(-0.8, 0, 0, 1), ball(0.85, 0.35, 0, 0.75)];

export const SCULPT_PRESETS: SculptPreset[] = [
  {
    id: 'figure-1',
    name: text('sculptPresets.figure1Name'),
    ...BUST_SCENE,
    view: { layout: 'row', ellipsoids: false },
    paperResult: text('sculptPresets.figure1Paper'),
    variants: [
      {
        id: '1',
        name: text('sculptPresets.figure1PictureName'),
        params: {},
        pose: LOOKING_ASIDE,
        ourResult: text('sculptPresets.figure1PictureHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.4, 1], areaHigh: [1, 2.2] },
      },
    ],
    hint: text('sculptPresets.figure1Hint'),
  },
  {
    id: 'figure-3',
    name: text('sculptPresets.figure3Name'),
    ...BALL_SCENE,
    base: { shape: 'ball' },
    start: ONE_BALL,
    view: { layout: 'stages' },
    credit: text('sculptPresets.figure3Credit'),
    paperResult: text('sculptPresets.figure3Paper'),
    variants: [
      {
        id: '3',
        name: text('sculptPresets.figure3PictureName'),
        params: {},
        ourResult: text('sculptPresets.figure3PictureHere'),
      },
    ],
    stages: 'restructuring',
  },
  {
    id: 'figure-6',
    name: text('sculptPresets.figure6Name'),
    ...BALL_SCENE,
    base: { shape: 'ball' },
    start: ONE_BALL,
    view: { layout: 'stages' },
    credit: text('sculptPresets.figure6Credit'),
    paperResult: text('sculptPresets.figure6Paper'),
    variants: [
      {
        id: '6',
        name: text('sculptPresets.figure6PictureName'),
        params: {},
        ourResult: text('sculptPresets.figure6PictureHere'),
      },
    ],
    hint: text('sculptPresets.figure6Hint'),
    stages: 'passes',
  },
  {
    id: 'figure-7',
    name: text('sculptPresets.figure7Name'),
    up: 'y',
    start: poseAt(LAVA, 0),
    names: SCENES.find(({ id }) => id === 'lava')?.names ?? [],
    film: LAVA,
    params: { edgeMin: 0.07, edgeMax: 0.16, topology: 'split-and-join' },
    credit: text('sculptPresets.figure7Credit'),
    paperResult: text('sculptPresets.figure7Paper'),
    variants: [
      {
        id: '7',
        name: text('sculptPresets.figure7PictureName'),
        params: {},
        ourResult: text('sculptPresets.figure7PictureHere'),
      },
    ],
    hint: text('sculptPresets.figure7Hint'),
    view: { edges: true },
  },
  {
    id: 'figure-8',
    name: text('sculptPresets.figure8Name'),
    ...BALL_SCENE,
    start: BLOBS,
    names: [text('sculptPresets.large'), text('sculptPresets.small')],
    view: { layout: 'levels' },
    params: { edgeMin: 0.05, edgeMax: 0.115, levels: 2, refineFactor: 0.5 },
    credit: text('sculptPresets.figure8Credit'),
    paperResult: text('sculptPresets.figure8Paper'),
    variants: [
      {
        id: '8',
        name: text('sculptPresets.figure8PictureName'),
        params: { edgeMin: 0.05, edgeMax: 0.115, levels: 2, refineFactor: 0.5 },
        ourResult: text('sculptPresets.figure8PictureHere'),
        expected: { components: [1, 1], folded: [0, 0] },
      },
    ],
  },
  {
    id: 'figure-9',
    name: text('sculptPresets.figure9Name'),
    ...BUST_SCENE,
    view: { layout: 'pair', ellipsoids: false },
    paperResult: text('sculptPresets.figure9Paper'),
    variants: [
      {
        id: '9a',
        name: text('sculptPresets.figure9aName'),
        params: {},
        pose: LONG_NECK,
        ourResult: text('sculptPresets.figure9aHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [1, 2.2] },
      },
      {
        id: '9b',
        name: text('sculptPresets.figure9bName'),
        params: {},
        pose: WIDE_CROWN,
        ourResult: text('sculptPresets.figure9bHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [1, 2.2] },
      },
      {
        id: '9c',
        name: text('sculptPresets.figure9cName'),
        params: {},
        pose: LOOKING_ASIDE,
        ourResult: text('sculptPresets.figure9cHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [1, 2.2] },
      },
    ],
  },
  {
    id: 'figure-10',
    name: text('sculptPresets.figure10Name'),
    base: { shape: 'globe' },
    up: 'y',
    start: GLOBE_START,
    names: [text('sculptPresets.west'), text('sculptPresets.middle'), text('sculptPresets.east')],
    params: {},
    view: { color: 'texture', layout: 'pair', ellipsoids: false },
    credit: text('sculptPresets.figure10Credit'),
    paperResult: text('sculptPresets.figure10Paper'),
    variants: [
      {
        id: '10a',
        name: text('sculptPresets.figure10aName'),
        params: {},
        pose: APART,
        ourResult: text('sculptPresets.figure10aHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [0.7, 3] },
      },
      {
        id: '10b',
        name: text('sculptPresets.figure10bName'),
        params: {},
        pose: LENS,
        ourResult: text('sculptPresets.figure10bHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.2, 1], areaHigh: [0.7, 3] },
      },
      {
        id: '10c',
        name: text('sculptPresets.figure10cName'),
        params: {},
        pose: BOW,
        ourResult: text('sculptPresets.figure10cHere'),
        expected: { components: [1, 1], folded: [0, 0], areaLow: [0.2, 1], areaHigh: [0.7, 3] },
      },
    ],
    hint: text('sculptPresets.figure10Hint'),
  },
];

/** Returns the Sculpt lab's example or preset with this id, undefined if there is none. */
export function sceneById(id: string): SculptExample | undefined {
  return [...SCENES, ...SCULPT_PRESETS].find((one) => one.id === id);
}

export function isSculptPreset(example: SculptExample | undefined): example is SculptPreset {
  return example !== undefined && 'variants' in example;
}

/** Returns the pose that the ellipsoids of an example move to when it opens, undefined if they stay. */
export function poseOf(example: SculptExample | undefined): Pose | undefined {
  const [variant] = isSculptPreset(example) ? example.variants : [];
  return variant?.pose ?? example?.pose;
}

/**
 * Returns the poses in an example's keyframes and variants, so that the view can leave room for them; poses of computed
 * films are not included.
 */
export function posesOf(example: SculptExample | undefined): Pose[] {
  const film = example?.film;
  const keys = film === undefined ? [] : 'keys' in film ? film.keys : [];
  const variants = isSculptPreset(example) ? example.variants : [];
  return [...keys, ...variants.flatMap(({ pose }) => (pose ? [pose] : []))];
}

/**
 * Returns the first variant of a figure that the current pose and parameters match, to mark its button; undefined if
 * none does. Parameters that the variant does not set must have the values in `usual`, those with which the figure
 * opens.
 */
export function variantInForce(
  preset: SculptPreset,
  pose: Pose,
  params: ParamValues,
  usual: ParamValues,
): SculptVariant | undefined {
  return preset.variants.find(
    (one) =>
      (!one.pose || samePose(one.pose, pose)) &&
      Object.entries({ ...usual, ...one.params }).every(([name, value]) => Object.is(params[name], value)),
  );
}
