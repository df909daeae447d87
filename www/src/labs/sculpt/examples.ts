import type { Vec3 } from '../../engine/protocol';
import { initialOptions } from '../../kit/view';
import { text } from '../../texts';
import { ball, moved, turnedAbout, upright } from './ellipsoids';
import { type Film, poseAt } from './film';
import type { ParamValues, Pose } from './protocol';
import type { ComputedMesh } from './shapes';
import { SCULPT_VIEW, type SculptViewOptions } from './view';

/** Source of an example's mesh: a file served with the page, or a computed mesh. */
export type ExampleMesh = { file: string } | { shape: ComputedMesh };

/** An example of the Sculpt lab: meshes, ellipsoids that fit them, their motion, settings and credits. */
export interface SculptExample {
  id: string;
  name: string;
  detail?: ExampleMesh;
  base?: ExampleMesh;
  up: 'y' | 'z';
  /**
   * Ellipsoids that the model starts with; if undefined, they are fitted to the mesh or, without a mesh, a unit ball.
   */
  start?: Pose;
  /** Names of the ellipsoids, shown on the page, in the order of `start`. */
  names?: string[];
  /**
   * Pose that the ellipsoids move to when the example opens, unless a link gives another pose or a film; undefined to
   * stay at `start`.
   */
  pose?: Pose;
  film?: Film;
  params: ParamValues;
  /** Options of the view with which the example opens, where they differ from the lab's. */
  view?: Partial<SculptViewOptions>;
  credit: string;
}

/** Credits of the bust of Nefertiti, for the examples and presets that show it. */
export const NEFERTITI = text('sculptPresets.nefertitiCredit');

/** Start pose of the ellipsoids of the Nefertiti bust: crown, head, neck and chest. */
export const BUST: Pose = [
  {
    center: [0, 125, 0],
    axes: [
      [95, 0, 0],
      [0, 60.75, -44.25],
      [0, 64.9, 89.1],
    ],
  },
  upright([0, 0, 60], [58, 75, 72]),
  upright([0, -110, 40], [42, 70, 42]),
  upright([0, -205, 5], [92, 42, 60]),
];
export const BUST_NAMES = [
  text('sculptPresets.crown'),
  text('sculptPresets.head'),
  text('sculptPresets.neck'),
  text('sculptPresets.chest'),
];
export const BUST_MESHES = { detail: { file: 'nefertiti.ply' }, base: { file: 'nefertiti-base.ply' } } as const;

/** Point where head and neck of the Nefertiti bust meet; the head is rotated about it. */
const NAPE: Vec3 = [0, -40, 20];

/**
 * Returns the pose of the Nefertiti bust with crown and head rotated together about the nape, by `angle` in radians,
 * then translated by the vector `by`.
 */
function headTurned(about: Vec3, angle: number, by: Vec3): Pose {
  const [crown, head, ...others] = BUST;
  const turn = (one: Pose[number]) => moved(turnedAbout(one, NAPE, about, angle), by);
  return [...[crown, head].flatMap((one) => (one ? [turn(one)] : [])), ...others];
}

/** Pose of the Nefertiti bust with the head turned aside on a longer neck. */
export const LOOKING_ASIDE: Pose = headTurned([0, 1, 0], 0.5, [8, 26, 0]);

/** The film of the lava lamp example: its computed motion, played once. */
export const LAVA: Film = { motion: 'lava', loop: false };

/** The examples of the Sculpt lab. The first one opens by default. */
export const SCENES: [SculptExample, ...SculptExample[]] = [
  {
    id: 'bust',
    name: text('sculptPresets.bustName'),
    ...BUST_MESHES,
    up: 'y',
    start: BUST,
    names: BUST_NAMES,
    film: { keys: [BUST, LOOKING_ASIDE], between: 24, loop: false },
    params: { supersample: 2 },
    credit: NEFERTITI,
  },
  {
    id: 'lava',
    name: text('sculptPresets.lavaName'),
    up: 'y',
    start: poseAt(LAVA, 0),
    names: [
      text('sculptPresets.pool'),
      text('sculptPresets.largeBlob'),
      text('sculptPresets.smallBlob'),
      text('sculptPresets.middleBlob'),
      text('sculptPresets.dropBlob'),
    ],
    film: LAVA,
    params: { edgeMin: 0.07, edgeMax: 0.16, topology: 'split-and-join' },
    view: { color: 'component' },
    credit: text('sculptPresets.lavaCredit'),
  },
  {
    id: 'globe',
    name: text('sculptPresets.globeName'),
    base: { shape: 'globe' },
    up: 'y',
    // Both in the same place: when they separate, each takes half of the map along.
    start: [ball(0, 0, 0, 0.98), ball(0, 0, 0, 0.97)],
    names: [text('sculptPresets.large'), text('sculptPresets.small')],
    pose: [ball(-0.6, 0, 0, 0.85), ball(0.75, 0.3, 0, 0.6)],
    params: {},
    view: { color: 'texture' },
    credit: text('sculptPresets.globeCredit'),
  },
];

/** Returns the options of the view with which an example, or else the user's own mesh, opens. */
export const viewOf = (example: SculptExample | undefined): SculptViewOptions => ({
  ...initialOptions(SCULPT_VIEW),
  ...example?.view,
});
