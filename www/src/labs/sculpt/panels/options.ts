import type { ViewOptions } from '../../../kit/view-options';
import type { SCULPT_VIEW } from '../view';

type Controls = ViewOptions<typeof SCULPT_VIEW>;

/** Offers the layout of stages of restructuring if there are any. */
export const offerStages = (controls: Controls, areThere: boolean): void =>
  hideLayouts(controls, ['stages'], !areThere);

function hideLayouts(controls: Controls, layouts: readonly string[], areHidden: boolean): void {
  const entries = layouts.map((layout) => `layout=${layout}`);
  const others = controls.withheld.peek().hiddenEntries.filter((entry) => !entries.includes(entry));
  controls.withhold({ hiddenEntries: areHidden ? [...others, ...entries] : others });
}

/** Offers the layouts of a detail on a membrane; if the surface is none, there is nothing besides the result to show. */
export function offerLayouts(controls: Controls, isMembrane: boolean): void {
  hideLayouts(controls, ['base', 'pair', 'row', 'levels'], !isMembrane);
  if (!isMembrane && controls.value.layout !== 'result') controls.set({ layout: 'result' });
}

/** Offers the surface's texture if it has one; if not, a textured surface becomes plain. */
export function offerTexture(controls: Controls, isThere: boolean): void {
  controls.withhold({ disabledEntries: isThere ? [] : ['color=texture'] });
  if (!isThere && controls.value.color === 'texture') controls.set({ color: 'plain' });
}
