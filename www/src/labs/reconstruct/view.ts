/** The options of the Reconstruct lab's view: which objects are shown, and the surface's colouring. */
import { EDGES, type OptionsOf, oneOf, onOff, SURFACE } from '../../kit/view';

const COLOR = oneOf(
  'controls.color',
  {
    own: 'pointPanels.colorOwn',
    plain: 'controls.colorPlain',
    component: 'controls.colorComponent',
    'mean curvature': 'controls.colorMeanCurvature',
    distance: 'pointPanels.colorDistance',
  },
  'plain',
);

export const CLOUD_VIEW = {
  surface: SURFACE,
  edges: EDGES,
  points: onOff('pointPanels.viewPoints', true),
  constraints: onOff('pointPanels.viewConstraints', false),
  cameras: onOff('pointPanels.viewCameras', false),
  color: COLOR,
};
export type CloudViewOptions = OptionsOf<typeof CLOUD_VIEW>;
