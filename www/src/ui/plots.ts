import uPlot from 'uplot';
import { type TextKey, text } from '../texts';
import 'uplot/dist/uPlot.min.css';
import type { StepReport } from '../protocol';
import { h, onSchemeChange, token } from './dom';
import { count, figure } from './format';
import type { History } from './history';
import { totals } from './log';
import { PlotTable } from './plot-table';

const PLOT_HEIGHT = 144;
/** Space above a plot for the names of the levels, CSS pixels. */
const MARK_HEIGHT = 16;
/** Height of the tick marks of one type of topology event, CSS pixels. */
const MARK_LANE = 6;

export interface Curve {
  label: string;
  color: string;
  dash?: number[];
  of: (report: StepReport) => number;
}

export interface PlotKind {
  title: string;
  log: boolean;
  curves: Curve[];
  /** Describes the plot in words, for screen readers. */
  describe: (history: History) => string;
}

/** Plots of the deformable model: kinetic energy, number of vertices, Euler characteristic. */
export const ENERGY_PLOTS: PlotKind[] = [
  {
    title: text('measures.kineticEnergy'),
    log: true,
    curves: [
      { label: text('measures.curveEnergy'), color: '--curve', of: (report) => report.residual },
      { label: text('measures.curveTolerance'), color: '--muted', dash: [4, 4], of: (report) => report.tolerance },
    ],
    describe: describeEnergy,
  },
  {
    title: text('measures.vertices'),
    log: false,
    curves: [{ label: text('measures.curveVertices'), color: '--curve', of: (report) => report.vertices }],
    describe: (history) =>
      `${describeChange(history, 'measures.verticesChange', (report) => report.vertices)} ${describeByLevel(history)}`.trim(),
  },
  {
    title: text('measures.euler'),
    log: false,
    curves: [{ label: 'χ', color: '--curve', of: (report) => report.euler }],
    describe: (history) => describeChange(history, 'measures.eulerChange', (report) => report.euler),
  },
];

/** Live plots of a run over its iterations, with level changes and topology events marked. */
export class Plots {
  readonly element: HTMLElement;
  readonly #plots: Plot[];
  readonly #history: History;
  readonly #events = h('p', { class: 'help', 'data-plot-events': '' });
  readonly #table: PlotTable;
  readonly #stale = new Set<Plot>();
  #pending = 0;

