import type { ReadonlySignal } from '@preact/signals';
import type { Label } from '../../../engine/labels';
import { useId } from '../../../kit/ui/id';
import { kept } from '../../../kit/ui/mount';
import { Button, Help, IconButton, Refusal } from '../../../kit/ui/parts';
import { text } from '../../../texts';

const EYE = 'M12 5C6 5 2.5 12 2.5 12S6 19 12 19s9.5-7 9.5-7S18 5 12 5zm0 11a4 4 0 1 1 0-8 4 4 0 0 1 0 8z';
const CROSS = 'M6.4 5 12 10.6 17.6 5 19 6.4 13.4 12l5.6 5.6-1.4 1.4-5.6-5.6L6.4 19 5 17.6 10.6 12 5 6.4z';

/** The labels, which of them the tools paint, and those whose surfaces and voxels are not shown. */
export interface LabelsShown {
  labels: readonly Label[];
  active: number;
  hidden: ReadonlySet<number>;
}

/** The user's changes of labels. */
export interface LabelActs {
  /** Chooses the label that the tools paint. */
  activate: (value: number) => void;
  rename: (value: number, name: string) => void;
  recolor: (value: number, color: string) => void;
  setVisible: (value: number, isVisible: boolean) => void;
  add: () => void;
  /** Removes a label, with its voxels. */
  remove: (value: number) => void;
}

interface ListProps {
  list: ReadonlySignal<LabelsShown>;
  /** Why no label can be added; empty if one can. */
  refusal: ReadonlySignal<string>;
  acts: LabelActs;
}

/** List of the labels: which one the tools paint, and the colour, name and visibility of each. */
export function LabelList({ list, refusal, acts }: ListProps) {
  const { labels, active, hidden } = list.value;
  const group = useId();
  return (
    <div>
      <ul class="labels">
        {labels.map((label) => (
          <Item
            key={label.value}
            {...{ label, acts, group }}
            isActive={label.value === active}
            isVisible={!hidden.has(label.value)}
          />
        ))}
      </ul>
      <Button class="wide" data-label="add" onClick={acts.add}>
        {text('segment.addLabel')}
      </Button>
      <Refusal>{refusal}</Refusal>
      <Help>{text('segment.labelsHelp')}</Help>
    </div>
  );
}

interface ItemProps {
  label: Label;
  isActive: boolean;
  isVisible: boolean;
  acts: LabelActs;
  /** Name of the group of radio buttons. */
  group: string;
}

const Item = kept(({ label: { value, name, color }, isActive, isVisible, acts, group }: ItemProps) => {
  const control = (kind: string) => ({ 'data-control': kind, 'data-value': value });
  const paint = text('segment.paintLabel', { name });
  const colorOf = text('segment.colorOf', { name });
  return (
    <li data-current={isActive ? '' : undefined}>
      <input
        {...{ type: 'radio', name: group, checked: isActive, title: paint, 'aria-label': paint, ...control('active') }}
        onChange={() => acts.activate(value)}
      />
      <input
        {...{ type: 'color', value: color, title: colorOf, 'aria-label': colorOf, ...control('color') }}
        onChange={({ currentTarget }) => acts.recolor(value, currentTarget.value)}
      />
      <input
        {...{ type: 'text', value: name, maxLength: 60, 'aria-label': text('segment.nameOf', { value }) }}
        {...control('name')}
        onChange={({ currentTarget }) => {
          const given = currentTarget.value.trim();
          if (given) acts.rename(value, given);
          else currentTarget.value = name;
        }}
      />
      <IconButton
        {...{ path: EYE, label: text('segment.visibleOf', { name }), 'aria-pressed': isVisible, ...control('visible') }}
        onClick={() => acts.setVisible(value, !isVisible)}
      />
      <IconButton
        {...{ path: CROSS, label: text('segment.removeLabel', { name }), ...control('remove') }}
        onClick={() => acts.remove(value)}
      />
    </li>
  );
});
