/** Presets of the Sculpt lab: the paper's figures, on meshes that are served with the page or computed in it. */
import type { SculptViewOptions } from '../view/sculpture';
import { ball, moved, samePose, scaled, turned, upright } from './ellipsoids';
import { BUST, BUST_MESHES, BUST_NAMES, LAVA, LOOKING_ASIDE, NEFERTITI, SCENES, type SculptExample } from './examples';
import { poseAt } from './film';
import type { ParamValues, Pose, StageKind } from './protocol';

/** Result of a pose as ranges, each from least to largest; tests compare the texts of a variant with it. */
export interface SculptOutcome {
  components: [number, number];
  folded: [number, number];
  areaLow?: [number, number];
  areaHigh?: [number, number];
}

/** One picture of a figure: the preset's scene with another pose or other parameters. */
export interface SculptVariant {
  id: string;
  name: string;
  params: ParamValues;
  /** Pose that the ellipsoids move to. */
  pose?: Pose;
  came: string;
  outcome?: SculptOutcome;
}

/** A figure of the paper, as an example of the Sculpt lab. */
export interface SculptPreset extends SculptExample {
  saw: string;
  variants: [SculptVariant, ...SculptVariant[]];
  hint?: string;
  view?: Partial<SculptViewOptions>;
  /** Meshes of restructuring stages to display; they need no model. */
  stages?: StageKind;
}

const BUST_SCENE = {
  ...BUST_MESHES,
  up: 'y',
  start: BUST,
  names: BUST_NAMES,
  params: { supersample: 2 },
  color: 'plain',
  credit: NEFERTITI,
} as const;

/** Returns the bust's pose with each ellipsoid changed by a function of it and its index. */
function bustWith(change: (ellipsoid: Pose[number], index: number) => Pose[number]): Pose {
  return BUST.map(change);
}

const LONG_NECK = bustWith((one, index) => {
  if (index < 2) return moved(one, [0, 90, 10]);
  return index === 2 ? moved(scaled(one, [0.85, 1.6, 0.85]), [0, 45, 5]) : one;
});

const WIDE_CROWN = bustWith((one, index) => (index === 0 ? scaled(one, [1.45, 1, 1.25]) : one));

