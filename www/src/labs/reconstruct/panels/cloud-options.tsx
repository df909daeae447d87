import { OptionControls, ViewOptions } from '../../../kit/view-options';
import { text } from '../../../texts';
import { CLOUD_VIEW, type CloudViewOptions } from '../view';

type Options = ViewOptions<typeof CLOUD_VIEW>;

/** Makes the view options of the Reconstruct lab: which objects are shown, and the surface's colouring. */
export const cloudOptions = (onChange: (options: CloudViewOptions) => void): Options =>
  new ViewOptions(CLOUD_VIEW, onChange);

/** Offers to show cameras if there are any; if not, the checkbox that shows them is hidden and cleared. */
export function offerCameras(options: Options, areThere: boolean): void {
  options.withhold({ hidden: areThere ? [] : ['cameras'] });
  if (!areThere && options.value.cameras) options.set({ cameras: false });
}

/** Controls of the view, with a legend of the points that are shown. */
export function CloudOptions({ of }: { of: Options }) {
  return <OptionControls of={of} before={{ color: <Legend isShown={of.options.value.constraints} /> }} />;
}

function Legend({ isShown }: { isShown: boolean }) {
  return (
    <p class="legend" hidden={!isShown}>
      <Key kind="point" label={text('pointPanels.legendSurface')} />
      <Key kind="exterior" label={text('pointPanels.legendExterior')} />
    </p>
  );
}

function Key({ kind, label }: { kind: string; label: string }) {
  return (
    <span>
      <span class={`dot ${kind}`} aria-hidden="true" />
      {label}
    </span>
  );
}
