import { text } from '../texts';
import type { SurfaceColor } from '../view/surface';
import type { PointShape } from './clouds';
import type { ParamValues } from './protocol';

/** An example of the Reconstruct lab: points, suitable settings and credits. */
export interface CloudExample {
  id: string;
  name: string;
  /** A file served with the page, or a computed shape. */
  source: { file: string } | { shape: PointShape };
  /** Folder with the photographs that the points were made from, and their cameras. */
  photographs?: string;
  up: 'y' | 'z';
  /** −1 to show the example from behind at first; by default it is seen from the front. */
  front?: -1;
  maxPoints?: number;
  keepComponents?: number;
  params: ParamValues;
  color: SurfaceColor;
  credit: string;
}

const SPOT = text('reconstructPresets.spotCredit');

/** The examples of the Reconstruct lab. The first one opens by default. */
export const CLOUDS: [CloudExample, ...CloudExample[]] = [
  {
    id: 'spot-stereo',
    name: text('reconstructPresets.spotStereoName'),
    source: { file: 'spot/stereo.ply' },
    photographs: 'spot',
    up: 'y',
    front: -1,
    keepComponents: 1,
    params: {},
    color: 'own',
    credit: `${SPOT} ${text('reconstructPresets.spotStereoCredit')}`,
  },
  {
    id: 'spot-carved',
    name: text('reconstructPresets.spotCarvedName'),
    source: { file: 'spot/carved.ply' },
    photographs: 'spot',
    up: 'y',
    front: -1,
    params: {},
    color: 'own',
    credit: `${SPOT} ${text('reconstructPresets.spotCarvedCredit')}`,
  },
  {
    id: 'angel',
    name: text('reconstructPresets.angelName'),
    source: { file: 'angel.ply' },
    up: 'z',
    params: {},
    color: 'plain',
    credit: text('reconstructPresets.angelCredit'),
  },
  {
    id: 'torus',
    name: text('reconstructPresets.torusName'),
    source: { shape: 'torus' },
    up: 'z',
    params: {},
    color: 'plain',
    credit: text('reconstructPresets.torusCredit'),
  },
  {
    id: 'two-balls',
    name: text('reconstructPresets.twoBallsName'),
    source: { shape: 'two balls' },
    up: 'z',
    params: {},
    color: 'plain',
    credit: text('reconstructPresets.twoBallsCredit'),
  },
];

/** Returns the address of a data file served with the page. */
export function dataUrl(file: string): string {
  return new URL(`data/${file}`, document.baseURI).href;
}
