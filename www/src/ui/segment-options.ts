import { text } from '../texts';
import type { SegmentViewOptions } from '../view/segmentation';
import { OptionControls, PLACEMENTS, type ViewOption } from './view-options';

const OPTIONS: ViewOption<SegmentViewOptions>[] = [
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'outlines', label: text('segment.outlines') },
  { name: 'slices', label: text('controls.slices'), choices: PLACEMENTS },
  { name: 'opacity', label: text('segment.opacity'), step: 0.05 },
];

/** Controls for the view options of the Segment lab. */
export class SegmentOptionControls extends OptionControls<SegmentViewOptions> {
  constructor(initial: SegmentViewOptions, onChange: (options: SegmentViewOptions) => void) {
    super(OPTIONS, initial, onChange);
  }
}
