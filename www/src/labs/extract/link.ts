/** Converts the Extract lab's settings to the hash of an address, `#extract?…`, and back. */

import type { Attractor, ParamValues, Vec3 } from '../../engine/protocol';
import type { ColorMode } from '../../kit/view-options';
import { differing, listsIn, numbersIn, paramsIn, queryOf, textsIn } from '../../lab/link-query';
import { EXAMPLES, type Example } from './examples';
import { isStartKind, type StartChoice } from './panels/start';
import { defaultStart, exampleById, isPreset, PAPER } from './presets';

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
  start?: string;
  bubbles?: number;
  sphere?: { center: Vec3; radius: number };
  levels?: number;
  /** Index of the open frame of a 4D volume; without it, the first one opens. */
  frame?: number;
  /** Target edge length in world units; 0 if the model chooses it. */
  edge?: number;
  params: ParamValues;
  attractors: Attractor[];
  color?: ColorMode;
}

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
  color: ColorMode;
}

/**
 * Returns what a link to the lab's present state contains: the settings that differ from those of the example, or else
 * from the method's defaults, and all attractors unless they are too many.
 */
export function linkOf(settings: LabSettings): Linked {
  const { example, file, frame, choice, sphere, params, defaults, attractors, color } = settings;
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
    ...(color !== 'plain' && { color }),
  };
}

/** Returns `choice`, the choice of the initial surface, with the settings that a link contains in place of its own. */
export function withLink(choice: StartChoice, { start, bubbles, levels, edge }: Linked): StartChoice {
  return {
    kind: isStartKind(start) ? start : choice.kind,
    bubbles: bubbles ?? choice.bubbles,
    levels: levels ?? choice.levels,
    edge: edge === undefined ? choice.edge : edge || undefined,
  };
}

/** Converts the settings in a link to the hash of an address, with all digits, which give the same surface to the bit. */
export function toHash(linked: Linked): string {
  const query = new URLSearchParams();
  const { example, file, frame, start, bubbles, sphere, levels, edge, params, attractors, color } = linked;
  for (const [name, value] of Object.entries({ example, file, frame, start, bubbles, levels, edge, color }))
    if (value !== undefined) query.set(name, String(value));
  if (sphere) query.set('sphere', [...sphere.center, sphere.radius].join(','));
  for (const [name, value] of Object.entries(params)) query.set(`p.${name}`, String(value));
  for (const { point, strength, radius } of attractors)
    query.append('attractor', [...point, strength, radius].join(','));
  if (query.size > 0) query.set('v', VERSION);
  const text = query.toString().replaceAll('%2C', ',');
  return text ? `${ADDRESS}?${text}` : ADDRESS;
}

/**
 * Parses the hash of an address; undefined if it is for another lab or contains no settings. Settings that cannot be
 * parsed are ignored; whether names and values are valid is not checked here.
 */
export function fromHash(hash: string): Linked | undefined {
  const query = queryOf(hash, ADDRESS);
  if (!query) return undefined;
  const [sphere] = listsIn(query, 'sphere', 4, 1);
  const attractors = listsIn(query, 'attractor', 5, MOST_ATTRACTORS);
  const { color, ...names } = textsIn(query, ['example', 'file', 'start', 'color']);
  const linked: Linked = {
    ...names,
    ...numbersIn(query, ['frame', 'bubbles', 'levels', 'edge']),
    ...(sphere && { sphere: { center: sphere.slice(0, 3) as Vec3, radius: sphere[3] ?? 1 } }),
    params: paramsIn(query),
    attractors: attractors.map(([x = 0, y = 0, z = 0, strength = 0, radius = 1]) => {
      return { point: [x, y, z], strength, radius };
    }),
    ...(color && { color: color as ColorMode }),
  };
  return query.has('v') ? linked : asBefore(linked);
}

/**
 * Adds to the settings in a link without a version number the defaults of that time, on which it relies. Figures are
 * excepted: they set all parameters themselves.
 */
function asBefore(linked: Linked): Linked {
  if (isPreset(exampleById(linked.example ?? ''))) return linked;
  return { start: 'enclosing', ...linked, params: { ...PAPER, ...linked.params } };
}
