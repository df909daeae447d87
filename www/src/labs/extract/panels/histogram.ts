import type { VolumeView } from '../../../engine/protocol';
import { context2d, h, onSchemeChange, token } from '../../../kit/dom';
import { Field, showIn } from '../../../kit/field';
import { figure } from '../../../kit/format';
import { text } from '../../../texts';

/**
 * Histogram of the volume's intensities, with counts on a logarithmic scale, and the iso value as a line. The line is
 * the thumb of a range input over the image, so it can be dragged and moved by arrow keys.
 */
export class Histogram {
  readonly element: HTMLElement;
  readonly #canvas = h('canvas', { role: 'img' });
  readonly #slider = h('input', { type: 'range', 'aria-label': text('extractPanels.isoSlider'), disabled: true });
  readonly #number = h('input', { type: 'number', step: 'any', disabled: true });
  readonly #ends = [h('span'), h('span')] as const;
  readonly #field: Field;
  readonly #observer = new ResizeObserver(() => this.#draw());
  #volume: Pick<VolumeView, 'histogram' | 'range'> | undefined;

  constructor(onIso: (iso: number) => void) {
    this.#slider.addEventListener('input', () => this.#changed(this.#slider.valueAsNumber, onIso));
    this.#number.addEventListener('change', () => this.#changed(this.#number.valueAsNumber, onIso));
    this.#field = new Field(this.#number, {
      label: text('extractPanels.isoValue'),
      symbol: 'πI',
      help: text('extractPanels.isoHelp'),
      row: 'row',
      extra: [
        h('div', { class: 'bars' }, this.#canvas, this.#slider),
        h('div', { class: 'ends', 'aria-hidden': 'true' }, ...this.#ends),
      ],
      attributes: { class: 'histogram', 'data-param': 'iso' },
    });
    this.element = this.#field.element;
    this.#observer.observe(this.#canvas);
    onSchemeChange(() => this.#draw());
  }

  setVolume(volume: Pick<VolumeView, 'histogram' | 'range'>): void {
    this.#volume = volume;
    const [low, high] = volume.range;
    Object.assign(this.#slider, {
      min: String(low),
      max: String(high),
      step: String(stepOf(low, high)),
      disabled: false,
    });
    this.#number.disabled = false;
    this.#ends[0].textContent = figure(low);
    this.#ends[1].textContent = figure(high);
    this.#draw();
  }

  setIso(iso: number): void {
    this.#slider.valueAsNumber = iso;
    this.#slider.setAttribute('aria-valuetext', figure(iso));
    showIn(this.#number, String(Number(iso.toPrecision(6))));
    this.#field.showError(undefined);
    this.#draw();
  }

  showError(message: string): void {
    this.#field.showError(message);
  }

  #changed(iso: number, onIso: (iso: number) => void): void {
    if (Number.isFinite(iso)) this.setIso(iso);
    onIso(iso);
  }

  #draw(): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const context = context2d(this.#canvas);
    if (!this.#volume || !context || clientWidth === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.#canvas.width = Math.round(clientWidth * ratio);
    this.#canvas.height = Math.round(clientHeight * ratio);
    context.scale(ratio, ratio);
    const { histogram, range } = this.#volume;
    const peak = Math.log1p(histogram.reduce((most, n) => Math.max(most, n), 1));
    const isoBin = ((this.#slider.valueAsNumber - range[0]) / (range[1] - range[0])) * histogram.length;
    const width = clientWidth / histogram.length;
    histogram.forEach((n, bin) => {
      context.fillStyle = token(bin >= isoBin ? '--bar-above' : '--bar-below');
      const height = (Math.log1p(n) / peak) * clientHeight;
      context.fillRect(bin * width, clientHeight - height, Math.ceil(width), height);
    });
    this.#describe();
  }

  #describe(): void {
    if (this.#volume)
      this.#canvas.setAttribute('aria-label', describeHistogram(this.#volume, this.#slider.valueAsNumber));
  }
}

/** Describes the histogram in words, for screen readers. */
function describeHistogram(
  { histogram, range: [low, high] }: Pick<VolumeView, 'histogram' | 'range'>,
  iso: number,
): string {
  const all = histogram.reduce((sum, n) => sum + n, 0);
  const isoBin = ((iso - low) / (high - low)) * histogram.length;
  let [half, below, above] = [0, 0, 0];
  for (const [bin, n] of histogram.entries()) {
    below += n;
    if (2 * below <= all) half = bin + 1;
    if (bin >= isoBin) above += n;
  }
  const middle = low + (half / histogram.length) * (high - low);
  const share = all > 0 ? (100 * above) / all : 0;
  return text('extractPanels.histogramTold', {
    low: figure(low),
    high: figure(high),
    middle: figure(Math.round(middle)),
    share: share.toFixed(1),
  });
}

/** Returns the step of the iso value's slider: 1 for integer ends at least 50 apart, else a thousandth of the range. */
function stepOf(low: number, high: number): number {
  const span = high - low;
  return Number.isInteger(low) && Number.isInteger(high) && span >= 50 ? 1 : span / 1000;
}
