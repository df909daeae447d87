import type { ComponentChildren } from 'preact';
import { count, lengths, milliseconds } from '../../kit/format';
import { type Fact, OpenData } from '../../lab/example-panel';
import { unitOf } from '../../lab/surface-space';
import { text } from '../../texts';
import { SEGMENT_EXAMPLES, type SegmentExample } from './examples';
import type { OpenedImage } from './protocol';

/** Name of the fact that tells where the label map is from. */
export const MAP_FACT = text('segment.factMap');

/** Returns the data that the lab opens: examples and, by `choosers`, volumes and label maps. */
export function segmentData(
  choosers: ComponentChildren,
  onExample: (example: SegmentExample) => void,
): OpenData<SegmentExample> {
  const contents = {
    groups: [{ label: text('extract.groupVolumes'), examples: SEGMENT_EXAMPLES }],
    facts: [
      text('labs.factFile'),
      MAP_FACT,
      text('extract.factVoxels'),
      text('labs.factVoxelSize'),
      text('segment.factSurfaces'),
    ],
    choosers,
    help: text('segment.dropHelp'),
  };
  return new OpenData<SegmentExample>(contents, onExample);
}

/** Returns the facts about an open volume and its label map. */
export function factsOf(
  { volume, labelFile, looksLike, milliseconds: duration }: OpenedImage,
  example: SegmentExample | undefined,
): Fact[] {
  const sizes = volume.spacing.map((x) => Number(x.toPrecision(3)));
  return [
    [text('labs.factFile'), volume.name],
    [MAP_FACT, labelFile ?? (example?.labelling ? text('segment.computedMap') : text('segment.emptyMap'))],
    [text('extract.factVoxels'), volume.dims.join(' × ')],
    [text('labs.factVoxelSize'), lengths(sizes, example?.unit ?? unitOf(volume))],
    [text('segment.factSurfaces'), milliseconds(duration)],
    ...(looksLike > 0 && !example ? [likenessOf(looksLike)] : []),
    ...(volume.remarks ?? []).map((remark): Fact => [text('labs.factNote'), remark]),
  ];
}

const likenessOf = (labels: number): Fact => [
  text('labs.factNote'),
  labels > 1 ? text('segment.openedAsMap', { labels: count(labels) }) : text('segment.looksLikeMask'),
];
