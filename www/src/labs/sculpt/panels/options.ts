import type { Choice } from '../../../kit/field';
import type { OptionControls, ViewOption } from '../../../kit/view-options';
import type { SurfaceColor } from '../../../scene/surface';
import { text } from '../../../texts';
import type { Layout } from '../protocol';
import type { SculptViewOptions } from '../scene';

export const LAYOUTS: Choice<Layout>[] = [
  { value: 'result', label: text('sculptPanels.layoutResult') },
  { value: 'base', label: text('sculptPanels.layoutBase') },
  { value: 'pair', label: text('sculptPanels.layoutPair') },
  { value: 'row', label: text('sculptPanels.layoutRow') },
  { value: 'levels', label: text('sculptPanels.layoutLevels') },
  { value: 'stages', label: text('sculptPanels.layoutStages') },
];

export const SCULPT_COLORS: Choice<SurfaceColor>[] = [
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'texture', label: text('sculptPanels.colorTexture') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'area distortion', label: text('sculptPanels.colorAreaDistortion') },
  { value: 'angle distortion', label: text('sculptPanels.colorAngleDistortion') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
];

/** View options of the Sculpt lab: which meshes and ellipsoids are shown, and the surfaces' colouring. */
export const SCULPT_OPTIONS: ViewOption<SculptViewOptions>[] = [
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'ellipsoids', label: text('sculptPanels.ellipsoids') },
  { name: 'layout', label: text('sculptPanels.show'), choices: LAYOUTS },
  { name: 'color', label: text('controls.color'), choices: SCULPT_COLORS },
];

type Controls = OptionControls<SculptViewOptions>;

/** Offers the layout of stages of restructuring if there are any. */
export const offerStages = (controls: Controls, areThere: boolean): void =>
  controls.hideEntry('layout', 'stages', !areThere);

/** Offers the layouts of a detail on a membrane; if the surface is none, there is nothing besides the result to show. */
export function offerLayouts(controls: Controls, isMembrane: boolean): void {
  for (const layout of ['base', 'pair', 'row', 'levels']) controls.hideEntry('layout', layout, !isMembrane);
  if (!isMembrane && controls.value.layout !== 'result') controls.set({ layout: 'result' });
}

/** Offers the surface's texture if it has one; if not, a textured surface becomes plain. */
export function offerTexture(controls: Controls, isThere: boolean): void {
  controls.disableEntry('color', 'texture', !isThere);
  if (!isThere && controls.value.color === 'texture') controls.set({ color: 'plain' });
}
