import type { Unit } from '../../engine/protocol';
import { text } from '../../texts';
import type { Labelling } from './protocol';

/** An example of the Segment lab: a volume, with a computed label map or an empty one. */
export interface SegmentExample {
  id: string;
  name: string;
  /** File of the volume, served with the page. */
  file: string;
  labelling?: Labelling;
  /** Names of the labels, from the value 1 on. */
  labels: string[];
  unit: Unit;
  /** Intensities that the threshold brush paints at first. */
  range: [number, number];
  credit: string;
}

/** The examples of the Segment lab. The first one opens by default. */
export const SEGMENT_EXAMPLES: [SegmentExample, ...SegmentExample[]] = [
  {
    id: 'tooth',
    name: text('segment.toothName'),
    file: 'tooth.nrrd',
    labelling: 'tooth',
    labels: [text('segment.enamel'), text('segment.dentine'), text('segment.pulp')],
    unit: '',
    range: [1000, 1300],
    credit: text('segment.toothCredit'),
  },
  {
    id: 'head',
    name: text('segment.headName'),
    file: 'visible-human-head.nii.gz',
    labelling: 'head',
    labels: [text('segment.bone')],
    unit: 'mm',
    range: [95, 255],
    credit: text('segment.headCredit'),
  },
  {
    id: 'ovule',
    name: text('segment.ovuleName'),
    file: 'ovule.nrrd',
    labels: [text('segment.cell')],
    unit: 'µm',
    range: [0, 60],
    credit: text('segment.ovuleCredit'),
  },
];

/** Returns the example with this id, undefined if there is none. */
export function segmentExampleById(id: string): SegmentExample | undefined {
  return SEGMENT_EXAMPLES.find((example) => example.id === id);
}
