import { h, icon, uniqueId } from '../../../kit/dom';
import { Field, labelFor, selectFrom } from '../../../kit/field';
import { showUndoable } from '../../../kit/transport';
import { text } from '../../../texts';

/** Effect of pressing a slice: the crosshair moves, or labels change. */
export type Tool = 'navigate' | 'brush' | 'threshold' | 'eraser' | 'fill';

/** Shape of the brush: a ball in the volume, or a disc in the slice. */
export type BrushShape = 'ball' | 'disc';
/** Extent of a fill: the slice, or a box of the volume. */
export type FillExtent = 'slice' | 'box';

export interface ToolSettings {
  tool: Tool;
  /** Radius of the brush, in shortest sides of a voxel. */
  radius: number;
  shape: BrushShape;
  /** Intensities that the threshold brush paints, and that a fill may be limited to, both included. */
  range: [number, number];
  extent: FillExtent;
  /** Largest distance of a fill in the volume along each axis, in voxels. */
  reach: number;
  /** Whether a fill in the volume is limited to the range of intensities. */
  inRange: boolean;
  /** Whether only background is painted, and only the active label erased. */
  protect: boolean;
}

const TOOLS: { tool: Tool; key: string; label: string; help: string }[] = [
  { tool: 'navigate', key: 'v', label: text('segment.navigate'), help: text('segment.navigateHelp') },
  { tool: 'brush', key: 'b', label: text('segment.brush'), help: text('segment.brushHelp') },
  { tool: 'threshold', key: 't', label: text('segment.threshold'), help: text('segment.thresholdHelp') },
  { tool: 'eraser', key: 'e', label: text('segment.eraser'), help: text('segment.eraserHelp') },
  { tool: 'fill', key: 'f', label: text('segment.fill'), help: text('segment.fillHelp') },
];
const MOST_RADIUS = 40;
const MOST_REACH = 128;

/** Whether the tool in use changes only voxels in the range of intensities. */
export function usesRange({ tool, extent, inRange }: ToolSettings): boolean {
  return tool === 'threshold' || (tool === 'fill' && extent === 'box' && inRange);
}

const UNDO = 'M8 5 2.5 10 8 15v-3.5h6a3.5 3.5 0 0 1 0 7H8V21h6a6 6 0 0 0 0-12H8z';
const REDO = 'm16 5 5.5 5-5.5 5v-3.5h-6a3.5 3.5 0 0 0 0 7h6V21h-6a6 6 0 0 1 0-12h6z';

export interface ToolEvents {
  onSettings: (settings: ToolSettings) => void;
  onApply: () => void;
  onUndo: () => void;
  onRedo: () => void;
}

