import { h, uniqueId } from '../../../kit/dom';
import { Field } from '../../../kit/field';
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

/**
 * Controls of the Reconstruct lab to select what a click in the 3D view does to the points, and to discard all edits.
 */
export class EditTools {
  readonly element: HTMLElement;
  readonly #help = h('p', { class: 'help' });
  readonly #counts = h('p', { class: 'help', role: 'status' });
  readonly #clear: HTMLButtonElement;
  readonly #distance = new Field(
    h('input', { type: 'number', value: DISTANCE, min: -50, max: 50, step: 'any', required: true }),
    { label: text('pointPanels.distance'), unit: text('pointPanels.distanceUnit'), row: 'row' },
  );
  readonly #radios: HTMLInputElement[] = [];
  readonly #onTool: (tool: EditTool) => void;
  #tool: EditTool = 'none';

  constructor(onTool: (tool: EditTool) => void, onClear: () => void) {
    this.#onTool = onTool;
    const name = uniqueId('tool');
    const radios = TOOLS.map(({ tool, label }) => {
      const radio = h('input', { type: 'radio', name, value: tool, checked: tool === 'none', 'data-tool': tool });
      radio.addEventListener('change', () => this.#choose(tool));
      this.#radios.push(radio);
      return h('label', { class: 'check' }, radio, label);
    });
    this.#distance.control.addEventListener('change', () => this.#checkDistance());
    this.#clear = h(
      'button',
      { type: 'button', onclick: onClear, 'data-edit': 'clear' },
      text('pointPanels.discardEdits'),
    );
    this.element = h(
      'div',
      { class: 'edit-tools' },
      h('div', { class: 'tools', role: 'radiogroup', 'aria-label': text('pointPanels.clickAction') }, ...radios),
      this.#distance.element,
      this.#help,
      h('p', { class: 'help' }, text('pointPanels.editKeyboardHelp')),
      this.#counts,
      this.#clear,
    );
    this.#showHelp();
    this.show({ added: [], removed: [], outside: [] });
  }

  get tool(): EditTool {
    return this.#tool;
  }

  /**
   * Distance of a new point from the surface, or radius of removal, as a fraction of the diagonal of the box that
   * contains most points; the default if the input is invalid.
   */
  get distance(): number {
    const { control } = this.#distance;
    return (control.checkValidity() ? control.valueAsNumber : DISTANCE) / 100;
  }

  /** Deselects the tool, so that clicks in the 3D view do not edit the points. */
  deselect(): void {
    const [first] = this.#radios;
    if (first) first.checked = true;
    this.#choose('none');
  }

  show({ added, removed, outside }: { added: unknown[]; removed: unknown[]; outside: unknown[] }): void {
    const parts = [
      ...(added.length > 0 ? [plural('pointPanels.pointsAdded', added.length)] : []),
      ...(removed.length > 0 ? [plural('pointPanels.pointsRemoved', removed.length)] : []),
      ...(outside.length > 0 ? [plural('pointPanels.exteriorAdded', outside.length)] : []),
    ];
    this.#counts.textContent = parts.length > 0 ? `${parts.join(', ')}.` : text('pointPanels.noEdits');
    this.#clear.disabled = parts.length === 0;
  }

  #choose(tool: EditTool): void {
    this.#tool = tool;
    this.#showHelp();
    this.#onTool(tool);
  }

  #checkDistance(): void {
    const valid = this.#distance.control.checkValidity();
    this.#distance.showError(valid ? undefined : text('pointPanels.distanceError', { distance: DISTANCE }));
    if (!valid) this.#distance.control.valueAsNumber = DISTANCE;
  }

  #showHelp(): void {
    const tool = this.#tool;
    this.#help.textContent = TOOLS.find((one) => one.tool === tool)?.help ?? '';
  }
}
