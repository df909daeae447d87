import { PLACEMENTS, type ViewOption } from '../../../kit/view-options';
import { text } from '../../../texts';
import type { SegmentViewOptions } from '../scene';

/** Options of the Segment lab's view. */
export const SEGMENT_OPTIONS: ViewOption<SegmentViewOptions>[] = [
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'outlines', label: text('segment.outlines') },
  { name: 'slices', label: text('controls.slices'), choices: PLACEMENTS },
  { name: 'opacity', label: text('segment.opacity'), step: 0.05 },
];
