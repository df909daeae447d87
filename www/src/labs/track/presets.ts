/**
 * Presets of the Track lab: the figures of the paper on dynamic surfaces from 4D cardiac MRI, on an image that is
 * served with the page.
 */

import type { ParamValues } from '../../engine/protocol';
import { initialOptions } from '../../kit/view';
import { text } from '../../texts';
import { HEART, IMAGES, type TrackExample } from './examples';
import { TRACK_VIEW, type TrackViewOptions } from './view';

/** One picture of a figure, as a variant of the preset: the same image with other parameters and view options. */
export interface TrackVariant {
  id: string;
  name: string;
  ourResult: string;
  /** Parameters of the method in which the picture differs from its figure. */
  params: ParamValues;
  view: Partial<TrackViewOptions>;
}

/** A figure of the paper, as an example of the Track lab, with a variant for each of its pictures. */
export interface TrackPreset extends TrackExample {
  paperResult: string;
  variants: [TrackVariant, ...TrackVariant[]];
  hint?: string;
}

export const TRACK_PRESETS: TrackPreset[] = [
  {
    id: 'figure-2',
    name: text('trackPresets.figure2Name'),
    ...HEART,
    paperResult: text('trackPresets.figure2Paper'),
    variants: [
      {
        id: '2',
        name: text('trackPresets.figure2PictureName'),
        params: {},
        view: { votes: 'near' },
        ourResult: text('trackPresets.figure2PictureHere'),
      },
    ],
    hint: text('trackPresets.figure2Hint'),
  },
  {
    id: 'figure-3',
    name: text('trackPresets.figure3Name'),
    ...HEART,
    paperResult: text('trackPresets.figure3Paper'),
    variants: [
      {
        id: '3',
        name: text('trackPresets.figure3PictureName'),
        params: { prediction: true },
        view: { below: 'time' },
        ourResult: text('trackPresets.figure3PictureHere'),
      },
      {
        id: '3-without',
        name: text('trackPresets.figure3WithoutName'),
        params: { prediction: false },
        view: { below: 'time' },
        ourResult: text('trackPresets.figure3WithoutHere'),
      },
    ],
    hint: text('trackPresets.figure3Hint'),
  },
  {
    id: 'figure-4',
    name: text('trackPresets.figure4Name'),
    ...HEART,
    // On the wall between the ventricles.
    crosshair: [14.19, 36.43, -5.39],
    paperResult: text('trackPresets.figure4Paper'),
    variants: [
      {
        id: '4',
        name: text('trackPresets.figure4PictureName'),
        params: {},
        view: { below: 'boundary', surface: true, votes: 'near' },
        ourResult: text('trackPresets.figure4PictureHere'),
      },
    ],
    hint: text('trackPresets.figure4Hint'),
  },
  {
    id: 'figure-5',
    name: text('trackPresets.figure5Name'),
    ...HEART,
    paperResult: text('trackPresets.figure5Paper'),
    variants: [
      {
        id: '5',
        name: text('trackPresets.figure5PictureName'),
        params: {},
        view: { below: 'between' },
        ourResult: text('trackPresets.figure5PictureHere'),
      },
    ],
    hint: text('trackPresets.figure5Hint'),
  },
  {
    id: 'figure-6',
    name: text('trackPresets.figure6Name'),
    ...HEART,
    paperResult: text('trackPresets.figure6Paper'),
    variants: [
      {
        id: '6',
        name: text('trackPresets.figure6PictureName'),
        params: {},
        view: { votes: 'near', edges: true },
        ourResult: text('trackPresets.figure6PictureHere'),
      },
    ],
    hint: text('trackPresets.figure6Hint'),
  },
];

/** Returns the view options that an example opens with; those of a preset are from its first variant. */
export function viewOf(example: TrackExample | undefined): TrackViewOptions {
  return { ...initialOptions(TRACK_VIEW), ...(isTrackPreset(example) && example.variants[0].view) };
}

/** Returns the Track lab's example or preset with this id, undefined if there is none. */
export function imageById(id: string): TrackExample | undefined {
  return [...IMAGES, ...TRACK_PRESETS].find((one) => one.id === id);
}

export function isTrackPreset(example: TrackExample | undefined): example is TrackPreset {
  return example !== undefined && 'variants' in example;
}

/**
 * Returns the first variant of a figure that the current parameters match, to mark its button; undefined if none does.
 * Parameters that the figure sets (`usual`) and the variant does not must match, too; all others are ignored.
 */
export function variantInForce(preset: TrackPreset, params: ParamValues, usual: ParamValues): TrackVariant | undefined {
  return preset.variants.find((one) =>
    Object.entries({ ...usual, ...one.params }).every(([name, value]) => Object.is(params[name], value)),
  );
}
