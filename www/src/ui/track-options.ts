import { text } from '../texts';
import type { ContentBelow, TrackViewOptions, VisibleVotes } from '../view/track';
import type { Choice } from './field';
import { OptionControls, PLACEMENTS, type ViewOption } from './view-options';

const VOTES: Choice<VisibleVotes>[] = [
  { value: 'none', label: text('trackPanels.votesHidden') },
  { value: 'near', label: text('trackPanels.votesNear') },
  { value: 'all', label: text('trackPanels.votesAll') },
];

const BELOW: Choice<ContentBelow>[] = [
  { value: 'slices', label: text('trackPanels.belowSlices') },
  { value: 'boundary', label: text('trackPanels.belowBoundary') },
  { value: 'time', label: text('trackPanels.belowTime') },
  { value: 'between', label: text('trackPanels.belowBetween') },
];

const OPTIONS: ViewOption<TrackViewOptions>[] = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'region', label: text('trackPanels.viewBox') },
  { name: 'votes', label: text('trackPanels.boundary'), choices: VOTES },
  { name: 'slices', label: text('controls.slices'), choices: PLACEMENTS },
  { name: 'below', label: text('trackPanels.below'), choices: BELOW },
];

/** Controls for the view options of the Track lab, including what is shown below the 3D view. */
export class TrackOptionControls extends OptionControls<TrackViewOptions> {
  constructor(initial: TrackViewOptions, onChange: (options: TrackViewOptions) => void) {
    super(OPTIONS, initial, onChange);
  }
}
