import type { Choice } from '../../../kit/field';
import { PLACEMENTS, type ViewOption } from '../../../kit/view-options';
import { text } from '../../../texts';
import type { ContentBelow, TrackViewOptions, VisibleVotes } from '../scene';

export const VOTES: Choice<VisibleVotes>[] = [
  { value: 'none', label: text('trackPanels.votesHidden') },
  { value: 'near', label: text('trackPanels.votesNear') },
  { value: 'all', label: text('trackPanels.votesAll') },
];

export const BELOW: Choice<ContentBelow>[] = [
  { value: 'slices', label: text('trackPanels.belowSlices') },
  { value: 'boundary', label: text('trackPanels.belowBoundary') },
  { value: 'time', label: text('trackPanels.belowTime') },
  { value: 'between', label: text('trackPanels.belowBetween') },
];

/** Options of the Track lab's view, including what is shown below it. */
export const TRACK_OPTIONS: ViewOption<TrackViewOptions>[] = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'region', label: text('trackPanels.viewBox') },
  { name: 'votes', label: text('trackPanels.boundary'), choices: VOTES },
  { name: 'slices', label: text('controls.slices'), choices: PLACEMENTS },
  { name: 'below', label: text('trackPanels.below'), choices: BELOW },
];
