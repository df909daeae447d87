import { signal } from '@preact/signals';
import { Field, NumberInput } from '../../../kit/ui/field';
import { useId } from '../../../kit/ui/id';
import { Button, Help } from '../../../kit/ui/parts';
import { plural, text } from '../../../texts';

/**
 * Effect of a click in the Reconstruct lab's 3D view: none, or a point is added, removed, or added as an exterior
 * constraint.
 */
export type EditTool = 'none' | 'add' | 'remove' | 'outside';

const TOOLS: { tool: EditTool; label: string; help: string }[] = [
  { tool: 'none', label: text('pointPanels.toolNone'), help: text('pointPanels.toolNoneHelp') },
  {
    tool: 'add',
    label: text('pointPanels.toolAdd'),
    help: text('pointPanels.toolAddHelp'),
  },
  {
    tool: 'remove',
    label: text('pointPanels.toolRemove'),
    help: text('pointPanels.toolRemoveHelp'),
  },
  {
    tool: 'outside',
    label: text('pointPanels.toolOutside'),
    help: text('pointPanels.toolOutsideHelp'),
  },
];

/**
 * Default of the distance of a new point from the surface and of the radius of removal, in percent of the diagonal of
 * the box that contains most points.
 */
const DISTANCE = 5;

interface EditCounts {
  added: unknown[];
  removed: unknown[];
  outside: unknown[];
}

/** What a click in the 3D view does to the points, and what clicks have done. */
export class EditTools {
  readonly tool = signal<EditTool>('none');
  readonly edits = signal<EditCounts>({ added: [], removed: [], outside: [] });
  /** Distance of a new point from the surface, or radius of removal, in percent as `DISTANCE`. */
  readonly percent = signal(DISTANCE);
  /** Whether the last distance that was entered was refused. */
  readonly isRefused = signal(false);
  readonly #onTool: (tool: EditTool) => void;

  constructor(onTool: (tool: EditTool) => void) {
    this.#onTool = onTool;
  }

  /** The distance as a fraction of the diagonal of the box that contains most points. */
  get distance(): number {
    return this.percent.peek() / 100;
  }

  /** Selects the effect of clicks; with `none` they do not edit the points. */
  choose(tool: EditTool): void {
    this.tool.value = tool;
    this.#onTool(tool);
  }
}

interface EditProps {
  state: EditTools;
  onClear: () => void;
}

/**
 * Controls of the Reconstruct lab to select what a click in the 3D view does to the points, and to discard all edits.
 */
export function EditControls({ state, onClear }: EditProps) {
  const told = describe(state.edits.value);
  return (
    <div class="edit-tools">
      <Tools state={state} />
      <Distance state={state} />
      <Help>{TOOLS.find(({ tool }) => tool === state.tool.value)?.help}</Help>
      <Help>{text('pointPanels.editKeyboardHelp')}</Help>
      <p class="help" role="status">
        {told || text('pointPanels.noEdits')}
      </p>
      <Button data-edit="clear" disabled={told === ''} onClick={onClear}>
        {text('pointPanels.discardEdits')}
      </Button>
    </div>
  );
}

function Tools({ state }: { state: EditTools }) {
  const name = useId();
  return (
    <div class="tools" role="radiogroup" aria-label={text('pointPanels.clickAction')}>
      {TOOLS.map(({ tool, label }) => (
        <label key={tool} class="check">
          <input
            {...{ type: 'radio', name, value: tool, 'data-tool': tool }}
            checked={tool === state.tool.value}
            onChange={() => state.choose(tool)}
          />
          {label}
        </label>
      ))}
    </div>
  );
}

function Distance({ state }: { state: EditTools }) {
  const enter = (input: HTMLInputElement) => {
    state.isRefused.value = !input.checkValidity();
    state.percent.value = input.checkValidity() ? input.valueAsNumber : DISTANCE;
  };
  return (
    <Field
      isRow
      label={text('pointPanels.distance')}
      unit={text('pointPanels.distanceUnit')}
      error={state.isRefused.value ? text('pointPanels.distanceError', { distance: DISTANCE }) : ''}
    >
      {(tied) => (
        <NumberInput
          {...{ ...tied, min: -50, max: 50, required: true }}
          shown={String(state.percent.value)}
          onEnter={(_, input) => enter(input)}
        />
      )}
    </Field>
  );
}

/** Describes edits in a sentence; empty if there are none. */
function describe({ added, removed, outside }: EditCounts): string {
  const parts = [
    ...(added.length > 0 ? [plural('pointPanels.pointsAdded', added.length)] : []),
    ...(removed.length > 0 ? [plural('pointPanels.pointsRemoved', removed.length)] : []),
    ...(outside.length > 0 ? [plural('pointPanels.exteriorAdded', outside.length)] : []),
  ];
  return parts.length > 0 ? `${parts.join(', ')}.` : '';
}
