import type { OptionControls } from '../../../kit/view-options';
import type { SCULPT_VIEW } from '../view';

type Controls = OptionControls<typeof SCULPT_VIEW>;

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
