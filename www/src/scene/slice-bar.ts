import { h } from '../kit/dom';
import { placed, selectFrom } from '../kit/field';
import { type TextKey, text } from '../texts';
import type { DisplayWindow } from './slicing';

/** The part of the surface that is cut away in the 3D view: the patient's right, left, front, back, top or bottom. */
export type CutSide = 'none' | 'R' | 'L' | 'A' | 'P' | 'S' | 'I';

const SIDES: { value: CutSide; label: string }[] = [
  { value: 'none', label: text('slices.cutNone') },
  { value: 'R', label: text('slices.cutRight') },
  { value: 'L', label: text('slices.cutLeft') },
  { value: 'A', label: text('slices.cutFront') },
  { value: 'P', label: text('slices.cutBack') },
  { value: 'S', label: text('slices.cutTop') },
  { value: 'I', label: text('slices.cutBottom') },
];

/** Windows for computed tomography, in Hounsfield units: width and level. */
const CT_WINDOWS: { key: TextKey; width: number; level: number }[] = [
  { key: 'slices.bone', width: 1800, level: 400 },
  { key: 'slices.softTissue', width: 400, level: 50 },
  { key: 'slices.lung', width: 1500, level: -600 },
  { key: 'slices.brain', width: 80, level: 40 },
];

/**
 * Returns whether intensities may be Hounsfield units: they reach from those of air, or the padding around a scan, to
 * those of soft tissue at least.
 */
export function mayBeHounsfield([low, high]: readonly [number, number]): boolean {
  return low <= -200 && low >= -8192 && high >= 50 && high <= 2 ** 15;
}

interface Preset {
  name: string;
  label: string;
  window: DisplayWindow;
}

export interface SliceBarEvents {
  onWindow: (window: DisplayWindow) => void;
  onCut: (side: CutSide) => void;
  onResetZoom: () => void;
}

/**
 * Controls of what all slices of a volume share: the intensities displayed as black and as white, and the cut through
 * the surface along a slice; with a readout of the voxel under the pointer.
 */
export class SliceBar {
  readonly element: HTMLElement;
  readonly #readout = h('p', { class: 'readout', 'data-readout': '' });
  readonly #adjusting = h('input', { type: 'checkbox', 'data-slices': 'adjust' });
  readonly #reset: HTMLButtonElement;
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #presets: Preset[];
  readonly #preset: HTMLSelectElement;
  readonly #cut: HTMLSelectElement;
  readonly #width: HTMLInputElement;
  readonly #level: HTMLInputElement;
  readonly #onWindow: (window: DisplayWindow) => void;
  #window: DisplayWindow;

  /** `range` are the intensities of the volume, `suggested` the window that the slices have at first. */
  constructor(range: DisplayWindow, suggested: DisplayWindow, { onWindow, onCut, onResetZoom }: SliceBarEvents) {
    this.#onWindow = onWindow;
    this.#window = suggested;
    this.#presets = presetsFor(range, suggested);
    const choices = [...this.#presets, { name: 'custom', label: text('slices.custom') }];
    this.#preset = selectFrom(
      choices.map(({ name, label }) => ({ value: name, label })),
      { 'data-view': 'window', onchange: () => this.#choose(this.#preset.value) },
    );
    [this.#width, this.#level] = [this.#number('width'), this.#number('level')];
    this.#cut = selectFrom(SIDES, { 'data-view': 'cut', onchange: () => onCut(this.#cut.value as CutSide) });
    this.#reset = h('button', { type: 'button', disabled: true, onclick: onResetZoom }, text('slices.resetZoom'));
    this.element = h(
      'div',
      { class: 'slice-bar' },
      this.#readout,
      h(
        'details',
        {},
        h('summary', {}, text('slices.options')),
        h(
          'div',
          { class: 'slice-options' },
          placed(text('slices.contrast'), this.#preset),
          placed(text('slices.width'), this.#width),
          placed(text('slices.level'), this.#level),
          h('label', { class: 'check' }, this.#adjusting, text('slices.adjust')),
          placed(text('slices.cut'), this.#cut),
          this.#reset,
        ),
        this.#error,
        h('p', { class: 'help' }, text('slices.help')),
      ),
    );
    this.show(suggested);
  }

  /** Whether drags on the slices change the window. */
  get isAdjusting(): boolean {
    return this.#adjusting.checked;
  }

  set isZoomed(zoomed: boolean) {
    this.#reset.disabled = !zoomed;
  }

  set cut(side: CutSide) {
    this.#cut.value = side;
  }

  set readout(text: string) {
    this.#readout.textContent = text;
  }

  /** Shows the window in force. */
  show(window: DisplayWindow): void {
    const [low, high] = window;
    this.#window = window;
    this.#error.textContent = '';
    this.#width.value = typed(high - low);
    this.#level.value = typed((low + high) / 2);
    const preset = this.#presets.find((one) => one.window[0] === low && one.window[1] === high);
    this.#preset.value = preset?.name ?? 'custom';
  }

  #number(name: string): HTMLInputElement {
    const attributes = { type: 'number', step: 'any', inputmode: 'decimal', 'data-slices': name };
    return h('input', { ...attributes, onchange: () => this.#enter() });
  }

  #choose(name: string): void {
    const preset = this.#presets.find((one) => one.name === name);
    if (preset) this.#onWindow(preset.window);
    else this.#width.focus();
  }

  #enter(): void {
    const [width, level] = [this.#width.valueAsNumber, this.#level.valueAsNumber];
    const isValid = width > 0 && Number.isFinite(level);
    if (isValid) this.#onWindow(windowOf(width, level));
    else this.show(this.#window);
    this.#error.textContent = isValid ? '' : text('slices.windowError');
  }
}

function presetsFor(range: DisplayWindow, suggested: DisplayWindow): Preset[] {
  const tissues = mayBeHounsfield(range) ? CT_WINDOWS : [];
  return [
    { name: 'suggested', label: text('slices.suggested'), window: suggested },
    { name: 'whole', label: text('slices.whole'), window: range },
    ...tissues.map(({ key, width, level }) => ({ name: key, label: text(key), window: windowOf(width, level) })),
  ];
}

const windowOf = (width: number, level: number): DisplayWindow => [level - width / 2, level + width / 2];

const typed = (value: number) => String(Number(value.toPrecision(4)));
