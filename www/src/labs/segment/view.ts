/** The options of the Segment lab's view. */
import { EDGES, fraction, type OptionsOf, onOff, SLICES } from '../../kit/view';

export const SEGMENT_VIEW = {
  edges: EDGES,
  /** Outlines of the surfaces on the slices. */
  outlines: onOff('segment.outlines', true),
  slices: SLICES,
  /** Opacity of the labels on the slices. */
  opacity: fraction('segment.opacity', 0.5, 0.05),
};
export type SegmentViewOptions = OptionsOf<typeof SEGMENT_VIEW>;
