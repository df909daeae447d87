/** Converts the Segment lab's settings to the hash of an address, `#segment?…`, and back. */
import type { ParamValues } from '../../engine/protocol';
import { initialOptions } from '../../kit/view';
import { linkFormat, name } from '../../lab/link-fields';
import { differing } from '../../lab/link-query';
import { SEGMENT_EXAMPLES, type SegmentExample } from './examples';
import { SEGMENT_VIEW, type SegmentViewOptions } from './view';

const ADDRESS = '#segment';

/** Settings of the Segment lab that are contained in a link; missing ones are as by default. */
export interface LinkedSegment {
  example?: string;
  /** Name of the user's file, if one is open; the link does not contain the file itself. */
  file?: string;
  params: ParamValues;
  view: Partial<SegmentViewOptions>;
  unread?: string[];
}

const FORMAT = linkFormat(ADDRESS, { example: name, file: name }, SEGMENT_VIEW);

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
    view: differing({ ...view }, { ...initialOptions(SEGMENT_VIEW) }),
  };
}

/** Converts the settings in a link to the hash of an address. */
export const toHash = (linked: LinkedSegment): string => FORMAT.toHash(linked);

/** Parses the hash of an address; undefined if it is for another lab or contains no settings. */
export const fromHash = (hash: string): LinkedSegment | undefined => FORMAT.fromHash(hash);
