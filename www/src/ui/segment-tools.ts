import { text } from '../texts';
import { h, icon, uniqueId } from './dom';

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
  readonly #radius: HTMLInputElement;
  readonly #output: HTMLOutputElement;
  readonly #radiusRow: HTMLElement;
  readonly #shape: HTMLSelectElement;
  readonly #shapeRow: HTMLElement;
  readonly #extent: HTMLSelectElement;
  readonly #extentRow: HTMLElement;
  readonly #reach: HTMLInputElement;
  readonly #reachRow: HTMLElement;
  readonly #inRange = h('input', { type: 'checkbox', 'data-tool-setting': 'in-range' });
  readonly #inRangeRow = h('label', { class: 'check' }, this.#inRange, text('segment.inRange'));
  readonly #ends: [HTMLInputElement, HTMLInputElement];
  readonly #rangeRow: HTMLElement;
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #protect = h('input', { type: 'checkbox', 'data-tool-setting': 'protect' });
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
    [this.#radiusRow, this.#radius, this.#output] = this.#buildRadius();
    [this.#shapeRow, this.#shape] = this.#buildShape();
    [this.#extentRow, this.#extent] = this.#buildExtent();
    [this.#reachRow, this.#reach] = this.#buildReach();
    [this.#rangeRow, this.#ends] = this.#buildRange();
    this.#inRange.addEventListener('change', () => this.set({ inRange: this.#inRange.checked }));
    this.#protect.addEventListener('change', () => this.set({ protect: this.#protect.checked }));
    this.#apply = h(
      'button',
      { type: 'button', class: 'wide', 'data-action': 'apply', onclick: events.onApply },
      text('segment.apply'),
    );
    this.#undo = h('button', { type: 'button', 'data-transport': 'undo', onclick: events.onUndo }, icon(UNDO));
    this.#redo = h('button', { type: 'button', 'data-transport': 'redo', onclick: events.onRedo }, icon(REDO));
    this.bar = h(
      'div',
      { class: 'tool-bar', role: 'group', 'aria-label': text('segment.sectionTool') },
      h('div', { class: 'tool-choice', role: 'radiogroup', 'aria-label': text('segment.toolGroup') }, ...radios),
      this.#radiusRow,
      h('div', { class: 'buttons' }, this.#undo, this.#redo),
    );
    this.settings = h(
      'div',
      { class: 'tool-settings' },
      this.#help,
      this.#shapeRow,
      this.#extentRow,
      this.#reachRow,
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
    for (const [button, verb, what] of [
      [this.#undo, text('controls.undo'), undoable],
      [this.#redo, text('controls.redo'), redoable],
    ] as const) {
      button.disabled = what === undefined;
      const title =
        what === undefined ? text('controls.nothingTo', { verb }) : text('controls.doAction', { verb, action: what });
      button.title = title;
      button.setAttribute('aria-label', title);
    }
  }

  #buildRadius(): [HTMLElement, HTMLInputElement, HTMLOutputElement] {
    const id = uniqueId('radius');
    const slider = h('input', { type: 'range', id, min: 0, max: MOST_RADIUS, step: 1, 'data-tool-setting': 'radius' });
    slider.addEventListener('input', () => this.set({ radius: slider.valueAsNumber }));
    const output = h('output', { for: id, 'aria-live': 'off' });
    const title = text('segment.radiusHelp');
    return [
      h('div', { class: 'radius', title }, h('label', { for: id }, text('segment.radius')), slider, output),
      slider,
      output,
    ];
  }

  #buildShape(): [HTMLElement, HTMLSelectElement] {
    const id = uniqueId('shape');
    const select = h(
      'select',
      { id, 'data-tool-setting': 'shape' },
      h('option', { value: 'ball' }, text('segment.ball')),
      h('option', { value: 'disc' }, text('segment.disc')),
    );
    select.addEventListener('change', () => this.set({ shape: select.value as BrushShape }));
    return [h('div', { class: 'row' }, h('label', { for: id }, text('segment.shape')), select), select];
  }

  #buildExtent(): [HTMLElement, HTMLSelectElement] {
    const id = uniqueId('extent');
    const select = h(
      'select',
      { id, 'data-tool-setting': 'extent' },
      h('option', { value: 'slice' }, text('segment.extentSlice')),
      h('option', { value: 'box' }, text('segment.extentBox')),
    );
    select.addEventListener('change', () => this.set({ extent: select.value as FillExtent }));
    return [h('div', { class: 'row' }, h('label', { for: id }, text('segment.extent')), select), select];
  }

  #buildReach(): [HTMLElement, HTMLInputElement] {
    const id = uniqueId('reach');
    const input = h('input', { type: 'number', id, min: 1, max: MOST_REACH, step: 1, 'data-tool-setting': 'reach' });
    input.addEventListener('change', () => this.set({ reach: input.valueAsNumber }));
    const title = text('segment.reachHelp');
    return [h('div', { class: 'row', title }, h('label', { for: id }, text('segment.reach')), input), input];
  }

  #buildRange(): [HTMLElement, [HTMLInputElement, HTMLInputElement]] {
    const ends = (['low', 'high'] as const).map((end) => {
      const label = text(end === 'low' ? 'segment.rangeLow' : 'segment.rangeHigh');
      const input = h('input', { type: 'number', step: 'any', required: true, 'aria-label': label });
      input.dataset.toolSetting = end;
      input.addEventListener('change', () => this.#changeRange());
      return input;
    }) as [HTMLInputElement, HTMLInputElement];
    const row = h(
      'div',
      { class: 'row stacked' },
      h('span', {}, text('segment.range')),
      h('span', { class: 'value' }, ends[0], '–', ends[1]),
    );
    return [row, ends];
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
    this.#shape.value = shape;
    this.#shapeRow.hidden = !hasBrush;
    this.#extent.value = extent;
    this.#extentRow.hidden = tool !== 'fill';
    this.#reach.valueAsNumber = reach;
    this.#inRange.checked = inRange;
    for (const row of [this.#reachRow, this.#inRangeRow]) row.hidden = tool !== 'fill' || extent === 'slice';
    this.#rangeRow.hidden = !usesRange(this.#value);
    for (const [side, input] of this.#ends.entries()) input.valueAsNumber = range[side] ?? 0;
    this.#error.textContent = '';
    this.#protect.checked = protect;
  }
}
