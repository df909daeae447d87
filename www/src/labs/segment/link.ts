/** Converts the Segment lab's settings to the hash of an address, `#segment?…`, and back. */
import type { ParamValues } from '../../engine/protocol';
import { differing, numbersIn, paramsIn, queryOf, textsIn } from '../../lab/link-query';
import { SEGMENT_EXAMPLES, type SegmentExample } from './examples';
import type { SegmentViewOptions } from './scene';

const ADDRESS = '#segment';

export const INITIAL_VIEW: SegmentViewOptions = { edges: false, outlines: true, slices: 'walls', opacity: 0.5 };

/** Settings of the Segment lab that are contained in a link; missing ones are as by default. */
export interface LinkedSegment {
  example?: string;
  /** Name of the user's file, if one is open; the link does not contain the file itself. */
  file?: string;
  params: ParamValues;
  view: Partial<SegmentViewOptions>;
}

/** Present settings of the Segment lab, from which a link is made. */
export interface LinkableSegment {
  example: SegmentExample | undefined;
  file: string;
  params: ParamValues;
  /** Default parameters; the link contains only those that differ. */
  defaults: ParamValues;
  view: SegmentViewOptions;
}

/** Returns what a link to the lab's present state contains. Labels that were painted are not part of it. */
export function linkOf({ example, file, params, defaults, view }: LinkableSegment): LinkedSegment {
  return {
    ...(!example && { file }),
    ...(example && example !== SEGMENT_EXAMPLES[0] && { example: example.id }),
    params: differing(params, defaults),
    view: differing({ ...view }, { ...INITIAL_VIEW }),
  };
}

/** Converts the settings in a link to the hash of an address. */
export function toHash({ example, file, params, view }: LinkedSegment): string {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries({ example, file, ...view }))
    if (value !== undefined) query.set(name, String(value));
  for (const [name, value] of Object.entries(params)) query.set(`p.${name}`, String(value));
  const text = query.toString();
  return text ? `${ADDRESS}?${text}` : ADDRESS;
}

/**
 * Parses the hash of an address; undefined if it is for another lab or contains no settings. Settings that cannot be
 * parsed are ignored; whether parameters and view options are valid is not checked here.
 */
export function fromHash(hash: string): LinkedSegment | undefined {
  const query = queryOf(hash, ADDRESS);
  return query && { ...textsIn(query, ['example', 'file']), params: paramsIn(query), view: viewIn(query) };
}

function viewIn(query: URLSearchParams): Partial<SegmentViewOptions> {
  const view: Partial<SegmentViewOptions> = {};
  const { slices } = textsIn(query, ['slices']);
  const { opacity } = numbersIn(query, ['opacity']);
  for (const name of ['edges', 'outlines'] as const) if (query.has(name)) view[name] = query.get(name) === 'true';
  if (slices) view.slices = slices as SegmentViewOptions['slices'];
  if (opacity !== undefined) view.opacity = opacity;
  return view;
}