const BALL_SCENE = { up: 'y', color: 'plain', params: {} } as const;
const ONE_BALL: Pose = [ball(0, 0, 0, 0.98)];
/** All in the same place: each takes its part of the map along. */
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
    name: 'Figure 1: original, base, link, and both deformed',
    ...BUST_SCENE,
    layout: 'row',
    view: { ellipsoids: false },
    saw: 'From S₁ and its low-frequency S₀ through the linking mesh T to the deformed S₀′ and S₁′: vertices of T lie on S₀, with the triangles of S₀′, so that λ is looked up where it belongs.',
    variants: [
      {
        id: '1',
        name: 'Figure 1',
        params: {},
        pose: LOOKING_ASIDE,
        came: 'Here a bust turns its head by 29° on a longer neck. T has no triangle turned over; its areas are 0.8 to 1.2 times those of S₀′, and brow, ears and collar stay where they belong.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.4, 1], areaHigh: [1, 2.2] },
      },
    ],
    hint: 'Colour by distortion: red where a piece of the base has shrunk, blue where it was stretched.',
  },
  {
    id: 'figure-3',
    name: 'Figure 3: why vertices have to be restructured',
    ...BALL_SCENE,
    base: { shape: 'ball' },
    start: ONE_BALL,
    layout: 'stages',
    credit: 'Computed: a ball whose cap is pulled out by nine tenths of its radius.',
    saw: 'Moving some vertices distorts the triangles next to them. Refining everywhere does not help; restructuring gives triangles of good shape.',
    variants: [
      {
        id: '3',
        name: 'Figure 3',
        params: {},
        came: 'Here a twentieth of the triangles is worse than 0.3, where 1 is equilateral. Refined everywhere there are three times as many, and as bad; restructured, with a tenth more triangles, a twentieth is worse than 0.6.',
      },
    ],
    stages: 'restructuring',
  },
  {
    id: 'figure-6',
    name: 'Figure 6: collapse, split, flip',
    ...BALL_SCENE,
    base: { shape: 'ball' },
    start: ONE_BALL,
    layout: 'stages',
    credit: 'Computed: the same ball as for figure 3.',
    saw: 'The quality of a modified mesh (1) is improved by collapsing short edges (2), splitting long edges (3), and flipping edges where valences come nearer to six (4).',
    variants: [
      {
        id: '6',
        name: 'Figure 6',
        params: {},
        came: 'Here one round leaves much to do: splits halve long triangles that are no better for it. After five rounds more the worst twentieth has gone from below 0.3 to below 0.6, where 1 is equilateral.',
      },
    ],
    hint: 'ε_min is 0.6 and ε_max 1.35 times the edge of the ball.',
    stages: 'passes',
  },
  {
    id: 'figure-7',
    name: 'Figure 7: a bubble as in a lava lamp',
    up: 'y',
    start: poseAt(LAVA, 0),
    names: SCENES.find(({ id }) => id === 'lava')?.names ?? [],
    film: LAVA,
    params: { edgeMin: 0.07, edgeMax: 0.16, topology: 'split-and-join' },
    color: 'plain',
    layout: 'result',
    credit: 'Computed: five ellipsoids that rise and sink.',
    saw: 'A skin around moving ellipsoids, restructured in each frame: triangles stay good however the bubble is stretched. It cannot part.',
    variants: [
      {
        id: '7',
        name: 'Figure 7',
        params: {},
        came: 'Here the blobs part from each other and join again: the number of components changes on the way, and no triangle crosses another.',
      },
    ],
    hint: 'Set “Necks and contacts” to “never” for what the paper shows: threads between the blobs.',
    view: { edges: true },
  },
  {
    id: 'figure-8',
    name: 'Figure 8: levels of the solver',
    ...BALL_SCENE,
    start: BLOBS,
    names: ['large', 'small'],
    layout: 'levels',
    params: { edgeMin: 0.05, edgeMax: 0.115, levels: 2, refineFactor: 0.5 },
    credit: 'Computed: a skin around two ellipsoids.',
    saw: 'Meshes of the multi-level solver, with ε_min and ε_max halved from one to the next: none is a refinement of the one before.',
    variants: [
      {
        id: '8',
        name: 'Figure 8',
        params: { edgeMin: 0.05, edgeMax: 0.115, levels: 2, refineFactor: 0.5 },
        came: 'Here three levels, each with about four times the triangles of the one before: pulls cross the coarsest in a few iterations.',
        outcome: { components: [1, 1], folded: [0, 0] },
      },
    ],
  },
  {
    id: 'figure-9',
    name: 'Figure 9: a head deformed, with its detail',
    ...BUST_SCENE,
    layout: 'pair',
    view: { ellipsoids: false },
    saw: 'A head over a sphere as its base: after each modification, wireframe of the deformed base and the head with its detail. Detail stays where it belongs.',
    variants: [
      {
        id: '9a',
        name: 'a: a long neck',
        params: {},
        pose: LONG_NECK,
        came: 'Here a bust in place of the head, as the model cannot be passed on, over its own smooth base. The neck is drawn out evenly; above the brow, where the base is hollow, detail is held back and a slit shows.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [1, 2.2] },
      },
      {
        id: '9b',
        name: 'b: a wide crown',
        params: {},
        pose: WIDE_CROWN,
        came: 'Here the crown is 1.45 times as wide. Its detail is as deep as before: λ is a length, and does not grow with the base.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [1, 2.2] },
      },
      {
        id: '9c',
        name: 'c: looking aside',
        params: {},
        pose: LOOKING_ASIDE,
        came: 'Here the head is turned by 29°, and the neck takes the turn up along its whole length.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [1, 2.2] },
      },
    ],
  },
  {
    id: 'figure-10',
    name: 'Figure 10: a textured globe',
    base: { shape: 'globe' },
    up: 'y',
    start: GLOBE_START,
    names: ['west', 'middle', 'east'],
    params: {},
    color: 'texture',
    layout: 'pair',
    view: { ellipsoids: false },
    credit: 'Computed: a ball and a map drawn for this page.',
    saw: 'A textured sphere deformed by ellipsoids, with a grid of longitude and latitude: cells of the grid stay nearly square, since T distorts little.',
    variants: [
      {
        id: '10a',
        name: 'a: two balls',
        params: {},
        pose: APART,
        came: 'Here cells are larger on the large ball and smaller on the small one, and still have right angles.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.3, 1], areaHigh: [0.7, 3] },
      },
      {
        id: '10b',
        name: 'b: a lens',
        params: {},
        pose: LENS,
        came: 'Here the poles are pressed flat: cells widen towards the rim.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.2, 1], areaHigh: [0.7, 3] },
      },
      {
        id: '10c',
        name: 'c: a bow',
        params: {},
        pose: BOW,
        came: 'Here three ellipsoids bend it. Where it is hollow cells are narrow, and outside they are wide.',
        outcome: { components: [1, 1], folded: [0, 0], areaLow: [0.2, 1], areaHigh: [0.7, 3] },
      },
    ],
    hint: 'Colour by distortion of angles to see where cells are no squares any more.',
  },
];

/** Returns the example or preset with this id. */
export function sceneById(id: string): SculptExample | undefined {
  return [...SCENES, ...SCULPT_PRESETS].find((one) => one.id === id);
}

export function isSculptPreset(example: SculptExample | undefined): example is SculptPreset {
  return example !== undefined && 'variants' in example;
}

/**
 * Returns all poses that an example moves its ellipsoids to, in its film and its variants, so that the view can leave
 * room for them.
 */
export function posesOf(example: SculptExample | undefined): Pose[] {
  const film = example?.film;
  const keys = film === undefined ? [] : 'keys' in film ? film.keys : [];
  const variants = isSculptPreset(example) ? example.variants : [];
  return [...keys, ...variants.flatMap(({ pose }) => (pose ? [pose] : []))];
}

/**
 * Returns the variant of a figure whose settings are all in force, if there is one; unset parameters count as in
 * `usual`.
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
