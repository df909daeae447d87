import { h } from '../../../kit/dom';
import type { Choice } from '../../../kit/field';
import { OptionControls, type ViewOption } from '../../../kit/view-options';
import type { SurfaceColor } from '../../../scene/surface';
import { text } from '../../../texts';
import type { CloudViewOptions } from '../scene';

export const CLOUD_COLORS: Choice<SurfaceColor>[] = [
  { value: 'own', label: text('pointPanels.colorOwn') },
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
  { value: 'distance', label: text('pointPanels.colorDistance') },
];

const OPTIONS: ViewOption<CloudViewOptions>[] = [
  { name: 'surface', label: text('controls.viewSurface') },
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'points', label: text('pointPanels.viewPoints') },
  { name: 'constraints', label: text('pointPanels.viewConstraints') },
  { name: 'cameras', label: text('pointPanels.viewCameras') },
  { name: 'color', label: text('controls.color'), choices: CLOUD_COLORS },
];

/** Makes controls for the view options of the Reconstruct lab: which objects are shown, and the surface's colouring. */
export function cloudOptions(
  initial: CloudViewOptions,
  onChange: (options: CloudViewOptions) => void,
): OptionControls<CloudViewOptions> {
  const key = (name: string, label: string) =>
    h('span', {}, h('span', { class: `dot ${name}`, 'aria-hidden': 'true' }), label);
  const [surface, exterior] = [text('pointPanels.legendSurface'), text('pointPanels.legendExterior')];
  const legend = h('p', { class: 'legend' }, key('point', surface), key('exterior', exterior));
  const controls = new OptionControls(OPTIONS, initial, (options) => {
    legend.hidden = !options.constraints;
    onChange(options);
  });
  legend.hidden = !initial.constraints;
  controls.place(legend, 'color');
  return controls;
}

/** Offers to show cameras if there are any; if not, the checkbox that shows them is hidden and cleared. */
export function offerCameras(controls: OptionControls<CloudViewOptions>, areThere: boolean): void {
  controls.hide('cameras', !areThere);
  if (!areThere && controls.value.cameras) controls.set({ cameras: false });
}
