import { signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useId } from '../kit/ui/id';
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
  choosers: ComponentChildren;
  /** Sentence on the files that can be opened. */
  help: string;
  /** Further controls, below the sentence. */
  more?: ComponentChildren;
}

/** The data that are open in a lab, and those that it offers. */
export class OpenData<Example extends Listed> {
  readonly contents: Contents<Example>;
  readonly onExample: (example: Example) => void;
  readonly facts;
  /** The open example; undefined for the user's file. `turn` tells one choice from the next. */
  readonly example;

  constructor(contents: Contents<Example>, onExample: (example: Example) => void) {
    this.contents = contents;
    this.onExample = onExample;
    this.facts = signal<readonly Fact[]>(contents.facts.map((name) => [name, '–']));
    this.example = signal<{ open: Example | undefined; turn: number }>({
      ...{ open: contents.groups[0]?.examples[0], turn: 0 },
    });
  }

  /** Selects the open example in the list, or “Your file” if `example` is undefined. */
  choose(example: Example | undefined): void {
    this.example.value = { open: example, turn: this.example.peek().turn + 1 };
  }

  /** Shows the facts about the open data, and the credit of its example, which is undefined for the user's file. */
  show(facts: readonly Fact[], example: Example | undefined): void {
    this.choose(example);
    this.facts.value = facts;
  }

  /** Changes the value of a fact that is displayed. */
  setFact(name: string, value: string): void {
    this.facts.value = this.facts.peek().map((fact) => (fact[0] === name ? [name, value] : fact));
  }
}

/** Panel of a lab with controls to open examples and files, and the facts about the data that is open. */
export function DataPanel<Example extends Listed>({ data }: { data: OpenData<Example> }) {
  const { groups, choosers, help, more } = data.contents;
  const { open } = data.example.value;
  const id = useId();
  const choose = (chosen: string) => {
    const example = groups.flatMap(({ examples }) => examples).find((one) => one.id === chosen);
    if (example) data.onExample(example);
  };
  return (
    <div class="data">
      <div class="row stacked">
        <label for={id}>{text('labs.example')}</label>
        <select id={id} value={open?.id ?? ''} onChange={({ currentTarget }) => choose(currentTarget.value)}>
          <option value="" hidden={open !== undefined}>
            {text('labs.yourFile')}
          </option>
          {groups
            .filter(({ examples }) => examples.length > 0)
            .map(({ label, examples }) => (
              <optgroup key={label} label={label}>
                {examples.map((example) => (
                  <option key={example.id} value={example.id}>
                    {example.name}
                  </option>
                ))}
              </optgroup>
            ))}
        </select>
      </div>
      <div class="row choosers">{choosers}</div>
      <p class="help">{help}</p>
      {more}
      <dl class="facts">
        {data.facts.value.map(([name, value], index) => (
          <div key={index}>
            <dt>{name}</dt>
            <dd>{value}</dd>
          </div>
        ))}
      </dl>
      <p class="help credit">{open?.credit}</p>
    </div>
  );
}