/** Controls of the tools that change labels: a bar with the tools, and the settings of the tool in use. */
export class SegmentTools {
  /** The tools, the radius of the brush, undo and redo. */
  readonly bar: HTMLElement;
  /** Description of the tool in use, and its other settings. */
  readonly settings: HTMLElement;
  readonly #events: ToolEvents;
  readonly #radios = new Map<Tool, HTMLInputElement>();
  readonly #help = h('p', { class: 'help', 'data-tool-help': '' });
  readonly #radius = setting('radius', { type: 'range', min: 0, max: MOST_RADIUS, step: 1 });
  readonly #output = h('output', { 'aria-live': 'off' });
  readonly #shape = choice('shape', text('segment.shape'), { ball: text('segment.ball'), disc: text('segment.disc') });
  readonly #extent = choice('extent', text('segment.extent'), {
    slice: text('segment.extentSlice'),
    box: text('segment.extentBox'),
  });
  readonly #reach = new Field(setting('reach', { type: 'number', min: 1, max: MOST_REACH, step: 1 }), {
    label: text('segment.reach'),
    row: 'row',
    attributes: { title: text('segment.reachHelp') },
  });
  readonly #inRange = setting('in-range', { type: 'checkbox' });
  readonly #inRangeRow = h('label', { class: 'check' }, this.#inRange, text('segment.inRange'));
  readonly #ends = (['low', 'high'] as const).map((end) => {
    const label = text(end === 'low' ? 'segment.rangeLow' : 'segment.rangeHigh');
    return setting(end, { type: 'number', step: 'any', required: true, 'aria-label': label });
  });
  readonly #rangeRow: HTMLElement;
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #protect = setting('protect', { type: 'checkbox' });
  readonly #apply: HTMLButtonElement;
  readonly #undo: HTMLButtonElement;
  readonly #redo: HTMLButtonElement;
  #value: ToolSettings = {
    ...{ tool: 'brush', radius: 3, shape: 'ball', range: [0, 0], protect: false },
    ...{ extent: 'slice', reach: 50, inRange: false },
  };

  constructor(events: ToolEvents) {
    this.#events = events;
    const name = uniqueId('tool');
    const radios = TOOLS.map(({ tool, key, label, help }) => {
      const radio = h('input', { type: 'radio', name, value: tool, 'data-tool': tool });
      radio.addEventListener('change', () => this.set({ tool }));
      this.#radios.set(tool, radio);
      return h('label', { title: text('segment.toolTitle', { help, key: key.toUpperCase() }) }, radio, label);
    });
    this.#listen();
    const [low = '', high = ''] = this.#ends;
    this.#rangeRow = h(
      'div',
      { class: 'row stacked' },
      h('span', {}, text('segment.range')),
      h('span', { class: 'value' }, low, '–', high),
    );
    this.#apply = h(
      'button',
      { type: 'button', class: 'wide', 'data-action': 'apply', onclick: events.onApply },
      text('segment.apply'),
    );
    this.#undo = h('button', { type: 'button', 'data-transport': 'undo', onclick: events.onUndo }, icon(UNDO));
    this.#redo = h('button', { type: 'button', 'data-transport': 'redo', onclick: events.onRedo }, icon(REDO));
    const radiusLabel = labelFor(this.#radius, text('segment.radius'));
    this.#output.htmlFor.add(this.#radius.id);
    this.bar = h(
      'div',
      { class: 'tool-bar', role: 'group', 'aria-label': text('segment.sectionTool') },
      h('div', { class: 'tool-choice', role: 'radiogroup', 'aria-label': text('segment.toolGroup') }, ...radios),
      h('div', { class: 'radius', title: text('segment.radiusHelp') }, radiusLabel, this.#radius, this.#output),
      h('div', { class: 'buttons' }, this.#undo, this.#redo),
    );
    this.settings = h(
      'div',
      { class: 'tool-settings' },
      this.#help,
      this.#shape.element,
      this.#extent.element,
      this.#reach.element,
      this.#inRangeRow,
      this.#rangeRow,
      this.#error,
      h('label', { class: 'check' }, this.#protect, text('segment.protect')),
      h('p', { class: 'help' }, text('segment.protectHelp')),
      this.#apply,
      h('p', { class: 'help' }, text('segment.applyHelp')),
    );
    this.showUndo(undefined, undefined);
    this.#show();
  }

  get value(): ToolSettings {
    return this.#value;
  }

  /** Changes settings and reports all of them to the lab. */
  set(changed: Partial<ToolSettings>): void {
    const radius = Math.min(MOST_RADIUS, Math.max(0, changed.radius ?? this.#value.radius));
    const wanted = Math.round(changed.reach ?? this.#value.reach);
    const reach = Number.isNaN(wanted) ? this.#value.reach : Math.min(MOST_REACH, Math.max(1, wanted));
    this.#value = { ...this.#value, ...changed, radius, reach };
    this.#show();
    this.#events.onSettings(this.#value);
  }

  /** Makes the brush larger or smaller by a step. */
  changeRadius(steps: number): void {
    this.set({ radius: this.#value.radius + steps });
  }

  set enabled(enabled: boolean) {
    this.#apply.disabled = !enabled;
  }

  /** Sets the names of the changes that undo and redo would affect; undefined disables the button. */
  showUndo(undoable: string | undefined, redoable: string | undefined): void {
    showUndoable(this.#undo, text('controls.undo'), undoable);
    showUndoable(this.#redo, text('controls.redo'), redoable);
  }

  #listen(): void {
    const onChange = (control: HTMLElement, read: () => Partial<ToolSettings>) =>
      control.addEventListener('change', () => this.set(read()));
    const [shape, extent, reach] = [this.#shape.control, this.#extent.control, this.#reach.control];
    this.#radius.addEventListener('input', () => this.set({ radius: this.#radius.valueAsNumber }));
    onChange(shape, () => ({ shape: shape.value as BrushShape }));
    onChange(extent, () => ({ extent: extent.value as FillExtent }));
    onChange(reach, () => ({ reach: reach.valueAsNumber }));
    onChange(this.#inRange, () => ({ inRange: this.#inRange.checked }));
    onChange(this.#protect, () => ({ protect: this.#protect.checked }));
    for (const input of this.#ends) input.addEventListener('change', () => this.#changeRange());
  }

  #changeRange(): void {
    const [low, high] = this.#ends.map((input) => input.valueAsNumber) as [number, number];
    if (low <= high) this.set({ range: [low, high] });
    else this.#error.textContent = text('segment.rangeError');
  }

  #show(): void {
    const { tool, radius, shape, range, protect, extent, reach, inRange } = this.#value;
    for (const [one, radio] of this.#radios) radio.checked = one === tool;
    this.#help.textContent = TOOLS.find((one) => one.tool === tool)?.help ?? '';
    const hasBrush = tool === 'brush' || tool === 'threshold' || tool === 'eraser';
    this.#radius.valueAsNumber = radius;
    this.#output.value = String(radius);
    this.#radius.disabled = !hasBrush;
    this.#shape.control.value = shape;
    this.#shape.element.hidden = !hasBrush;
    this.#extent.control.value = extent;
    this.#extent.element.hidden = tool !== 'fill';
    this.#reach.control.valueAsNumber = reach;
    this.#inRange.checked = inRange;
    for (const row of [this.#reach.element, this.#inRangeRow]) row.hidden = tool !== 'fill' || extent === 'slice';
    this.#rangeRow.hidden = !usesRange(this.#value);
    for (const [side, input] of this.#ends.entries()) input.valueAsNumber = range[side] ?? 0;
    this.#error.textContent = '';
    this.#protect.checked = protect;
  }
}

function setting(name: string, attributes: Record<string, unknown>): HTMLInputElement {
  return h('input', { 'data-tool-setting': name, ...attributes });
}

function choice(name: string, label: string, choices: Record<string, string>): Field<HTMLSelectElement> {
  const entries = Object.entries(choices).map(([value, label]) => ({ value, label }));
  return new Field(selectFrom(entries, { 'data-tool-setting': name }), { label, row: 'row' });
}
