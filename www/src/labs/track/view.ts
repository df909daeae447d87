/** The options of the Track lab's view, with what is shown below it. */
import { EDGES, type OptionsOf, oneOf, onOff, SLICES, SURFACE } from '../../kit/view';

/** Boundary votes: those near the surface (all if the frame has no surface), or all in the region of interest. */
const VOTES = oneOf(
  'trackPanels.boundary',
  { none: 'trackPanels.votesHidden', near: 'trackPanels.votesNear', all: 'trackPanels.votesAll' },
  'none',
);

/** Content below the 3D view: the slices, or one of the paper's figures. */
const BELOW = oneOf(
  'trackPanels.below',
  {
    slices: 'trackPanels.belowSlices',
    boundary: 'trackPanels.belowBoundary',
    time: 'trackPanels.belowTime',
    between: 'trackPanels.belowBetween',
  },
  'slices',
);

export const TRACK_VIEW = {
  surface: SURFACE,
  edges: EDGES,
  region: onOff('trackPanels.viewBox', true),
  votes: VOTES,
  slices: SLICES,
  below: BELOW,
};
export type TrackViewOptions = OptionsOf<typeof TRACK_VIEW>;
