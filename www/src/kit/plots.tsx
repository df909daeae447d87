import { signal } from '@preact/signals';
import type uPlot from 'uplot';
import type { StepReport } from '../engine/protocol';

import { type TextKey, text } from '../texts';
import type { PlotLine } from './curve-plot';
import { count, figure } from './format';
import type { History } from './history';
import { totals } from './history';
import { LinePlot, PlotLegend } from './line-plot';
import type { PlotMark } from './plot-svg';
import { PlotTable } from './plot-table';

const PLOT_HEIGHT = 144;
/** Space above a plot for the names of the levels, CSS pixels. */
const MARK_HEIGHT = 16;
export interface Curve extends PlotLine {
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

/** Kinds of marks in the plots: the name of their class, their colour and their meaning. */
const KEYS = [
  { name: 'level', color: '--line-strong', label: text('measures.levelChange') },
  { name: 'axial', color: '--join', label: text('measures.axialEvent') },
  { name: 'annular', color: '--cut', label: text('measures.annularEvent') },
  { name: 'vanished', color: '--vanished', label: text('measures.vanishedEvent') },
  { name: 'seeds', color: '--seed', label: text('measures.seededEvent') },
];

type Columns = (number | null)[][];

/** One of the plots of a run, as it is shown. */
class PlotState {
  readonly kind: PlotKind;
  readonly shown = signal<{ columns: Columns; marks: PlotMark[]; caption: string }>({
    ...{ columns: [], marks: [], caption: '' },
  });
  /** Plotted data: iterations, followed by the values of each curve, for the reports of the current run so far. */
  #columns: Columns;
  #run: readonly StepReport[] | undefined;

  constructor(kind: PlotKind) {
    this.kind = kind;
    this.#columns = this.#none();
    this.shown.value = { columns: this.#columns, marks: [], caption: '' };
  }

  update(history: History): void {
    const { reports } = history;
    this.#extend(reports);
    const caption = reports.length > 0 ? this.kind.describe(history) : text('measures.noSteps');
    // A new list, so that the plot is drawn again: its columns are appended to.
    this.shown.value = { columns: [...this.#columns], marks: marksOf(history), caption };
  }

  #none(): Columns {
    return [[], ...this.kind.curves.map(() => [])];
  }

  /** Appends the data of new reports only: runs have thousands of steps. */
  #extend(reports: readonly StepReport[]): void {
    const { curves, log } = this.kind;
    if (reports !== this.#run) this.#columns = this.#none();
    this.#run = reports;
    const [iterations = [], ...values] = this.#columns;
    for (const report of reports.slice(iterations.length)) {
      iterations.push(report.iteration);
      for (const [i, { of }] of curves.entries()) values[i]?.push(plottable(of(report), log));
    }
  }
}

/** Live plots of a run over its iterations, with level changes and topology events marked. */
export class Plots {
  readonly all: readonly PlotState[];
  /** Whether a legend and a description of the topology events are shown. */
  readonly hasEvents: boolean;
  readonly events = signal('');
  readonly run = signal<{ reports: readonly StepReport[] }>({ reports: [] });
  readonly #history: History;
  readonly #stale = new Set<PlotState>();
  #pending = 0;

  constructor(history: History, kinds: PlotKind[], hasEvents: boolean) {
    this.#history = history;
    this.all = kinds.map((kind) => new PlotState(kind));
    this.hasEvents = hasEvents;
  }

  /** Redraws the plots in the next animation frames, one plot in each: all at once would delay other rendering. */
  update(): void {
    for (const plot of this.all) this.#stale.add(plot);
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
    this.events.value = describeEvents(this.#history);
    this.run.value = { reports: this.#history.reports };
  }
}

/** The plots of a run, and their data as a table. */
export function RunPlots({ plots }: { plots: Plots }) {
  const { all, hasEvents } = plots;
  return (
    <div class="plots">
      {all.map((plot) => (
        <RunPlot key={plot.kind.title} plot={plot} keys={hasEvents ? KEYS : KEYS.slice(0, 1)} />
      ))}
      {hasEvents && <PlotLegend keys={KEYS} />}
      {hasEvents && (
        <p class="help" data-plot-events="">
          {plots.events}
        </p>
      )}
      <PlotTable curves={all.flatMap(({ kind }) => kind.curves)} run={plots.run} />
    </div>
  );
}

function RunPlot({ plot, keys }: { plot: PlotState; keys: typeof KEYS }) {
  const { title, curves, log } = plot.kind;
  const { columns, marks, caption } = plot.shown.value;
  return (
    <LinePlot
      {...{ title, lines: curves, columns, marks, keys, height: PLOT_HEIGHT, top: MARK_HEIGHT }}
      across={text('measures.columnIteration')}
      x={{ range: iterationRange }}
      y={log ? { distr: 3, range: logRange } : { range: valueRange }}
      yAxis={{
        size: 52,
        values: (_, ticks) => ticks.map((tick) => tickLabel(tick, log)),
        // uPlot would omit the labels of some powers of ten.
        ...(log && { splits: decades, filter: (_: uPlot, ticks: number[]) => ticks }),
      }}
    >
      <figcaption>{caption}</figcaption>
    </LinePlot>
  );
}

/** Returns a value to plot, or null if it cannot be drawn: not finite or, on a logarithmic axis, zero or below. */
function plottable(value: number, log: boolean): number | null {
  return Number.isFinite(value) && (!log || value > 0) ? value : null;
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

/** Returns the marks of level changes, and of topology events with one lane per kind. */
function marksOf({ phases, changes }: History): PlotMark[] {
  const [level, ...events] = KEYS.map(({ color }) => color);
  return [
    ...phases.map(({ iteration: at, phase: name }) => ({ at, name, color: level ?? '' })),
    ...changes.flatMap(({ iteration: at, axial, annular, vanished, seeds }) =>
      [axial, annular, vanished, seeds].flatMap((count, lane) =>
        count > 0 ? [{ at, lane, color: events[lane] ?? '' }] : [],
      ),
    ),
  ];
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
