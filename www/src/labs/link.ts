/** The lab's settings as the part of an address after `#extract?`, and back. */
import { EXAMPLES, type Example } from '../examples';
import { exampleById, isPreset, PAPER, startOf } from '../presets';
import type { Attractor, ParamValues, Vec3 } from '../protocol';
import { isStartKind, type StartChoice } from '../ui/start';
import type { ColorMode } from '../ui/view-options';

export const ADDRESS = '#extract';

/**
 * Links say which defaults they count on. Those without a version were written when the lab started from an enclosing
 * surface, with the method as in the paper.
 */
const VERSION = '2';

export interface Linked {
  /** The example or figure that is open. */
  example?: string;
  /** The name of a file of one's own: it is not in the link. */
  file?: string;
  start?: string;
  bubbles?: number;
  sphere?: { center: Vec3; radius: number };
  levels?: number;
  /** 0 where the model chooses. */
  edge?: number;
  params: ParamValues;
  attractors: Attractor[];
  color?: ColorMode;
}

/** Everything a link may have to tell. */
export interface LabSettings {
  example: Example | undefined;
  /** The name of the file that is open where no example is. */
  file: string;
  choice: StartChoice;
  /** Where the sphere would be that the model may start from. */
  sphere: { center: Vec3; radius: number };
  params: ParamValues;
  /** What the parameters are where nothing is said. */
  defaults: ParamValues;
  attractors: Attractor[];
  color: ColorMode;
}

/** Only what differs from what the example, or else the method, brings along. */
export function linkOf(settings: LabSettings): Linked {
  const { example, file, choice, sphere, params, defaults, attractors, color } = settings;
  const usual = { levels: 1, edge: undefined, ...example };
  const start = startOf(example);
  const bubbles = 'bubbles' in start ? start.bubbles : undefined;
  return {
    ...(!example && { file }),
    ...(example && example !== EXAMPLES[0] && { example: example.id }),
    ...(choice.kind !== start.kind && { start: choice.kind }),
    ...(choice.kind === 'bubbles' && choice.bubbles !== bubbles && { bubbles: choice.bubbles }),
    ...(choice.kind === 'sphere' && { sphere }),
    ...(choice.levels !== usual.levels && { levels: choice.levels }),
    ...(choice.edge !== usual.edge && { edge: choice.edge ?? 0 }),
    params: differing(params, { ...defaults, ...example?.params }),
    attractors,
    ...(color !== 'plain' && { color }),
  };
}

export function differing(values: ParamValues, usual: ParamValues): ParamValues {
  return Object.fromEntries(Object.entries(values).filter(([name, value]) => !Object.is(usual[name], value)));
}

/** A start as a link wants it. */
export function withLink(choice: StartChoice, { start, bubbles, levels, edge }: Linked): StartChoice {
  return {
    kind: isStartKind(start) ? start : choice.kind,
    bubbles: bubbles ?? choice.bubbles,
    levels: levels ?? choice.levels,
    edge: edge === undefined ? choice.edge : edge || undefined,
  };
}

const numbers = (values: number[]) => values.map((value) => Number(value.toPrecision(7))).join(',');

export function toHash(linked: Linked): string {
  const query = new URLSearchParams();
  const { example, file, start, bubbles, sphere, levels, edge, params, attractors, color } = linked;
  for (const [name, value] of Object.entries({ example, file, start, bubbles, levels, edge, color }))
    if (value !== undefined) query.set(name, String(value));
  if (sphere) query.set('sphere', numbers([...sphere.center, sphere.radius]));
  for (const [name, value] of Object.entries(params)) query.set(`p.${name}`, String(value));
  for (const { point, strength, radius } of attractors)
    query.append('attractor', numbers([...point, strength, radius]));
  if (query.size > 0) query.set('v', VERSION);
  const text = query.toString().replaceAll('%2C', ',');
  return text ? `${ADDRESS}?${text}` : ADDRESS;
}

/** What an address asks for; nothing where it is not this lab's or says nothing. What makes no sense is left out. */
export function fromHash(hash: string): Linked | undefined {
  const [address, text] = hash.split(/\?(.*)/s, 2);
  if (address !== ADDRESS || !text) return undefined;
  const query = new URLSearchParams(text);
  const linked: Linked = { params: {}, attractors: [] };
  for (const name of ['example', 'file', 'start'] as const) {
    const value = query.get(name);
    if (value) linked[name] = value;
  }
  for (const name of ['bubbles', 'levels', 'edge'] as const) {
    const value = Number(query.get(name) ?? Number.NaN);
    if (Number.isFinite(value)) linked[name] = value;
  }
  const [sphere] = listsOf(query, 'sphere', 4);
  if (sphere) linked.sphere = { center: sphere.slice(0, 3) as Vec3, radius: sphere[3] ?? 1 };
  for (const [x = 0, y = 0, z = 0, strength = 0, radius = 1] of listsOf(query, 'attractor', 5))
    linked.attractors.push({ point: [x, y, z], strength, radius });
  for (const [name, value] of query) if (name.startsWith('p.')) linked.params[name.slice(2)] = readValue(value);
  const color = query.get('color');
  if (color) linked.color = color as ColorMode;
  return query.has('v') ? linked : asBefore(linked);
}

/** A link without a version, as it was meant. A figure brings all of that along. */
function asBefore(linked: Linked): Linked {
  if (isPreset(exampleById(linked.example ?? ''))) return linked;
  return { start: 'enclosing', ...linked, params: { ...PAPER, ...linked.params } };
}

export function readValue(text: string): unknown {
  const value = Number(text);
  return text !== '' && Number.isFinite(value) ? value : text;
}

function listsOf(query: URLSearchParams, name: string, length: number): number[][] {
  const lists = query.getAll(name).map((text) => text.split(',').map(Number));
  return lists.filter((list) => list.length === length && list.every(Number.isFinite));
}
