/** Converts the Track lab's settings to the hash of an address, `#track?…`, and back. */
import type { ParamValues, Vec3 } from '../../engine/protocol';
import { among, as, type Field, flag, integer, linkFormat, name, numbers, oneOf, point } from '../../lab/link-fields';
import { differing, readValue } from '../../lab/link-query';
import { IMAGES, OWN_PREPARATION, type TrackExample } from './examples';
import { viewOf } from './presets';
import type { Box, Cavity, Preparation, Setup } from './protocol';
import { TRACK_VIEW, type TrackViewOptions } from './view';

const ADDRESS = '#track';

/** Settings of the Track lab that are contained in a link; missing ones are as in the example, or else the defaults. */
export interface LinkedTrack {
  example?: string;
  /** Name of the user's file, if one is open; the link does not contain the file itself. */
  file?: string;
  params: ParamValues;
  preparation: Partial<Preparation>;
  box?: Box | 'whole';
  at?: Vec3 | 'largest';
  cavity?: Cavity;
  view: Partial<TrackViewOptions>;
  unread?: string[];
}

/** A word, or else what another field has. */
const orWord = <const Word extends string, T>(word: Word, field: Field<T>): Field<Word | T> => ({
  read: (text) => (text === word ? word : field.read(text)),
  write: (value) => (value === word ? word : field.write(value as T)),
});

const box = as(
  numbers(6),
  (ends): Box => ({ min: ends.slice(0, 3) as Vec3, max: ends.slice(3) as Vec3 }),
  ({ min, max }) => [...min, ...max],
);
const binning = as(
  oneOf(['1', '2']),
  (text) => Number(text) as Preparation['binning'],
  (value) => (value === 1 ? '1' : '2'),
);

const PREPARATION = { binning, enrichment: oneOf(['none', 'linear', 'flow']), factor: integer(0) };
const FORMAT = linkFormat(
  ADDRESS,
  {
    ...{ example: name, file: name, ...PREPARATION },
    ...{ box: orWord('whole', box), at: orWord('largest', point), cavity: oneOf(['closed', 'open']) },
  },
  TRACK_VIEW,
  paramOf,
);

/** Present settings of the Track lab, from which a link is made. */
export interface LinkableTrack {
  example: TrackExample | undefined;
  file: string;
  setup: Setup;
  view: TrackViewOptions;
  /** Whether the lab asks for the object, so that the region and the surface are not chosen yet. */
  asks?: boolean;
}

/**
 * Returns the setup of the tracker that an example, or else the user's own image, opens with, changed by the settings
 * in a link.
 */
export function setupOf(example: TrackExample | undefined, linked?: LinkedTrack): Setup {
  const { box, at, cavity } = linked ?? {};
  return {
    preparation: { ...(example?.preparation ?? OWN_PREPARATION), ...linked?.preparation },
    box: box === 'whole' ? undefined : (box ?? example?.box),
    at: at === 'largest' ? undefined : (at ?? example?.at),
    ...(cavity === 'closed' && { cavity }),
    params: { ...example?.params, ...linked?.params },
  };
}

/**
 * Returns what a link to the lab's present state contains: the settings that differ from those of the example, or else
 * from the defaults.
 */
export function linkOf({ example, file, setup, view, asks }: LinkableTrack): LinkedTrack {
  const usual = setupOf(example);
  const same = (one: unknown, other: unknown) => JSON.stringify(one) === JSON.stringify(other);
  // Else the lab would ask for the object.
  const isWhole = !example && !asks && !isChosen(setup);
  return {
    ...(!example && { file }),
    ...(example && example !== IMAGES[0] && { example: example.id }),
    params: differing(setup.params, usual.params),
    preparation: differing({ ...setup.preparation }, { ...usual.preparation }),
    ...((!same(setup.box, usual.box) || isWhole) && { box: setup.box ?? 'whole' }),
    ...(!same(setup.at, usual.at) && { at: setup.at ?? 'largest' }),
    ...(setup.cavity === 'closed' && { cavity: setup.cavity }),
    view: differing({ ...view }, { ...viewOf(example) }),
  };
}

/** Tests whether a region or a surface was chosen, so that the lab need not ask for the object. */
export function isChosen({ box, at }: Pick<LinkedTrack, 'box' | 'at'> | Setup): boolean {
  return box !== undefined || at !== undefined;
}

/** Converts the settings in a link to the hash of an address, with all digits, which give the same surfaces to the bit. */
export const toHash = ({ preparation, ...settings }: LinkedTrack): string =>
  FORMAT.toHash({ ...settings, ...preparation });

/** Parses the hash of an address; undefined if it is for another lab or contains no settings. */
export function fromHash(hash: string): LinkedTrack | undefined {
  const found = FORMAT.fromHash(hash);
  if (!found) return undefined;
  const { binning, enrichment, factor, ...settings } = found;
  const preparation = among({ binning, enrichment, factor }, ['binning', 'enrichment', 'factor']);
  return { ...settings, preparation };
}

function paramOf(text: string): unknown {
  return flag.read(text) ?? readValue(text);
}
