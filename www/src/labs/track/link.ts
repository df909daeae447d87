/** Converts the Track lab's settings to the hash of an address, `#track?…`, and back. */
import type { ParamValues, Vec3 } from '../../engine/protocol';
import { differing, listOf, paramsIn, queryOf, readValue, textsIn } from '../../lab/link-query';
import { IMAGES, OWN_PREPARATION, type TrackExample } from './examples';
import { viewOf } from './presets';
import type { Box, Cavity, Enrichment, Preparation, Setup } from './protocol';
import type { TrackViewOptions } from './scene';

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
}

/** Present settings of the Track lab, from which a link is made. */
export interface LinkableTrack {
  example: TrackExample | undefined;
  file: string;
  setup: Setup;
  view: TrackViewOptions;
  /** Whether the lab asks for the object, so that the region and the surface are not chosen yet. */
  asks?: boolean;
}

const SWITCHES = ['surface', 'edges', 'region'] as const;
const ENRICHMENTS: readonly string[] = ['none', 'linear', 'flow'] satisfies Enrichment[];

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
export function toHash({ example, file, params, preparation, box, at, cavity, view }: LinkedTrack): string {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries({ example, file, ...preparation, ...view }))
    if (value !== undefined) query.set(name, String(value));
  if (box) query.set('box', box === 'whole' ? box : [...box.min, ...box.max].join(','));
  if (at) query.set('at', at === 'largest' ? at : at.join(','));
  if (cavity) query.set('cavity', cavity);
  for (const [name, value] of Object.entries(params)) query.set(`p.${name}`, String(value));
  const text = query.toString().replaceAll('%2C', ',');
  return text ? `${ADDRESS}?${text}` : ADDRESS;
}

/**
 * Parses the hash of an address; undefined if it is for another lab or contains no settings. Settings that cannot be
 * parsed are ignored; whether parameters and view options are valid is not checked here.
 */
export function fromHash(hash: string): LinkedTrack | undefined {
  const query = queryOf(hash, ADDRESS);
  if (!query) return undefined;
  const linked: LinkedTrack = {
    ...textsIn(query, ['example', 'file']),
    params: paramsIn(query, paramOf),
    preparation: preparationOf(query),
    view: viewIn(query),
  };
  const [box, at] = [listOf(query.get('box') ?? '', 6), listOf(query.get('at') ?? '', 3)];
  if (box) linked.box = { min: box.slice(0, 3) as Vec3, max: box.slice(3) as Vec3 };
  else if (query.get('box') === 'whole') linked.box = 'whole';
  if (at) linked.at = at as Vec3;
  else if (query.get('at') === 'largest') linked.at = 'largest';
  if (query.get('cavity') === 'closed') linked.cavity = 'closed';
  return linked;
}

function paramOf(text: string): unknown {
  return text === 'true' ? true : text === 'false' ? false : readValue(text);
}

function preparationOf(query: URLSearchParams): Partial<Preparation> {
  const [binning, factor] = [Number(query.get('binning')), Number(query.get('factor') ?? Number.NaN)];
  const enrichment = query.get('enrichment') ?? '';
  return {
    ...((binning === 1 || binning === 2) && { binning }),
    ...(ENRICHMENTS.includes(enrichment) && { enrichment: enrichment as Enrichment }),
    ...(Number.isInteger(factor) && factor >= 0 && { factor }),
  };
}

function viewIn(query: URLSearchParams): Partial<TrackViewOptions> {
  const view: Partial<TrackViewOptions> = {};
  for (const name of SWITCHES) if (query.has(name)) view[name] = query.get(name) === 'true';
  const { votes, slices, below } = textsIn(query, ['votes', 'slices', 'below']);
  if (votes) view.votes = votes as TrackViewOptions['votes'];
  if (slices) view.slices = slices as TrackViewOptions['slices'];
  if (below) view.below = below as TrackViewOptions['below'];
  return view;
}
