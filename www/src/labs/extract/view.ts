/** The options of the Extract lab's view: what is shown, and the surface's colouring. */
import { type ColorMode, EDGES, type OptionsOf, oneOf, SLICES, SURFACE } from '../../kit/view';

const COLOR = oneOf<ColorMode>(
  'controls.color',
  {
    plain: 'controls.colorPlain',
    component: 'controls.colorComponent',
    speed: 'controls.colorSpeed',
    'mean curvature': 'controls.colorMeanCurvature',
    'gaussian curvature': 'controls.colorGaussianCurvature',
  },
  'plain',
);

export const EXTRACT_VIEW = { surface: SURFACE, edges: EDGES, color: COLOR, slices: SLICES };
export type ExtractViewOptions = OptionsOf<typeof EXTRACT_VIEW>;
