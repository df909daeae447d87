import { h } from '../../../kit/dom';
import { OptionControls } from '../../../kit/view-options';
import { text } from '../../../texts';
import { CLOUD_VIEW, type CloudViewOptions } from '../view';

/** Makes controls for the view options of the Reconstruct lab: which objects are shown, and the surface's colouring. */
export function cloudOptions(onChange: (options: CloudViewOptions) => void): OptionControls<typeof CLOUD_VIEW> {
  const key = (name: string, label: string) =>
    h('span', {}, h('span', { class: `dot ${name}`, 'aria-hidden': 'true' }), label);
  const [surface, exterior] = [text('pointPanels.legendSurface'), text('pointPanels.legendExterior')];
  const legend = h('p', { class: 'legend' }, key('point', surface), key('exterior', exterior));
  const controls = new OptionControls(CLOUD_VIEW, (options) => {
    legend.hidden = !options.constraints;
    onChange(options);
  });
  legend.hidden = !controls.value.constraints;
  controls.place(legend, 'color');
  return controls;
}

/** Offers to show cameras if there are any; if not, the checkbox that shows them is hidden and cleared. */
export function offerCameras(controls: OptionControls<typeof CLOUD_VIEW>, areThere: boolean): void {
  controls.hide('cameras', !areThere);
  if (!areThere && controls.value.cameras) controls.set({ cameras: false });
}
