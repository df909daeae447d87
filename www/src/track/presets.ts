/** Presets of the Track lab: the paper's figures, on images that are served with the page. */
import type { ParamValues } from '../protocol';
import type { TrackViewOptions } from '../view/beating';
import { FILMS, HEART, type TrackExample } from './examples';

/** One picture of a figure: the same image with other parameters and view options. */
export interface TrackVariant {
  id: string;
  name: string;
  came: string;
  /** Parameters that differ from the figure's. */
  params: ParamValues;
  view: Partial<TrackViewOptions>;
}

/** A figure of the paper, as an example of the Track lab. */
export interface TrackPreset extends TrackExample {
  saw: string;
  variants: [TrackVariant, ...TrackVariant[]];
  hint?: string;
}

const PLAIN_VIEW: TrackViewOptions = {
  surface: true,
  edges: false,
  votes: 'none',
  region: true,
  slices: 'walls',
  below: 'slices',
};

export const TRACK_PRESETS: TrackPreset[] = [
  {
    id: 'figure-2',
    name: 'Figure 2: which side is inside',
    ...HEART,
    saw: 'Voxels around a point are told by their distance along its normal: where they are brighter on the side it points to, it is turned about. The distance from points so oriented is what the first frame is meshed from.',
    variants: [
      {
        id: '2',
        name: 'Figure 2',
        params: {},
        view: { votes: 'near' },
        came: 'Here the points of the boundary lie in a shell about a voxel thick, and the surface of the first frame runs through its middle; blood is inside. Where the box cuts through blood its side is boundary, too, and closes the surface.',
      },
    ],
    hint: 'Points are the darker the more windows voted for them. Turn the surface off to see the shell alone.',
  },
  {
    id: 'figure-3',
    name: 'Figure 3: through space and time',
    ...HEART,
    saw: 'The boundary in space and time has a plane at each point. Following it to the next frame tells where the vertex will be, which the projection then only has to correct.',
    variants: [
      {
        id: '3',
        name: 'With prediction',
        params: { prediction: true },
        view: { below: 'time' },
        came: 'Here a line through the ventricle over all frames: the wall goes in and out again, and where the surface crosses the line follows it. The table of frames says how many steps the projections took.',
      },
      {
        id: '3-without',
        name: 'Without',
        params: { prediction: false },
        view: { below: 'time' },
        came: 'Here each frame begins where the one before ended. The curve hardly differs, as this wall moves less than a pixel a frame; in the computed ventricle in thick slices projections take a tenth more steps.',
      },
    ],
    hint: 'Move the crosshair in the slices to take another line.',
  },
  {
    id: 'figure-4',
    name: 'Figure 4: boundary beside Canny’s',
    ...HEART,
    // On the wall between the ventricles.
    crosshair: [14.19, 36.43, -5.39],
    saw: 'Windows are sorted into bright and dark by 2-means; what separates the two in many windows is the boundary. It is as good as Canny’s, whose four numbers had to be tried out, and has one: the step height τ.',
    variants: [
      {
        id: '4',
        name: 'Figure 4',
        params: {},
        view: { below: 'boundary', surface: true, votes: 'near' },
        came: 'Here the windows reach into neighbouring slices and frames as well, so noise of a single slice hardly shows. Canny’s lines are thinner, and break where the wall is faint.',
      },
    ],
    hint: 'Click into the slice to sort the window there: bright pixels are framed green, dark ones red.',
  },
  {
    id: 'figure-5',
    name: 'Figure 5: slices between slices',
    ...HEART,
    saw: 'Between two slices, optical flow keeps the step from blood to muscle sharp; linear interpolation blurs it where the wall goes aside from one slice to the next.',
    variants: [
      {
        id: '5',
        name: 'Figure 5',
        params: {},
        view: { below: 'between' },
        came: 'Here a slice is left out and made of its two neighbours, which are 10 mm apart: then it is known what is right. In the mean of all slices flow is off by a fifth less than linear interpolation.',
      },
    ],
    hint: 'Move the crosshair to take other slices. Under “Preparation” the image is tracked with the one or the other, or with neither.',
  },
  {
    id: 'figure-6',
    name: 'Figure 6: the heart in its beat',
    ...HEART,
    saw: 'The mesh with the boundary around it in six frames from systole to diastole.',
    variants: [
      {
        id: '6',
        name: 'Figure 6',
        params: {},
        view: { votes: 'near', edges: true },
        came: 'Here a pig’s left ventricle in place of the volunteer’s heart, whose images cannot be passed on. It is smallest in about the twelfth of twenty frames and fills again; triangles keep their size, as edges are split and collapsed.',
      },
    ],
    hint: 'Scrub with the slider under the view, or let it beat.',
  },
];

/** Returns the view options that an example opens with. */
export function viewOf(example: TrackExample | undefined): TrackViewOptions {
  return { ...PLAIN_VIEW, ...(isTrackPreset(example) && example.variants[0].view) };
}

/** Returns the example or preset with this id. */
export function filmById(id: string): TrackExample | undefined {
  return [...FILMS, ...TRACK_PRESETS].find((one) => one.id === id);
}

export function isTrackPreset(example: TrackExample | undefined): example is TrackPreset {
  return example !== undefined && 'variants' in example;
}

/**
 * Returns the variant of a figure whose parameters are all in force, if there is one; unset parameters count as in
 * `usual`.
 */
export function variantInForce(preset: TrackPreset, params: ParamValues, usual: ParamValues): TrackVariant | undefined {
  return preset.variants.find((one) =>
    Object.entries({ ...usual, ...one.params }).every(([name, value]) => Object.is(params[name], value)),
  );
}
