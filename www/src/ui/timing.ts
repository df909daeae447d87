import uPlot from 'uplot';
import type { ReconstructClient } from '../reconstruct/client';
import type { Timing } from '../reconstruct/protocol';
import { text } from '../texts';
import { h, onSchemeChange, token } from './dom';
import { count, figure, milliseconds } from './format';

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
  readonly #start: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #status = h('p', { class: 'help', role: 'status' });
  readonly #progress = h('progress', {
    max: SIZES.length * KERNELS.length,
    value: 0,
    hidden: true,
    'aria-label': text('controls.measurementProgress'),
  });
  readonly #plot: uPlot;
  readonly #figure: HTMLElement;
  readonly #table = h('table', { class: 'times' });
  #timings: Timing[] = [];

  constructor(client: ReconstructClient, onError: (title: string, error: unknown) => void) {
    this.#client = client;
    this.#onError = onError;
    this.#start = h(
      'button',
      { type: 'button', onclick: () => void this.#run(), 'data-timing': 'start' },
      text('pointPanels.measure'),
    );
    this.#cancel = h(
      'button',
      {
        type: 'button',
        hidden: true,
        'data-timing': 'cancel',
        onclick: () => void client.request('cancelTiming', undefined),
      },
      text('controls.cancel'),
    );
    const holder = h('div', { class: 'plot timing', 'aria-hidden': 'true' });
    const key = (name: string, text: string) =>
      h('span', {}, h('span', { class: `mark ${name}`, 'aria-hidden': 'true' }), text);
    const legend = h('p', { class: 'legend' }, key('axial', 'multi-order'), key('annular', 'thin-plate'));
    this.#figure = h(
      'figure',
      { hidden: true },
      h('h3', {}, text('pointPanels.timingFigure')),
      holder,
      legend,
      this.#table,
    );
    this.#plot = new uPlot(options(), [[], [], []], holder);
    new ResizeObserver(() => {
      if (holder.clientWidth > 0) this.#plot.setSize({ width: holder.clientWidth, height: HEIGHT });
    }).observe(holder);
    onSchemeChange(() => this.#draw());
    this.element = h(
      'div',
      { class: 'compare', 'data-timings': '[]' },
      h('p', { class: 'help' }, text('pointPanels.timingHelp')),
      h('div', { class: 'buttons' }, this.#start, this.#cancel),
      this.#progress,
      this.#status,
      this.#figure,
    );
  }

  set enabled(enabled: boolean) {
    this.#start.disabled = !enabled;
  }

  clear(): void {
    this.#timings = [];
    this.#status.textContent = '';
    this.#draw();
  }

  add(timing: Timing): void {
    this.#timings.push(timing);
    this.#progress.value = this.#timings.length;
    this.#draw();
  }

  async #run(): Promise<void> {
    this.clear();
    this.#showBusy(true);
    try {
      const kernels = [...KERNELS];
      const timings = await this.#client.request('timing', { sizes: SIZES, kernels });
      this.#status.textContent = timings ? describeGrowth(timings) : text('controls.cancelled');
    } catch (error) {
      this.#status.textContent = text('pointPanels.measurementFailed');
      this.#onError(text('pointPanels.measurementFailed'), error);
    }
    this.#showBusy(false);
  }

  #showBusy(busy: boolean): void {
    this.#start.hidden = busy;
    this.#cancel.hidden = !busy;
    this.#progress.hidden = !busy;
    this.#progress.value = 0;
    (busy ? this.#cancel : this.#start).focus();
    if (busy) this.#status.textContent = text('controls.measuring');
  }

  #draw(): void {
    this.element.dataset.timings = JSON.stringify(this.#timings);
    this.#figure.hidden = this.#timings.length === 0;
    const sizes = [...new Set(this.#timings.map(({ constraints }) => constraints))].sort((a, b) => a - b);
    const of = (kernel: string) =>
      sizes.map((size) => this.#timings.find((one) => one.kernel === kernel && one.constraints === size));
    const seconds = (kernel: string) => of(kernel).map((one) => (one ? one.milliseconds / 1000 : null));
    this.#plot.setData([sizes, ...KERNELS.map(seconds)] as uPlot.AlignedData);
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

function options(): uPlot.Options {
  const axis: uPlot.Axis = {
    stroke: () => token('--muted'),
    grid: { stroke: () => token('--line'), width: 1 },
    ticks: { show: false },
    font: '11px system-ui, sans-serif',
  };
  const from0 = (_: uPlot, __: number | null, high: number | null): uPlot.Range.MinMax => [0, high || 1];
  return {
    width: 280,
    height: HEIGHT,
    legend: { show: false },
    cursor: { y: false, drag: { x: false, y: false } },
    padding: [8, 12, 0, 0],
    scales: { x: { time: false, range: from0 }, y: { range: from0 } },
    axes: [
      { ...axis, size: 24 },
      { ...axis, size: 36 },
    ],
    series: [
      {},
      ...KERNELS.map((kernel) => ({
        label: kernel,
        stroke: () => token(COLORS[kernel]),
        width: 1.5,
        spanGaps: true,
        points: { show: true, size: 5 },
      })),
    ],
  };
}
