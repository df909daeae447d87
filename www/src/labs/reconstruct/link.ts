/** Converts the Reconstruct lab's settings to the hash of an address, `#reconstruct?…`, and back. */
import { shortenedPoint } from '../../engine/placing';
import type { ParamValues, Vec3 } from '../../engine/protocol';
import { type Field, integer, linkFormat, many, name, point } from '../../lab/link-fields';
import { differing } from '../../lab/link-query';
import { withPaper } from './before';
import { CLOUDS, type CloudExample, viewOf } from './examples';
import type { CloudChoice } from './panels/cloud-setup';
import { isCloudPreset } from './presets';
import type { Edits } from './protocol';
import { CLOUD_VIEW, type CloudViewOptions } from './view';

const ADDRESS = '#reconstruct';
/** Significant digits of coordinates: finer than any click. */
const DIGITS = 6;
/** Most points changed by hand that a link includes: some programs truncate long addresses. */
export const MOST_EDITS = 200;

/**
 * Version number of the defaults that a link relies on. Links without a version were written when the defaults were the
 * paper's values, on which examples and figures still rely.
 */
const VERSION = '2';

/**
 * Settings of the Reconstruct lab that are contained in a link; missing ones are as in the example, or else the
 * method's defaults.
 */
export interface LinkedCloud extends Partial<CloudChoice> {
  example?: string;
  /** Name of the user's file, if one is open; the link does not contain the file itself. */
  file?: string;
  params: ParamValues;
  edits: Edits;
  view: Partial<CloudViewOptions>;
  /** Number of the photograph whose camera the view uses, from 1; 0 for none. */
  photo?: number;
  unread?: string[];
}

/** Indices of points, each once. */
const indices: Field<number[]> = {
  read: (text) => {
    const all = text.split(',', MOST_EDITS + 1).map(Number);
    const isRead = text !== '' && all.length <= MOST_EDITS && all.every((one) => Number.isInteger(one) && one >= 0);
    return isRead ? [...new Set(all)] : undefined;
  },
  write: (all) => all.join(','),
};

const FORMAT = linkFormat(
  ADDRESS,
  {
    ...{ example: name, file: name, maxPoints: integer(0), keepComponents: integer(0), photo: integer(0) },
    ...{ add: many(point, MOST_EDITS), outside: many(point, MOST_EDITS), remove: indices, v: name },
  },
  CLOUD_VIEW,
);

/** Present settings of the Reconstruct lab, from which a link is made. */
export interface CloudSettings {
  example: CloudExample | undefined;
  file: string;
  choice: CloudChoice;
  params: ParamValues;
  defaults: ParamValues;
  edits: Edits;
  /** Size of the points, to which coordinates are rounded. */
  size: number;
  view: CloudViewOptions;
  photo: number | undefined;
}

/**
 * Returns what a link to the lab's present state contains: the settings that differ from those of the example, or else
 * from the method's defaults; the points changed by hand only if there are few enough. `maxPoints` is 0 for the default
 * number of points, `keepComponents` is 0 for all clusters.
 */
export function linkOf(settings: CloudSettings): LinkedCloud {
  const { example, file, choice, params, defaults, edits, size, view, photo } = settings;
  const short = (points: Vec3[]) => points.map((point) => shortenedPoint(point, DIGITS, size));
  const { maxPoints, keepComponents } = choice;
  return {
    ...(!example && { file }),
    ...(example && example !== CLOUDS[0] && { example: example.id }),
    ...(maxPoints !== example?.maxPoints && { maxPoints: maxPoints ?? 0 }),
    ...(keepComponents !== example?.keepComponents && { keepComponents: keepComponents ?? 0 }),
    params: differing(params, { ...defaults, ...example?.params }),
    edits: fits(edits)
      ? { ...edits, added: short(edits.added), outside: short(edits.outside) }
      : { added: [], removed: [], outside: [] },
    view: differing({ ...view }, { ...viewOf(example) }),
    ...(photo !== photoOf(example) && { photo: photo === undefined ? 0 : photo + 1 }),
  };
}

/** Returns the index of the photograph whose camera the view uses when an example opens, undefined if none. */
function photoOf(example: CloudExample | undefined): number | undefined {
  return isCloudPreset(example) ? example.photo : undefined;
}

/**
 * Returns the index of the photograph whose camera the view uses at first, undefined if none: that of a link, `photo`,
 * which counts from 1 and is 0 for none, or else the example's.
 */
export function photoFor(example: CloudExample | undefined, photo: number | undefined): number | undefined {
  if (photo === undefined) return photoOf(example);
  return photo > 0 ? photo - 1 : undefined;
}

/** Tests whether the points changed by hand are few enough for a link. */
export function fits({ added, removed, outside }: Edits): boolean {
  return added.length + removed.length + outside.length <= MOST_EDITS;
}

/**
 * Returns `choice`, the numbers of points to use and of clusters to keep, with those in a link in place of its own; 0
 * in a link stands for the default number of points, and for all clusters.
 */
export function withLink(choice: CloudChoice, { maxPoints, keepComponents }: Partial<CloudChoice>): CloudChoice {
  return {
    maxPoints: maxPoints === undefined ? choice.maxPoints : maxPoints || undefined,
    keepComponents: keepComponents === undefined ? choice.keepComponents : keepComponents || undefined,
  };
}

/** Converts the settings in a link to the hash of an address. */
export function toHash({ edits, ...settings }: LinkedCloud): string {
  const { added: add, outside, removed } = edits;
  const version = settings.file !== undefined && settings.example === undefined;
  return FORMAT.toHash({
    ...{ ...settings, add, outside },
    ...(removed.length > 0 && { remove: removed }),
    ...(version && { v: VERSION }),
  });
}

/** Parses the hash of an address; undefined if it is for another lab or contains no settings. */
export function fromHash(hash: string): LinkedCloud | undefined {
  const found = FORMAT.fromHash(hash);
  if (!found) return undefined;
  const { v, add: added = [], outside = [], remove: removed = [], ...settings } = found;
  const linked = { ...settings, edits: { added, outside, removed } };
  const isBefore = v === undefined && linked.file !== undefined && linked.example === undefined;
  return isBefore ? withPaper(linked) : linked;
}
