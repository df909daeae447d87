import { Field, selectFrom } from '../../../kit/field';
import { text } from '../../../texts';
import type { Support } from '../protocol';

/** Control of the Sculpt lab for what supports a surface; hidden where there is no choice. */
export class SupportControl {
  readonly element: HTMLElement;
  readonly #select = selectFrom([
    { value: 'surface', label: text('sculptPanels.supportSurface') },
    { value: 'membrane', label: text('sculptPanels.supportMembrane') },
  ]);
  readonly #field = new Field(this.#select, { label: text('sculptPanels.support'), help: '', row: 'row' });

  constructor(onSupport: (support: Support) => void) {
    this.element = this.#field.element;
    this.element.hidden = true;
    this.#select.dataset.support = '';
    this.#select.addEventListener('change', () => onSupport(this.#select.value as Support));
  }

  set hasChoice(hasChoice: boolean) {
    this.element.hidden = !hasChoice;
  }

  show(support: Support): void {
    this.#select.value = support;
    this.#field.help = text(
      support === 'surface' ? 'sculptPanels.supportSurfaceHelp' : 'sculptPanels.supportMembraneHelp',
    );
  }
}
