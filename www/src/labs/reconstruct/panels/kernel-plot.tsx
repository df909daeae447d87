import { type ReadonlySignal, useComputed } from '@preact/signals';
import type { ParamValues } from '../../../engine/protocol';
import { figure } from '../../../kit/format';
import { LinePlot } from '../../../kit/line-plot';
import { text } from '../../../texts';
import { kernelParams, phi } from '../kernel';

const HEIGHT = 132;
/** Number of distances r at which the kernel is sampled, from 0 to 2, the side of the normalised box. */
const SAMPLES = 201;
const FARTHEST = 2;

/**
 * Plot of the Reconstruct lab's current radial basis function φ(r), divided by its largest magnitude, because only its
 * shape matters.
 */
export function KernelPlot({ params }: { params: ReadonlySignal<ParamValues> }) {
  const kernel = useComputed(() => kernelParams(params.value));
  const columns = useComputed(() => curveOf((r) => phi(kernel.value, r)));
  return (
    <LinePlot
      {...{ title: text('pointPanels.kernelTitle'), across: 'r', name: 'kernel', height: HEIGHT }}
      columns={columns.value}
      lines={[{ label: 'φ', color: '--curve' }]}
      x={{ range: [0, FARTHEST] }}
      y={{ range: (_, low, high) => [Math.min(0, low ?? 0), Math.max(0, high ?? 1)] }}
      yAxis={{ size: 36 }}
    >
      <figcaption data-plot="kernel">{describeKernel(kernel.value.kernel, (r) => phi(kernel.value, r))}</figcaption>
    </LinePlot>
  );
}

function curveOf(value: (r: number) => number): [number[], number[]] {
  const distances = Array.from({ length: SAMPLES }, (_, i) => (FARTHEST * i) / (SAMPLES - 1));
  const values = distances.map(value);
  const most = Math.max(...values.map(Math.abs));
  return [distances, values.map((one) => one / most)];
}

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
