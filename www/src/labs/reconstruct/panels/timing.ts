import { h } from '../../../kit/dom';
import { count, figure, milliseconds } from '../../../kit/format';
import { LinePlot } from '../../../kit/line-plot';
import { legendOf } from '../../../kit/plots';
import { TaskControls } from '../../../kit/task';
import { text } from '../../../texts';
import type { ReconstructClient } from '../client';
import type { Timing } from '../protocol';

const SIZES = [250, 500, 1000, 2000, 3000, 4500, 6000];
const KERNELS = ['multi-order', 'thin-plate'] as const;
const COLORS = { 'multi-order': '--curve', 'thin-plate': '--cut' } as const;
const HEIGHT = 160;

/**
 * Panel that measures the duration of the Reconstruct lab's solve on this machine and plots it against the number of
 * constraints (figure 4d of the paper).
 */
export class TimingPanel {
  readonly element: HTMLElement;
  readonly #client: ReconstructClient;
  readonly #onError: (title: string, error: unknown) => void;
  readonly #task: TaskControls;
  readonly #plot: LinePlot;
  readonly #table = h('table', { class: 'times' });
  #timings: Timing[] = [];

  constructor(client: ReconstructClient, onError: (title: string, error: unknown) => void) {
    this.#client = client;
    this.#onError = onError;
    this.#task = new TaskControls({
      name: 'timing',
      start: text('pointPanels.measure'),
      progress: text('controls.measurementProgress'),
      max: SIZES.length * KERNELS.length,
      onStart: () => void this.#run(),
      onCancel: () => void client.request('cancelTiming', undefined),
    });
    const keys = [
      { name: 'axial', label: KERNELS[0] },
      { name: 'annular', label: KERNELS[1] },
    ];
    this.#plot = new LinePlot({
      ...{ title: text('pointPanels.timingFigure'), name: 'timing', height: HEIGHT },
      across: text('pointPanels.columnConstraints'),
      lines: KERNELS.map((label) => ({ label, color: COLORS[label], dots: true })),
      x: { range: from0 },
      y: { range: from0 },
      yAxis: { size: 36 },
      below: [legendOf(keys), this.#table],
    });
    this.#plot.element.hidden = true;
    this.element = h(
      'div',
      { class: 'compare', 'data-timings': '[]' },
      h('p', { class: 'help' }, text('pointPanels.timingHelp')),
      ...this.#task.elements,
      this.#plot.element,
    );
  }

  set enabled(enabled: boolean) {
    this.#task.enabled = enabled;
  }

  clear(): void {
    this.#timings = [];
    this.#task.say('');
    this.#draw();
  }

  add(timing: Timing): void {
    this.#timings.push(timing);
    this.#task.showProgress(this.#timings.length);
    this.#draw();
  }

  async #run(): Promise<void> {
    this.clear();
    this.#task.begin(text('controls.measuring'));
    try {
      const kernels = [...KERNELS];
      const timings = await this.#client.request('timing', { sizes: SIZES, kernels });
      this.#task.end(timings ? describeGrowth(timings) : text('controls.cancelled'));
    } catch (error) {
      this.#task.end(text('pointPanels.measurementFailed'));
      this.#onError(text('pointPanels.measurementFailed'), error);
    }
  }

  #draw(): void {
    this.element.dataset.timings = JSON.stringify(this.#timings);
    this.#plot.element.hidden = this.#timings.length === 0;
    const sizes = [...new Set(this.#timings.map(({ constraints }) => constraints))].sort((a, b) => a - b);
    const of = (kernel: string) =>
      sizes.map((size) => this.#timings.find((one) => one.kernel === kernel && one.constraints === size));
    const seconds = (kernel: string) => of(kernel).map((one) => (one ? one.milliseconds / 1000 : null));
    this.#plot.show([sizes, ...KERNELS.map(seconds)]);
    const head = [text('pointPanels.columnConstraints'), ...KERNELS].map((title) => h('th', { scope: 'col' }, title));
    const rows = sizes.map((size, i) => {
      const cells = KERNELS.map((kernel) => {
        const one = of(kernel)[i];
        return h('td', {}, one ? milliseconds(one.milliseconds) : '');
      });
      return h('tr', {}, h('th', { scope: 'row' }, count(size)), ...cells);
    });
    this.#table.replaceChildren(h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows));
  }
}

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
