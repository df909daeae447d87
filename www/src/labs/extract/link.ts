/** Converts the Extract lab's settings to the hash of an address, `#extract?…`, and back. */

import type { Attractor, ParamValues, Vec3 } from '../../engine/protocol';
import { initialOptions } from '../../kit/view';
import { as, integer, linkFormat, many, name, numbers, oneOfChoices, real } from '../../lab/link-fields';
import { differing } from '../../lab/link-query';
import { EXAMPLES, type Example } from './examples';
import { defaultStart, exampleById, isPreset, PAPER } from './presets';
import { SHAPES, type StartChoice } from './start';
import { EXTRACT_VIEW, type ExtractViewOptions } from './view';

export const ADDRESS = '#extract';
/** Most attractors that a link includes: some programs truncate long addresses. */
export const MOST_ATTRACTORS = 100;

/**
 * Version number of the defaults that a link relies on. Links without a version were written when the defaults were an
 * enclosing initial surface and the method as published.
 */
const VERSION = '2';

/**
 * Settings of the Extract lab that are contained in a link; missing ones are as in the example, or else the method's
 * defaults.
 */
export interface Linked {
  /** Id of the open example or figure; without it and without `file`, the first example opens. */
  example?: string;
  /** Name of the user's file, if one is open; the link does not contain the file itself. */
  file?: string;
  start?: StartChoice['kind'];
  bubbles?: number;
  sphere?: { center: Vec3; radius: number };
  levels?: number;
  /** Index of the open frame of a 4D volume; without it, the first one opens. */
  frame?: number;
  /** Target edge length in world units; 0 if the model chooses it. */
  edge?: number;
  params: ParamValues;
  attractors: Attractor[];
  view: Partial<ExtractViewOptions>;
  unread?: string[];
}

const sphere = as(
  numbers(4),
  ([x = 0, y = 0, z = 0, radius = 1]): Linked['sphere'] => ({ center: [x, y, z], radius }),
  ({ center, radius }) => [...center, radius],
);
const attractor = as(
  numbers(5),
  ([x = 0, y = 0, z = 0, strength = 0, radius = 1]): Attractor => ({ point: [x, y, z], strength, radius }),
  ({ point, strength, radius }) => [...point, strength, radius],
);

const FORMAT = linkFormat(
  ADDRESS,
  {
    ...{ example: name, file: name, frame: integer(0), start: oneOfChoices(SHAPES), bubbles: real(), sphere },
    ...{ levels: integer(0), edge: real(), attractor: many(attractor, MOST_ATTRACTORS), v: name },
  },
  EXTRACT_VIEW,
);

/** Present settings of the Extract lab, from which a link is made. */
export interface LabSettings {
  example: Example | undefined;
  /** Name of the open file, which the link contains if no example is open. */
  file: string;
  /** Index of the open frame. */
  frame: number;
  choice: StartChoice;
  /** The sphere, in world units, that is the initial surface if a sphere is chosen. */
  sphere: { center: Vec3; radius: number };
  params: ParamValues;
  /** Default parameters of the method; the link contains only parameters that differ. */
  defaults: ParamValues;
  attractors: Attractor[];
  view: ExtractViewOptions;
}

/**
 * Returns what a link to the lab's present state contains: the settings that differ from those of the example, or else
 * from the method's defaults, and all attractors unless they are too many.
 */
export function linkOf(settings: LabSettings): Linked {
  const { example, file, frame, choice, sphere, params, defaults, attractors, view } = settings;
  const usual = { levels: 1, edge: undefined, ...example };
  const start = defaultStart(example);
  const bubbles = 'bubbles' in start ? start.bubbles : undefined;
  return {
    ...(!example && { file }),
    ...(example && example !== EXAMPLES[0] && { example: example.id }),
    ...(frame > 0 && { frame }),
    ...(choice.kind !== start.kind && { start: choice.kind }),
    ...(choice.kind === 'bubbles' && choice.bubbles !== bubbles && { bubbles: choice.bubbles }),
    ...(choice.kind === 'sphere' && { sphere }),
    ...(choice.levels !== usual.levels && { levels: choice.levels }),
    ...(choice.edge !== usual.edge && { edge: choice.edge ?? 0 }),
    params: differing(params, { ...defaults, ...example?.params }),
    attractors: attractors.length <= MOST_ATTRACTORS ? attractors : [],
    view: differing({ ...view }, { ...initialOptions(EXTRACT_VIEW) }),
  };
}

/** Returns `choice`, the choice of the initial surface, with the settings that a link contains in place of its own. */
export function withLink(choice: StartChoice, { start, bubbles, levels, edge }: Linked): StartChoice {
  return {
    kind: start ?? choice.kind,
    bubbles: bubbles ?? choice.bubbles,
    levels: levels ?? choice.levels,
    edge: edge === undefined ? choice.edge : edge || undefined,
  };
}

/** Converts the settings in a link to the hash of an address, with all digits, which give the same surface to the bit. */
export function toHash({ attractors, ...settings }: Linked): string {
  const given = { ...settings, attractor: attractors };
  const hash = FORMAT.toHash(given);
  return hash === ADDRESS ? hash : FORMAT.toHash({ ...given, v: VERSION });
}

/** Parses the hash of an address; undefined if it is for another lab or contains no settings. */
export function fromHash(hash: string): Linked | undefined {
  const found = FORMAT.fromHash(hash);
  if (!found) return undefined;
  const { v, attractor: attractors = [], ...settings } = found;
  const linked = { ...settings, attractors };
  return v === undefined ? asBefore(linked) : linked;
}

/**
 * Adds to the settings in a link without a version number the defaults of that time, on which it relies. Figures are
 * excepted: they set all parameters themselves.
 */
function asBefore(linked: Linked): Linked {
  if (isPreset(exampleById(linked.example ?? ''))) return linked;
  return { start: 'enclosing', ...linked, params: { ...PAPER, ...linked.params } };
}
