import { initialOptions } from '../../kit/view';
import { text } from '../../texts';
import type { PointShape } from './clouds';
import type { ParamValues } from './protocol';
import { CLOUD_VIEW, type CloudViewOptions } from './view';

/** An example of the Reconstruct lab: points, suitable settings and credits. */
export interface CloudExample {
  id: string;
  name: string;
  /** Source of the points: a file served with the page, by its path in the folder `data`, or a computed shape. */
  source: { file: string } | { shape: PointShape };
  /**
   * Folder, within the page's folder `data`, with the photographs that the points were made from and a list of their
   * cameras; undefined if there are none.
   */
  photographs?: string;
  up: 'y' | 'z';
  /** −1 if the object faces away from the default viewpoint, so that the first view is from the opposite side. */
  front?: -1;
  maxPoints?: number;
  keepComponents?: number;
  params: ParamValues;
  /** Options of the view with which the example opens, where they differ from the lab's. */
  view?: Partial<CloudViewOptions>;
  credit: string;
}

/**
 * The paper's values of the parameters that the method chooses from the points by default. Examples, figures, and links and
 * sessions from before it did rely on them.
 */
export const PAPER: ParamValues = { delta: 5, lambdaSurface: 0.001, lambdaExterior: 2, sides: 'outside' };

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
    params: PAPER,
    view: { color: 'own' },
    credit: `${SPOT} ${text('reconstructPresets.spotStereoCredit')}`,
  },
  {
    id: 'spot-carved',
    name: text('reconstructPresets.spotCarvedName'),
    source: { file: 'spot/carved.ply' },
    photographs: 'spot',
    up: 'y',
    front: -1,
    params: PAPER,
    view: { color: 'own' },
    credit: `${SPOT} ${text('reconstructPresets.spotCarvedCredit')}`,
  },
  {
    id: 'angel',
    name: text('reconstructPresets.angelName'),
    source: { file: 'angel.ply' },
    up: 'z',
    params: PAPER,
    credit: text('reconstructPresets.angelCredit'),
  },
  {
    id: 'torus',
    name: text('reconstructPresets.torusName'),
    source: { shape: 'torus' },
    up: 'z',
    params: PAPER,
    credit: text('reconstructPresets.torusCredit'),
  },
  {
    id: 'two-balls',
    name: text('reconstructPresets.twoBallsName'),
    source: { shape: 'two balls' },
    up: 'z',
    params: PAPER,
    credit: text('reconstructPresets.twoBallsCredit'),
  },
];

/** Returns the options of the view with which an example, or else the user's own points without colours, opens. */
export const viewOf = (example: CloudExample | undefined): CloudViewOptions => ({
  ...initialOptions(CLOUD_VIEW),
  ...example?.view,
});
