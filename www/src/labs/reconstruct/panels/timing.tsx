import { signal } from '@preact/signals';
import { useMemo } from 'preact/hooks';
import { count, figure, milliseconds } from '../../../kit/format';
import { LinePlot, PlotLegend } from '../../../kit/line-plot';
import { Help } from '../../../kit/ui/parts';
import { begun, ended, IDLE, Task, type TaskState } from '../../../kit/ui/task';
import { text } from '../../../texts';
import type { ReconstructClient } from '../client';
import type { Timing } from '../protocol';

const SIZES = [250, 500, 1000, 2000, 3000, 4500, 6000];
const KERNELS = ['multi-order', 'thin-plate'] as const;
const COLORS = { 'multi-order': '--curve', 'thin-plate': '--cut' } as const;
const KEYS = [
  { name: 'axial', label: KERNELS[0] },
  { name: 'annular', label: KERNELS[1] },
];
const HEIGHT = 160;

/**
 * Durations of the Reconstruct lab's solve on this machine, plotted against the number of constraints (figure 4d of the
 * paper).
 */
export class Timings {
  readonly all = signal<readonly Timing[]>([]);
  readonly task = signal<TaskState>(IDLE);
  readonly isEnabled = signal(false);
  readonly #client: ReconstructClient;
  readonly #onError: (title: string, error: unknown) => void;

  constructor(client: ReconstructClient, onError: (title: string, error: unknown) => void) {
    this.#client = client;
    this.#onError = onError;
  }

  clear(): void {
    this.task.value = { ...this.task.peek(), message: '' };
    this.all.value = [];
  }

  add(timing: Timing): void {
    const all = [...this.all.peek(), timing];
    this.task.value = { ...this.task.peek(), progress: all.length };
    this.all.value = all;
  }

  async measure(): Promise<void> {
    this.all.value = [];
    this.task.value = begun(text('controls.measuring'));
    try {
      const kernels = [...KERNELS];
      const timings = await this.#client.request('timing', { sizes: SIZES, kernels });
      this.task.value = ended(timings ? describeGrowth(timings) : text('controls.cancelled'));
    } catch (error) {
      this.task.value = ended(text('pointPanels.measurementFailed'));
      this.#onError(text('pointPanels.measurementFailed'), error);
    }
  }

  cancel(): void {
    void this.#client.request('cancelTiming', undefined);
  }
}

/** Panel that measures durations, and shows them. */
export function TimingPanel({ of }: { of: Timings }) {
  return (
    <div class="compare" data-timings={JSON.stringify(of.all.value)}>
      <Help>{text('pointPanels.timingHelp')}</Help>
      <Task
        {...{ name: 'timing', task: of.task.value, isEnabled: of.isEnabled.value }}
        {...{ start: text('pointPanels.measure'), progress: text('controls.measurementProgress') }}
        max={SIZES.length * KERNELS.length}
        onStart={() => void of.measure()}
        onCancel={() => of.cancel()}
      />
      <TimingPlot of={of} />
    </div>
  );
}

function TimingPlot({ of }: { of: Timings }) {
  const all = of.all.value;
  const columns = useMemo(() => columnsOf(all), [all]);
  return (
    <LinePlot
      {...{ title: text('pointPanels.timingFigure'), name: 'timing', height: HEIGHT, hidden: all.length === 0 }}
      across={text('pointPanels.columnConstraints')}
      lines={KERNELS.map((label) => ({ label, color: COLORS[label], dots: true }))}
      columns={columns}
      x={{ range: from0 }}
      y={{ range: from0 }}
      yAxis={{ size: 36 }}
    >
      <PlotLegend keys={KEYS} />
      <TimingTable of={of} />
    </LinePlot>
  );
}

/** Returns the numbers of constraints, and the seconds of each kernel. */
function columnsOf(all: readonly Timing[]): (number | null)[][] {
  const sizes = sizesOf(all);
  const seconds = (kernel: string) =>
    sizes.map((size) => {
      const one = timingOf(all, kernel, size);
      return one ? one.milliseconds / 1000 : null;
    });
  return [sizes, ...KERNELS.map(seconds)];
}

function TimingTable({ of }: { of: Timings }) {
  const all = of.all.value;
  const cell = (kernel: string, size: number) => {
    const one = timingOf(all, kernel, size);
    return <td key={kernel}>{one && milliseconds(one.milliseconds)}</td>;
  };
  return (
    <table class="times">
      <thead>
        <tr>
          {[text('pointPanels.columnConstraints'), ...KERNELS].map((title) => (
            <th key={title} scope="col">
              {title}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {sizesOf(all).map((size) => (
          <tr key={size}>
            <th scope="row">{count(size)}</th>
            {KERNELS.map((kernel) => cell(kernel, size))}
          </tr>
        ))}
      </tbody>
    </table>
  );
}

const sizesOf = (all: readonly Timing[]) =>
  [...new Set(all.map(({ constraints }) => constraints))].sort((a, b) => a - b);

const timingOf = (all: readonly Timing[], kernel: string, size: number) =>
  all.find((one) => one.kernel === kernel && one.constraints === size);

/** Describes in words how the solve's duration grows from the smallest to the largest number of constraints. */
function describeGrowth(timings: Timing[]): string {
  const parts = KERNELS.map((kernel) => {
    const [first, ...rest] = timings.filter((one) => one.kernel === kernel);
    const last = rest.at(-1);
    if (!first || !last) return '';
    const [more, longer] = [last.constraints / first.constraints, last.milliseconds / first.milliseconds];
    return text('pointPanels.timingGrowth', {
      kernel,
      more: figure(Number(more.toPrecision(2))),
      longer: figure(Number(longer.toPrecision(2))),
    });
  });
  return `${parts.filter(Boolean).join('; ')}.`.replace(/^./, (letter) => letter.toUpperCase());
}

function from0(_: unknown, __: number | null, high: number | null): [number, number] {
  return [0, high || 1];
}
