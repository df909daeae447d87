import { EXAMPLES, type Example } from '../examples';
import { PRESETS } from '../presets';
import type { VolumeView } from '../protocol';
import { text } from '../texts';
import { figure } from '../ui/format';
import { ExamplePanel, type Fact } from './example-panel';

/** Creates the panel that opens examples and files; `chooser` opens files, `large` volumes larger than memory. */
export function extractData(
  chooser: HTMLElement,
  large: HTMLElement,
  onExample: (example: Example) => void,
): ExamplePanel<Example> {
  const contents = {
    groups: [
      { label: text('extract.groupVolumes'), examples: EXAMPLES },
      { label: text('labs.groupFigures'), examples: PRESETS },
    ],
    facts: [
      text('labs.factFile'),
      text('extract.factVoxels'),
      text('labs.factVoxelSize'),
      text('extract.sectionIntensities'),
    ],
    choosers: [chooser],
    help: text('extract.dropHelp'),
    more: [large],
  };
  return new ExamplePanel<Example>(contents, onExample);
}

/** Returns the facts about an open volume. */
export function factsOf({ name, dims, spacing, range, large, frames }: VolumeView, unit: string): Fact[] {
  const facts: Fact[] = [
    [text('labs.factFile'), name],
    [text('extract.factVoxels'), dims.join(' × ')],
    [text('labs.factVoxelSize'), `${spacing.map(figure).join(' × ')} ${unit}`.trim()],
    [text('extract.sectionIntensities'), text('extract.range', { low: figure(range[0]), high: figure(range[1]) })],
  ];
  if (large) facts.push([text('extract.factLevels'), large.levels.map((level) => level.join(' × ')).join(', ')]);
  if (frames > 1) facts.push([text('labs.frames'), text('extract.framesFirstShown', { count: frames })]);
  return facts;
}
