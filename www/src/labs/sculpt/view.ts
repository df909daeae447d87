/** The options of the Sculpt lab's view: which meshes and ellipsoids are shown, and the surfaces' colouring. */
import { EDGES, type OptionsOf, oneOf, onOff } from '../../kit/view';
import type { Layout } from './protocol';

const LAYOUT = oneOf<Layout>(
  'sculptPanels.show',
  {
    result: 'sculptPanels.layoutResult',
    base: 'sculptPanels.layoutBase',
    pair: 'sculptPanels.layoutPair',
    row: 'sculptPanels.layoutRow',
    levels: 'sculptPanels.layoutLevels',
    stages: 'sculptPanels.layoutStages',
  },
  'result',
);

const COLOR = oneOf(
  'controls.color',
  {
    plain: 'controls.colorPlain',
    texture: 'sculptPanels.colorTexture',
    component: 'controls.colorComponent',
    'area distortion': 'sculptPanels.colorAreaDistortion',
    'angle distortion': 'sculptPanels.colorAngleDistortion',
    'mean curvature': 'controls.colorMeanCurvature',
  },
  'plain',
);

export const SCULPT_VIEW = {
  edges: EDGES,
  ellipsoids: onOff('sculptPanels.ellipsoids', true),
  layout: LAYOUT,
  color: COLOR,
};
export type SculptViewOptions = OptionsOf<typeof SCULPT_VIEW>;
