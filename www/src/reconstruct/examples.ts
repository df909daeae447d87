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
  /** −1 to view it from behind at first; see `ReconstructionView.setCloud`. */
  front?: -1;
  maxPoints?: number;
  keepComponents?: number;
  params: ParamValues;
  color: SurfaceColor;
  credit: string;
}

const SPOT = 'Spot by Keenan Crane, public domain; rendered and turned into points for this page.';

/** The examples of the Reconstruct lab. The first one opens by default. */
export const CLOUDS: [CloudExample, ...CloudExample[]] = [
  {
    id: 'spot-stereo',
    name: 'Cow, 24 stereo photographs',
    source: { file: 'spot/stereo.ply' },
    photographs: 'spot',
    up: 'y',
    front: -1,
    keepComponents: 1,
    params: {},
    color: 'own',
    credit: `${SPOT} As stereo gives them: distances in steps, 4 % strays, nothing from below.`,
  },
  {
    id: 'spot-carved',
    name: 'Cow, carved out of silhouettes',
    source: { file: 'spot/carved.ply' },
    photographs: 'spot',
    up: 'y',
    front: -1,
    params: {},
    color: 'own',
    credit: `${SPOT} The voxels that are left when everything outside the 24 silhouettes is taken away.`,
  },
  {
    id: 'angel',
    name: 'Angel, laser scan',
    source: { file: 'angel.ply' },
    up: 'z',
    params: {},
    color: 'plain',
    credit:
      'Angel statue: scan by Ivan Nikolov (GGG-BenchmarkSfM), CC BY 4.0; decimated, triangles dropped, points shuffled. Its base is open.',
  },
  {
    id: 'torus',
    name: 'Torus with noise',
    source: { shape: 'torus' },
    up: 'z',
    params: {},
    color: 'plain',
    credit: 'Computed: 3,000 points, noise of 0.02 where the ring has a radius of 1.',
  },
  {
    id: 'two-balls',
    name: 'Two balls',
    source: { shape: 'two balls' },
    up: 'z',
    params: {},
    color: 'plain',
    credit: 'Computed: 1,600 points on two balls. One function, two components.',
  },
];

/** Returns the address of a data file served with the page. */
export function dataUrl(file: string): string {
  return new URL(`data/${file}`, document.baseURI).href;
}
