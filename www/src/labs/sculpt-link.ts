/** The Sculpt lab's settings as the part of an address after `#sculpt?`, and back. */
import type { ParamValues } from '../protocol';
import { lengthsOf, packed, unpacked } from '../sculpt/ellipsoids';
import { SCENES, type SculptExample } from '../sculpt/examples';
import type { Film } from '../sculpt/film';
import type { Pose } from '../sculpt/protocol';
import { differing, readValue } from './link';

const ADDRESS = '#sculpt';
/** More keyframes than this do not go into a link: some programs cut long addresses. */
export const MOST_KEYS = 12;

export interface LinkedScene {
  example?: string;
  /** The name of a file of one's own: it is not in the link. */
  file?: string;
  params: ParamValues;
  /** Where the ellipsoids go, if by hand. */
  pose?: Pose;
  names?: string[];
  /** A film of one's own; with `loop` alone, the example's film as a loop. */
  keys?: Pose[];
  between?: number;
  loop?: boolean;
  color?: string;
  layout?: string;
}

export interface SceneSettings {
  example: SculptExample | undefined;
  file: string;
  params: ParamValues;
  /** What the parameters are where nothing is said. */
  usual: ParamValues;
  pose: Pose | undefined;
  film: Film | undefined;
  color: string;
  layout: string;
}

/** Only what differs from what the example, or else the method, brings along. */
export function linkOf({ example, file, params, usual, pose, film, color, layout }: SceneSettings): LinkedScene {
  const own = film !== example?.film && film && 'keys' in film && film.keys.length <= MOST_KEYS;
  const looped = film?.loop !== undefined && film.loop !== (example?.film?.loop ?? false);
  return {
    ...(!example && { file }),
    ...(example && example !== SCENES[0] && { example: example.id }),
    params: differing(params, usual),
    ...(pose && { pose }),
    ...(own && { keys: film.keys, between: film.between }),
    ...(looped && { loop: film.loop }),
    ...(color !== (example?.color ?? 'plain') && { color }),
    ...(layout !== (example?.layout ?? 'result') && { layout }),
  };
}

/** The film that a link asks for, on top of the example's. */
export function filmOf({ keys, between, loop }: LinkedScene, usual: Film | undefined): Film | undefined {
  const film = keys && keys.length > 0 ? { keys, between: between ?? 24, loop: false } : usual;
  return film && loop !== undefined ? { ...film, loop } : film;
}

/** To a ten thousandth of the size of each: less than any hand does. */
function asText(pose: Pose): string {
  return pose
    .map((one) =>
      packed(one)
        .map(rounding(1e-4 * Math.max(...lengthsOf(one))))
        .join(','),
    )
    .join(';');
}

function rounding(step: number): (value: number) => number {
  const power = 10 ** Math.floor(Math.log10(step));
  return (value) => Number((Math.round(value / power) * power).toPrecision(10));
}

function asPose(text: string): Pose | undefined {
  const pose = text.split(';').map((one) => unpacked(one.split(',').map(Number)));
  return pose.every((one) => one !== undefined) ? pose : undefined;
}

export function toHash(linked: LinkedScene): string {
  const query = new URLSearchParams();
  for (const name of ['example', 'file', 'color', 'layout', 'between', 'loop'] as const) {
    const value = linked[name];
    if (value !== undefined) query.set(name, String(value));
  }
  for (const [name, value] of Object.entries(linked.params)) query.set(`p.${name}`, String(value));
  if (linked.pose) query.set('pose', asText(linked.pose));
  for (const key of linked.keys ?? []) query.append('key', asText(key));
  const text = query.toString().replaceAll('%2C', ',').replaceAll('%3B', ';');
  return text ? `${ADDRESS}?${text}` : ADDRESS;
}

/** Undefined where the address is not one of this lab with something to say. What makes no sense is left out. */
export function fromHash(hash: string): LinkedScene | undefined {
  const [address = '', text] = hash.split(/\?(.*)/s);
  if (address !== ADDRESS || !text) return undefined;
  const query = new URLSearchParams(text);
  const linked: LinkedScene = { params: {} };
  for (const name of ['example', 'file', 'color', 'layout'] as const) {
    const value = query.get(name);
    if (value) linked[name] = value;
  }
  const between = Number(query.get('between') ?? Number.NaN);
  if (Number.isInteger(between) && between > 0) linked.between = between;
  if (query.has('loop')) linked.loop = query.get('loop') === 'true';
  const pose = asPose(query.get('pose') ?? '');
  if (pose) linked.pose = pose;
  const keys = query.getAll('key').flatMap((key) => [asPose(key) ?? []].filter(({ length }) => length > 0));
  if (keys.length > 0) linked.keys = keys;
  for (const [name, value] of query) if (name.startsWith('p.')) linked.params[name.slice(2)] = readValue(value);
  return linked;
}
