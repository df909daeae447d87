/** Converts the Sculpt lab's settings to the hash of an address, `#sculpt?…`, and back. */
import type { ParamValues } from '../../engine/protocol';
import { type Field, flag, integer, linkFormat, many, name, oneOf } from '../../lab/link-fields';
import { differing } from '../../lab/link-query';
import { fromNumbers, lengthsOf, toNumbers } from './ellipsoids';
import { SCENES, type SculptExample, viewOf } from './examples';
import type { Film } from './film';
import type { Pose, Support } from './protocol';
import { SCULPT_VIEW, type SculptViewOptions } from './view';

const ADDRESS = '#sculpt';
/** Most keyframes that a link includes: some programs truncate long addresses. */
export const MOST_KEYS = 12;
/** Most ellipsoids of a pose that a link includes. */
const MOST_ELLIPSOIDS = 60;

/** Tests whether a pose has few enough ellipsoids for a link. */
export const fits = (pose: Pose | undefined): boolean => (pose?.length ?? 0) <= MOST_ELLIPSOIDS;

/**
 * Settings of the Sculpt lab that are contained in a link; missing ones are as in the example, or else the method's
 * defaults.
 */
export interface LinkedScene {
  example?: string;
  /** Name of the user's file, if one is open; the link does not contain the file itself. */
  file?: string;
  params: ParamValues;
  /**
   * Support of the surface of a file; links of versions that knew only the membrane do not say so. Undefined for
   * examples.
   */
  support?: Support;
  /** The ellipsoids that leave a surface that holds itself as it is, if they have moved. */
  rest?: Pose;
  /** Target pose of the ellipsoids, if it was set by hand. */
  pose?: Pose;
  /** Keyframes of the user's own film; without them, `loop` applies to the example's film. */
  keys?: Pose[];
  between?: number;
  loop?: boolean;
  view: Partial<SculptViewOptions>;
  unread?: string[];
}

const pose: Field<Pose> = { read: asPose, write: asText };

const FORMAT = linkFormat(
  ADDRESS,
  {
    ...{ example: name, file: name, support: oneOf(['surface', 'membrane']), between: integer(1), loop: flag },
    ...{ rest: pose, pose, key: many(pose, MOST_KEYS) },
  },
  SCULPT_VIEW,
);

/** Present settings of the Sculpt lab, from which a link is made. */
export interface SceneSettings {
  example: SculptExample | undefined;
  file: string;
  params: ParamValues;
  /** Parameters that the scene opened with, without changes by a link. */
  usual: ParamValues;
  support: Support;
  /** The ellipsoids with which the model was built. */
  start: Pose;
  pose: Pose | undefined;
  film: Film | undefined;
  view: SculptViewOptions;
}

/**
 * Returns what a link to the lab's present state contains: the settings that differ from those of the example, and the
 * parameters that differ from `usual`; keyframes only if there are at most {@link MOST_KEYS}.
 */
export function linkOf(settings: SceneSettings): LinkedScene {
  const { example, file, params, usual, support, start, pose, film, view } = settings;
  const own =
    film !== example?.film && film && 'keys' in film && film.keys.length <= MOST_KEYS && film.keys.every(fits);
  const looped = film?.loop !== undefined && film.loop !== (example?.film?.loop ?? false);
  return {
    ...(!example && { file, support }),
    ...(example && example !== SCENES[0] && { example: example.id }),
    params: withBothEdges(differing(params, usual), params),
    ...(support === 'surface' && (own || pose) && fits(start) && { rest: start }),
    ...(pose && fits(pose) && { pose }),
    ...(own && { keys: film.keys, between: film.between }),
    ...(looped && { loop: film.loop }),
    view: differing({ ...view }, { ...viewOf(example) }),
  };
}

/** Adds the other edge length to one that is in a link: without it, the model would choose it to suit. */
function withBothEdges(linked: ParamValues, params: ParamValues): ParamValues {
  const edges = ['edgeMin', 'edgeMax'];
  if (!edges.some((name) => name in linked)) return linked;
  return Object.fromEntries(Object.entries(params).filter(([name]) => name in linked || edges.includes(name)));
}

/**
 * Returns the film for the settings in a link: of the link's keyframes or, if it has none, `usual`, the example's film;
 * the link may also set whether the film loops.
 */
export function filmOf(
  { keys, between, loop }: Pick<LinkedScene, 'keys' | 'between' | 'loop'>,
  usual: Film | undefined,
): Film | undefined {
  const film = keys && keys.length > 0 ? { keys, between: between ?? 24, loop: false } : usual;
  return film && loop !== undefined ? { ...film, loop } : film;
}

/**
 * Converts a pose of the ellipsoids to text for a link. The numbers of an ellipsoid are rounded to multiples of a power
 * of ten that is at most 10⁻⁴ of its longest semi-axis, which is finer than any drag.
 */
function asText(pose: Pose): string {
  return pose
    .map((one) =>
      toNumbers(one)
        .map(rounding(1e-4 * Math.max(...lengthsOf(one))))
        .join(','),
    )
    .join(';');
}

function rounding(step: number): (value: number) => number {
  const power = 10 ** Math.floor(Math.log10(step));
  return (value) => Number((Math.round(value / power) * power).toPrecision(15));
}

function asPose(text: string): Pose | undefined {
  const pose = text.split(';', MOST_ELLIPSOIDS).map((one) => fromNumbers(one.split(',').map(Number)));
  return pose.every((one) => one !== undefined) ? pose : undefined;
}

/** Converts the settings in a link to the hash of an address. */
export const toHash = ({ keys = [], ...settings }: LinkedScene): string => FORMAT.toHash({ ...settings, key: keys });

/** Parses the hash of an address; undefined if it is for another lab or contains no settings. */
export function fromHash(hash: string): LinkedScene | undefined {
  const found = FORMAT.fromHash(hash);
  if (!found) return undefined;
  const { key: keys, ...settings } = found;
  return { ...settings, ...(keys && { keys }) };
}
