import type { Choice } from '../../../kit/field';
import { OptionControls, type ViewOption } from '../../../kit/view-options';
import type { SurfaceColor } from '../../../scene/surface';
import { text } from '../../../texts';
import type { Layout } from '../protocol';
import type { SculptViewOptions } from '../scene';

const LAYOUTS: Choice<Layout>[] = [
  { value: 'result', label: text('sculptPanels.layoutResult') },
  { value: 'base', label: text('sculptPanels.layoutBase') },
  { value: 'pair', label: text('sculptPanels.layoutPair') },
  { value: 'row', label: text('sculptPanels.layoutRow') },
  { value: 'levels', label: text('sculptPanels.layoutLevels') },
  { value: 'stages', label: text('sculptPanels.layoutStages') },
];

const SCULPT_COLORS: Choice<SurfaceColor>[] = [
  { value: 'plain', label: text('controls.colorPlain') },
  { value: 'texture', label: text('sculptPanels.colorTexture') },
  { value: 'component', label: text('controls.colorComponent') },
  { value: 'area distortion', label: text('sculptPanels.colorAreaDistortion') },
  { value: 'angle distortion', label: text('sculptPanels.colorAngleDistortion') },
  { value: 'mean curvature', label: text('controls.colorMeanCurvature') },
];

const OPTIONS: ViewOption<SculptViewOptions>[] = [
  { name: 'edges', label: text('controls.viewWireframe') },
  { name: 'ellipsoids', label: text('sculptPanels.ellipsoids') },
  { name: 'layout', label: text('sculptPanels.show'), choices: LAYOUTS },
  { name: 'color', label: text('controls.color'), choices: SCULPT_COLORS },
];

/**
 * Controls for the view options of the Sculpt lab: which meshes and ellipsoids are shown, and the surfaces' colouring.
 */
export class SculptOptionControls extends OptionControls<SculptViewOptions> {
  constructor(initial: SculptViewOptions, onChange: (options: SculptViewOptions) => void) {
    super(OPTIONS, initial, onChange);
  }

  /** Whether there are stages of restructuring to show; if not, that layout is not offered. */
  set staged(staged: boolean) {
    const entry = this.entryOf('layout', 'stages');
    if (entry) entry.hidden = !staged;
  }

  /** Whether the surface is a detail on a membrane; else there is nothing besides the result to show. */
  set membrane(membrane: boolean) {
    for (const layout of ['base', 'pair', 'row', 'levels']) {
      const entry = this.entryOf('layout', layout);
      if (entry) entry.hidden = !membrane;
    }
    if (!membrane && this.value.layout !== 'result') this.set({ layout: 'result' });
  }

  /** Whether the surface has a texture to show; if not, it is not offered, and a textured surface becomes plain. */
  set textured(textured: boolean) {
    const entry = this.entryOf('color', 'texture');
    if (entry) entry.disabled = !textured;
    if (!textured && this.value.color === 'texture') this.set({ color: 'plain' });
  }
}
