/** Random values of the options of a lab's view, by their declaration. */
import fc, { type Arbitrary } from 'fast-check';
import type { OptionsOf, ViewDeclaration, ViewOption } from '../../www/src/kit/view';
import type { LabId } from '../../www/src/lab/address';
import { EXTRACT_VIEW } from '../../www/src/labs/extract/view';
import { CLOUD_VIEW } from '../../www/src/labs/reconstruct/view';
import { SCULPT_VIEW } from '../../www/src/labs/sculpt/view';
import { SEGMENT_VIEW } from '../../www/src/labs/segment/view';
import { TRACK_VIEW } from '../../www/src/labs/track/view';

/** The views of all labs. */
export const VIEWS = {
  extract: EXTRACT_VIEW,
  reconstruct: CLOUD_VIEW,
  sculpt: SCULPT_VIEW,
  track: TRACK_VIEW,
  segment: SEGMENT_VIEW,
} satisfies Record<LabId, ViewDeclaration>;

function anyOf(option: ViewOption): Arbitrary<unknown> {
  if ('entries' in option) return fc.constantFrom(...Object.keys(option.entries));
  return 'step' in option ? fc.double({ min: 0, max: 1, noNaN: true }) : fc.boolean();
}

export function optionsOf<Declared extends ViewDeclaration>(declared: Declared): Arbitrary<OptionsOf<Declared>> {
  const values = Object.entries(declared).map(([name, option]) => [name, anyOf(option)] as const);
  return fc.record(Object.fromEntries(values)) as unknown as Arbitrary<OptionsOf<Declared>>;
}