  /** `events`: whether a legend and a description of the topology events are shown. */
  constructor(history: History, kinds: PlotKind[], events: boolean) {
    this.#history = history;
    this.#plots = kinds.map((kind) => new Plot(kind, history));
    this.element = h('div', { class: 'plots' }, ...this.#plots.map((plot) => plot.element));
    this.#table = new PlotTable(kinds.flatMap(({ curves }) => curves));
    if (events) this.element.append(this.#legend(), this.#events);
    this.element.append(this.#table.element);
    onSchemeChange(() => this.update());
  }

  #legend(): HTMLElement {
    const key = (name: string, text: string) =>
      h('span', {}, h('span', { class: `mark ${name}`, 'aria-hidden': 'true' }), text);
    return h(
      'p',
      { class: 'legend' },
      key('level', text('measures.levelChange')),
      key('axial', text('measures.axialEvent')),
      key('annular', text('measures.annularEvent')),
      key('vanished', text('measures.vanishedEvent')),
      key('seeds', text('measures.seededEvent')),
    );
  }

  /** Redraws the plots in the next animation frames, one plot in each: all at once would delay other rendering. */
  update(): void {
    for (const plot of this.#plots) this.#stale.add(plot);
    this.#pending ||= requestAnimationFrame(() => this.#redrawOne());
  }

  #redrawOne(): void {
    this.#pending = 0;
    const [plot] = this.#stale;
    if (!plot) return;
    // A plot that becomes stale again is queued after the others.
    this.#stale.delete(plot);
    plot.update(this.#history);
    if (this.#stale.size > 0) {
      this.#pending = requestAnimationFrame(() => this.#redrawOne());
      return;
    }
    this.#events.textContent = describeEvents(this.#history);
    this.#table.update(this.#history.reports);
  }
}

class Plot {
  readonly element: HTMLElement;
  readonly #kind: PlotKind;
  readonly #plot: uPlot;
  readonly #caption = h('figcaption');
  /** Plotted data: iterations, followed by the values of each curve, for the reports of the current run so far. */
  #columns: (number | null)[][] = [];
  #run: readonly StepReport[] | undefined;

  constructor(kind: PlotKind, history: History) {
    this.#kind = kind;
    const holder = h('div', { class: 'plot', 'aria-hidden': 'true' });
    this.element = h('figure', {}, h('h3', {}, kind.title), holder, this.#caption);
    const mark = (plot: uPlot) => drawMarks(plot, history);
    this.#plot = new uPlot(optionsFor(kind, mark), emptyData(kind), holder);
    new ResizeObserver(() => {
      if (holder.clientWidth > 0) this.#plot.setSize({ width: holder.clientWidth, height: PLOT_HEIGHT });
    }).observe(holder);
  }

  update(history: History): void {
    const { reports } = history;
    this.#extend(reports);
    this.#plot.setData(this.#columns as uPlot.AlignedData);
    this.#caption.textContent = reports.length > 0 ? this.#kind.describe(history) : text('measures.noSteps');
  }

  /** Appends the data of new reports only: runs have thousands of steps. */
  #extend(reports: readonly StepReport[]): void {
    const { curves, log } = this.#kind;
    if (reports !== this.#run) this.#columns = [[], ...curves.map(() => [])];
    this.#run = reports;
    const [iterations = [], ...values] = this.#columns;
    for (const report of reports.slice(iterations.length)) {
      iterations.push(report.iteration);
      for (const [i, { of }] of curves.entries()) values[i]?.push(plottable(of(report), log));
    }
  }
}

function emptyData(kind: PlotKind): uPlot.AlignedData {
  return [[], ...kind.curves.map(() => [])] as uPlot.AlignedData;
}

/** Returns a value to plot, or null if it cannot be drawn: not finite or, on a logarithmic axis, zero or below. */
function plottable(value: number, log: boolean): number | null {
  return Number.isFinite(value) && (!log || value > 0) ? value : null;
}

function optionsFor(kind: PlotKind, mark: (plot: uPlot) => void): uPlot.Options {
  const axis: uPlot.Axis = {
    stroke: () => token('--muted'),
    grid: { stroke: () => token('--line'), width: 1 },
    ticks: { show: false },
    font: '11px system-ui, sans-serif',
  };
  return {
    width: 280,
    height: PLOT_HEIGHT,
    legend: { show: false },
    cursor: { y: false, drag: { x: false, y: false } },
    padding: [MARK_HEIGHT, 8, 0, 0],
    scales: {
      x: { time: false, range: iterationRange },
      y: kind.log ? { distr: 3, range: logRange } : { range: valueRange },
    },
    axes: [
      { ...axis, size: 24 },
      {
        ...axis,
        size: 52,
        values: (_, ticks) => ticks.map((tick) => tickLabel(tick, kind.log)),
        // uPlot would omit the labels of some powers of ten.
        ...(kind.log && { splits: decades, filter: (_: uPlot, ticks: number[]) => ticks }),
      },
    ],
    series: [{}, ...kind.curves.map(seriesFor)],
    hooks: { drawClear: [mark] },
  };
}

function seriesFor({ label, color, dash }: Curve): uPlot.Series {
  return { label, stroke: () => token(color), width: 1.5, points: { show: false }, ...(dash && { dash }) };
}

function iterationRange(_: uPlot, __: number | null, last: number | null): uPlot.Range.MinMax {
  return [0, Math.max(10, last ?? 0)];
}

function valueRange(_: uPlot, low: number | null, high: number | null): uPlot.Range.MinMax {
  if (low === null || high === null) return [0, 1];
  const margin = Math.max(1, 0.08 * (high - low));
  return [low - margin, high + margin];
}

/**
 * Returns the range of a logarithmic axis: that of the data, rounded outwards to whole powers of ten; 10⁻⁷ to 1 without
 * data.
 */
function logRange(_: uPlot, low: number | null, high: number | null): uPlot.Range.MinMax {
  if (!low || !high) return [1e-7, 1];
  return [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high) + 1e-9)];
}

/**
 * Returns the tick positions of a logarithmic axis: every power of ten, or every n-th one where more than five would
 * result.
 */
function decades(_: uPlot, __: number, low: number, high: number): number[] {
  const [first, last] = [Math.round(Math.log10(low)), Math.round(Math.log10(high))];
  const step = Math.max(1, Math.ceil((last - first) / 4));
  return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, i) => 10 ** (first + i * step));
}

