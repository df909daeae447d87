import { type Signal, signal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import type { VolumeView } from '../../../engine/protocol';
import { context2d, onSchemeChange, token } from '../../../kit/dom';
import { figure } from '../../../kit/format';
import { Field, NumberInput } from '../../../kit/ui/field';
import { text } from '../../../texts';

type Intensities = Pick<VolumeView, 'histogram' | 'range'>;

/** The iso value among the volume's intensities. */
export class IsoState {
  readonly volume = signal<Intensities | undefined>(undefined);
  readonly iso = signal(Number.NaN);
  /** Why a value was refused. */
  readonly error = signal('');
  readonly #onIso: (iso: number) => void;

  constructor(onIso: (iso: number) => void) {
    this.#onIso = onIso;
  }

  setIso(iso: number): void {
    this.iso.value = iso;
    this.error.value = '';
  }

  showError(message: string): void {
    this.error.value = message;
  }

  /** Takes over what the user entered; NaN is no number. */
  enter(iso: number): void {
    if (Number.isFinite(iso)) this.iso.value = iso;
    this.error.value = '';
    this.#onIso(iso);
  }
}

/**
 * Histogram of the volume's intensities, with counts on a logarithmic scale, and the iso value as a line. The line is
 * the thumb of a range input over the image, so it can be dragged and moved by arrow keys.
 */
export function Histogram({ state }: { state: IsoState }) {
  const iso = state.iso.value;
  const volume = state.volume.value;
  const [low, high] = volume?.range ?? [0, 1];
  const disabled = !volume;
  const below = (
    <>
      <div class="bars">
        <Bars volume={state.volume} iso={state.iso} />
        <input
          {...{ type: 'range', min: low, max: high, step: stepOf(low, high), value: Number.isNaN(iso) ? low : iso }}
          {...{ disabled, 'aria-label': text('extractPanels.isoSlider'), 'aria-valuetext': figure(iso) }}
          onInput={({ currentTarget }) => state.enter(currentTarget.valueAsNumber)}
        />
      </div>
      <div class="ends" aria-hidden="true">
        {[low, high].map((end, k) => (
          <span key={k}>{volume && figure(end)}</span>
        ))}
      </div>
    </>
  );
  return (
    <Field
      isRow
      {...{ class: 'histogram', 'data-param': 'iso', symbol: 'πI', below, error: state.error.value }}
      label={text('extractPanels.isoValue')}
      help={text('extractPanels.isoHelp')}
    >
      {(tied) => (
        <NumberInput
          {...{ ...tied, disabled, shown: Number.isNaN(iso) ? '' : String(Number(iso.toPrecision(6))) }}
          onEnter={(value) => state.enter(value)}
        />
      )}
    </Field>
  );
}

/** The bars, drawn again whenever their size or the colour scheme changes. */
function Bars({ volume, iso }: { volume: Signal<Intensities | undefined>; iso: Signal<number> }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const again = () => {
    const present = volume.peek();
    if (canvas.current && present) draw(canvas.current, present, iso.peek());
  };
  useLayoutEffect(() => {
    if (!canvas.current) return;
    const sizes = new ResizeObserver(again);
    sizes.observe(canvas.current);
    const ignoreScheme = onSchemeChange(again);
    return () => {
      sizes.disconnect();
      ignoreScheme();
    };
  }, []);
  useLayoutEffect(again, [volume.value, iso.value]);
  return <canvas role="img" ref={canvas} aria-label={volume.value && describeHistogram(volume.value, iso.value)} />;
}

function draw(canvas: HTMLCanvasElement, { histogram, range }: Intensities, iso: number): void {
  const { clientWidth, clientHeight } = canvas;
  const context = context2d(canvas);
  if (!context || clientWidth === 0) return;
  const ratio = Math.min(devicePixelRatio, 2);
  canvas.width = Math.round(clientWidth * ratio);
  canvas.height = Math.round(clientHeight * ratio);
  context.scale(ratio, ratio);
  const peak = Math.log1p(histogram.reduce((most, n) => Math.max(most, n), 1));
  const isoBin = ((iso - range[0]) / (range[1] - range[0])) * histogram.length;
  const width = clientWidth / histogram.length;
  histogram.forEach((n, bin) => {
    context.fillStyle = token(bin >= isoBin ? '--bar-above' : '--bar-below');
    const height = (Math.log1p(n) / peak) * clientHeight;
    context.fillRect(bin * width, clientHeight - height, Math.ceil(width), height);
  });
}

/** Describes the histogram in words, for screen readers. */
function describeHistogram({ histogram, range: [low, high] }: Intensities, iso: number): string {
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
