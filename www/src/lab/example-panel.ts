import { h, uniqueId } from '../kit/dom';
import { text } from '../texts';

/** An example as the panel lists it. */
export interface Listed {
  id: string;
  name: string;
  /** Origin and licence of the data. */
  credit?: string;
}

/** A fact about the open data: its name, and its value as displayed. */
export type Fact = [name: string, value: string];

interface Contents<Example> {
  /** Examples by group; a group without examples is left out. */
  groups: { label: string; examples: readonly Example[] }[];
  /** Names of the facts, shown before anything is open, too, so that the layout does not shift. */
  facts: readonly string[];
  /** Controls that open files. */
  choosers: HTMLElement[];
  /** Sentence on the files that can be opened. */
  help: string;
  /** Further controls, below the sentence. */
  more?: HTMLElement[];
}

/** Panel of a lab with controls to open examples and files, and the facts about the data that is open. */
export class ExamplePanel<Example extends Listed> {
  readonly element: HTMLElement;
  readonly #examples: HTMLSelectElement;
  readonly #own = h('option', { value: '', hidden: true }, text('labs.yourFile'));
  readonly #facts = h('dl', { class: 'facts' });
  readonly #credit = h('p', { class: 'help credit' });

  constructor({ groups, facts, choosers, help, more = [] }: Contents<Example>, onExample: (example: Example) => void) {
    const id = uniqueId('example');
    const option = (example: Example) => h('option', { value: example.id }, example.name);
    const filled = groups.filter(({ examples }) => examples.length > 0);
    const lists = filled.map(({ label, examples }) => h('optgroup', { label }, ...examples.map(option)));
    this.#examples = h('select', { id }, this.#own, ...lists);
    this.#examples.addEventListener('change', () => {
      const chosen = groups.flatMap(({ examples }) => examples).find((one) => one.id === this.#examples.value);
      if (chosen) onExample(chosen);
    });
    this.show(
      facts.map((name) => [name, '–']),
      groups[0]?.examples[0],
    );
    this.element = h(
      'div',
      { class: 'data' },
      h('div', { class: 'row stacked' }, h('label', { for: id }, text('labs.example')), this.#examples),
      h('div', { class: 'row choosers' }, ...choosers),
      h('p', { class: 'help' }, help),
      ...more,
      this.#facts,
      this.#credit,
    );
  }

  /** Selects the open example in the list, or “Your file” if `example` is undefined. */
  choose(example: Example | undefined): void {
    this.#own.hidden = example !== undefined;
    this.#examples.value = example?.id ?? '';
  }

  /** Shows the facts about the open data, and the credit of its example, which is undefined for the user's file. */
  show(facts: readonly Fact[], example: Example | undefined): void {
    this.choose(example);
    this.#facts.replaceChildren(...facts.map(([name, value]) => h('div', {}, h('dt', {}, name), h('dd', {}, value))));
    this.#credit.textContent = example?.credit ?? '';
  }

  /** Changes the value of a fact that is displayed. */
  setFact(name: string, value: string): void {
    for (const { children } of this.#facts.children)
      if (children[0]?.textContent === name && children[1]) children[1].textContent = value;
  }
}