function tickLabel(tick: number | null, log: boolean): string {
  if (tick === null) return '';
  if (log) return `1e${Math.round(Math.log10(tick))}`;
  return Math.abs(tick) >= 10_000 ? `${count(tick / 1000)}k` : Number.isInteger(tick) ? count(tick) : '';
}

/** Draws level changes as vertical lines with their names, and topology events as tick marks at the bottom. */
function drawMarks(plot: uPlot, history: History): void {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.font = `${10 * devicePixelRatio}px system-ui, sans-serif`;
  ctx.textAlign = 'left';
  ctx.textBaseline = 'alphabetic';
  // Backwards, so that of overlapping names the later one is drawn.
  let free = Number.POSITIVE_INFINITY;
  for (const { iteration, phase } of [...history.phases].reverse()) {
    const x = Math.round(plot.valToPos(iteration, 'x', true));
    upright(ctx, x, bbox.top, bbox.top + bbox.height, token('--line-strong'));
    ctx.fillStyle = token('--muted');
    const { width } = ctx.measureText(phase);
    const at = Math.min(x, bbox.left + bbox.width - width);
    if (at + width > free) continue;
    ctx.fillText(phase, at, bbox.top - 4 * devicePixelRatio);
    free = at - 4 * devicePixelRatio;
  }
  const foot = bbox.top + bbox.height;
  // One lane per kind, so that none hides another.
  const lane = MARK_LANE * devicePixelRatio;
  const [join, cut, vanish, seed] = ['--join', '--cut', '--vanished', '--seed'].map(token) as [
    string,
    string,
    string,
    string,
  ];
  for (const { iteration, axial, annular, vanished, seeds } of history.changes) {
    const x = plot.valToPos(iteration, 'x', true);
    if (axial > 0) upright(ctx, x, foot - lane, foot, join);
    if (annular > 0) upright(ctx, x, foot - 2 * lane, foot - lane, cut);
    if (vanished > 0) upright(ctx, x, foot - 3 * lane, foot - 2 * lane, vanish);
    if (seeds > 0) upright(ctx, x, foot - 4 * lane, foot - 3 * lane, seed);
  }
  ctx.restore();
}

function upright(ctx: CanvasRenderingContext2D, x: number, top: number, bottom: number, color: string): void {
  ctx.beginPath();
  ctx.moveTo(x, top);
  ctx.lineTo(x, bottom);
  ctx.strokeStyle = color;
  ctx.lineWidth = devicePixelRatio;
  ctx.stroke();
}

function describeEnergy({ reports }: History): string {
  const last = reports.at(-1);
  if (!last) return '';
  const key = last.residual < last.tolerance ? 'measures.energyBelow' : 'measures.energyAbove';
  return text(key, {
    iterations: count(last.iteration),
    energy: figure(last.residual),
    tolerance: figure(last.tolerance),
  });
}

/** Describes in words where each level began, and all topology changes, for screen readers. */
function describeEvents({ phases, changes, reports }: History): string {
  if (reports.length === 0) return '';
  const levels = phases
    .map(({ phase, iteration }) => text('measures.phaseFrom', { phase, iteration: count(iteration) }))
    .join(', ');
  return `${levels[0]?.toUpperCase()}${levels.slice(1)}. ${totals(changes)}`;
}

/** Describes in words the number of vertices at the end of each level, for screen readers. */
function describeByLevel({ phases, reports }: History): string {
  const left = phases.slice(1).map(({ iteration }, i) => {
    const last = lastBefore(reports, iteration);
    return last && text('measures.verticesAtEnd', { vertices: count(last.vertices), phase: phases[i]?.phase ?? '' });
  });
  const known = left.filter(Boolean);
  return known.length > 0 ? `${known.join(', ')}.` : '';
}

function lastBefore(reports: readonly StepReport[], iteration: number): StepReport | undefined {
  for (let i = reports.length - 1; i >= 0; i--) if ((reports[i]?.iteration ?? iteration) < iteration) return reports[i];
  return undefined;
}

function describeChange({ reports }: History, key: TextKey, of: (report: StepReport) => number): string {
  const last = reports.at(-1);
  if (!last) return '';
  let [low, high] = [of(last), of(last)];
  for (const report of reports) {
    low = Math.min(low, of(report));
    high = Math.max(high, of(report));
  }
  return text(key, { now: count(of(last)), low: count(low), high: count(high) });
}
