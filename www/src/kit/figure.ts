import { text } from '../texts';
import { h } from './dom';

/** One of the images of a paper's figure, with its own settings. */
interface FigureVariant {
  name: string;
  /** Describes the lab's result, for comparison with the paper's. */
  ourResult: string;
}

/** The part of a lab's preset that the panel shows: a figure of the paper whose method the lab runs. */
interface PaperFigure<One extends FigureVariant> {
  /** Describes the paper's result. */
  paperResult: string;
  variants: [One, ...One[]];
  /** Hint at further details to observe. */
  hint?: string;
}

/**
 * Panel that describes the figure of a paper that is open as a preset: the paper's result, the lab's result, and a
 * button for each image of the figure.
 */
export class FigurePanel<Variant extends FigureVariant, Preset extends PaperFigure<Variant>> {
  readonly element = h('div', { class: 'figure', hidden: true });
  readonly #onVariant: (preset: Preset, variant: Variant) => void;
  #shown: Preset | undefined;
  #buttons: { variant: Variant; button: HTMLButtonElement }[] = [];
  readonly #ourResult = h('p', { 'data-figure': 'came' });

  constructor(onVariant: (preset: Preset, variant: Variant) => void) {
    this.#onVariant = onVariant;
  }

  /**
   * Shows a figure and marks the button of the variant that the present settings match; without a variant, the text
   * says that the settings were changed. Without a figure, the panel is hidden.
   */
  show(preset: Preset | undefined, variant?: Variant): void {
    this.element.hidden = preset === undefined;
    // Existing buttons are kept, so that the focus stays.
    if (preset && preset !== this.#shown) this.#build(preset);
    this.#shown = preset;
    if (preset) this.#choose(variant);
  }

  #build(preset: Preset): void {
    this.#buttons = preset.variants.map((one) => ({ variant: one, button: this.#button(preset, one) }));
    const several = preset.variants.length > 1;
    const group = h('div', { class: 'buttons', role: 'group', 'aria-label': text('controls.figureImages') });
    group.append(...this.#buttons.map(({ button }) => button));
    this.element.replaceChildren(
      h('p', {}, h('strong', {}, text('controls.figurePaper')), preset.paperResult),
      this.#ourResult,
      ...(several ? [group] : []),
      ...(preset.hint ? [h('p', { class: 'help' }, preset.hint)] : []),
    );
  }

  #choose(variant: Variant | undefined): void {
    this.#ourResult.textContent = variant?.ourResult ?? text('controls.figureChanged');
    for (const { variant: one, button } of this.#buttons) button.setAttribute('aria-pressed', String(one === variant));
  }

  #button(preset: Preset, variant: Variant): HTMLButtonElement {
    return h('button', { type: 'button', onclick: () => this.#onVariant(preset, variant) }, variant.name);
  }
}
