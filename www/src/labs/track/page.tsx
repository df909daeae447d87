import type { ComponentChildren } from 'preact';
import { lengths, milliseconds } from '../../kit/format';
import { type Fact, OpenData } from '../../lab/example-panel';
import { text } from '../../texts';
import { IMAGES, type TrackExample } from './examples';
import { TRACK_PRESETS } from './presets';
import type { OpenedImage } from './protocol';

/** Returns the data that the lab opens: examples and, by `chooser`, files. */
export function imageData(
  chooser: ComponentChildren,
  onExample: (example: TrackExample) => void,
): OpenData<TrackExample> {
  const contents = {
    groups: [
      { label: text('track.groupImages'), examples: IMAGES },
      { label: text('labs.groupFigures'), examples: TRACK_PRESETS },
    ],
    facts: [
      text('labs.factFile'),
      text('labs.frames'),
      text('extract.factVoxels'),
      text('labs.factVoxelSize'),
      text('track.factPrepared'),
      text('track.factOpening'),
    ],
    choosers: chooser,
    help: text('track.dropHelp'),
  };
  return new OpenData<TrackExample>(contents, onExample);
}

/** Returns the facts about an open image. */
export function factsOf({ dims, spacing, volume, openingMs }: OpenedImage, name: string, unit: string): Fact[] {
  const sizes = (values: readonly number[], unit = '') =>
    lengths(
      values.map((x) => Number(x.toPrecision(3))),
      unit,
    );
  return [
    [text('labs.factFile'), name],
    [text('labs.frames'), String(volume.frames)],
    [text('extract.factVoxels'), sizes(dims)],
    [text('labs.factVoxelSize'), sizes(spacing, unit)],
    [text('track.factPrepared'), sizes(volume.dims)],
    [text('track.factOpening'), milliseconds(openingMs)],
    ...(volume.remarks ?? []).map((remark): Fact => [text('labs.factNote'), remark]),
  ];
}
