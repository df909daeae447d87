import type { ComponentChildren } from 'preact';
import type { VolumeView } from '../../engine/protocol';
import { count, figure, lengths } from '../../kit/format';
import { type Fact, OpenData } from '../../lab/example-panel';
import { text } from '../../texts';
import { EXAMPLES, type Example } from './examples';
import { PRESETS } from './presets';

/** Returns the data that the lab opens: examples and files; `chooser` opens files, and `more` are further controls. */
export function extractData(
  chooser: ComponentChildren,
  more: ComponentChildren,
  onExample: (example: Example) => void,
): OpenData<Example> {
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
    choosers: chooser,
    help: text('extract.dropHelp'),
    more,
  };
  return new OpenData<Example>(contents, onExample);
}

/** Returns the facts about an open volume. */
export function factsOf({ name, dims, spacing, range, large, frames, remarks = [] }: VolumeView, unit: string): Fact[] {
  const facts: Fact[] = [
    [text('labs.factFile'), name],
    [text('extract.factVoxels'), dims.join(' × ')],
    [text('labs.factVoxelSize'), lengths(spacing, unit)],
    [text('extract.sectionIntensities'), text('extract.range', { low: figure(range[0]), high: figure(range[1]) })],
  ];
  if (large) facts.push([text('extract.factLevels'), large.levels.map((level) => level.join(' × ')).join(', ')]);
  if (frames > 1) facts.push([text('labs.frames'), count(frames)]);
  return [...facts, ...remarks.map((remark): Fact => [text('labs.factNote'), remark])];
}
