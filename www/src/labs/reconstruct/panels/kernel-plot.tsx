import { signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import type { ParamValues } from '../../../engine/protocol';
import { figure } from '../../../kit/format';
import { LinePlot } from '../../../kit/line-plot';
import { elementOf } from '../../../kit/ui/mount';
import { text } from '../../../texts';
import { kernelParams, phi } from '../kernel';

const HEIGHT = 132;
/** Number of distances r at which the kernel is sampled, from 0 to 2, the side of the normalised box. */
const SAMPLES = 201;
const FARTHEST = 2;

/**
 * The Reconstruct lab's current radial basis function φ(r), divided by its largest magnitude, because only its shape
 * matters.
 */
export class KernelCurve {
  readonly #caption = signal('');
  readonly plot = new LinePlot({
    ...{ title: text('pointPanels.kernelTitle'), across: 'r', name: 'kernel', height: HEIGHT },
    below: [elementOf(<Caption>{this.#caption}</Caption>)],
    lines: [{ label: 'φ', color: '--curve' }],
    x: { range: [0, FARTHEST] },
    y: { range: (_, low, high) => [Math.min(0, low ?? 0), Math.max(0, high ?? 1)] },
    yAxis: { size: 36 },
  });

  show(params: ParamValues): void {
    const kernel = kernelParams(params);
    const distances = Array.from({ length: SAMPLES }, (_, i) => (FARTHEST * i) / (SAMPLES - 1));
    const values = distances.map((r) => phi(kernel, r));
    const most = Math.max(...values.map(Math.abs));
    this.plot.show([distances, values.map((value) => value / most)]);
    this.#caption.value = describeKernel(kernel.kernel, (r) => phi(kernel, r));
  }
}

const Caption = ({ children }: { children: ComponentChildren }) => (
  <figcaption data-plot="kernel">{children}</figcaption>
);

function describeKernel(kernel: string, value: (r: number) => number): string {
  const unit = text('pointPanels.kernelUnit');
  if (kernel === 'thin-plate' || kernel === 'biharmonic') return text('pointPanels.kernelUnbounded', { unit });
  const half = bisect((r) => value(r) - value(0) / 2);
  const left = value(0.5) / value(0);
  return text('pointPanels.kernelDecay', {
    half: figure(Number(half.toPrecision(2))),
    left: figure(Number((100 * left).toPrecision(2))),
    unit,
  });
}

/** Returns the zero of a decreasing function, between 0 and 100, by bisection. */
function bisect(f: (r: number) => number): number {
  let [low, high] = [0, 100];
  for (let i = 0; i < 60; i++) {
    const middle = (low + high) / 2;
    if (f(middle) > 0) low = middle;
    else high = middle;
  }
  return low;
}
