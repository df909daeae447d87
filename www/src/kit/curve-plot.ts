import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

import { LANGUAGE } from '../texts';
import { onSchemeChange, token } from './dom';
import { type PlotAxis, type PlotMark, plotSvg } from './plot-svg';

/** Height of the tick marks of one kind of event, CSS pixels. */
const MARK_LANE = 6;
/** Least width of a vertical axis, space beside its labels, and width of a digit in them, CSS pixels. */
const LEAST_AXIS = 40;
const LABEL_GAP = 14;
const DIGIT = 6.5;
const NUMBERS = new Intl.NumberFormat(LANGUAGE);

/** A curve of a plot; colours of plots are names of style tokens. */
export interface PlotLine {
  label: string;
  color: string;
  dash?: number[] | undefined;
  /** Whether each value is marked by a dot. */
  dots?: boolean;
}

/** Parts of a plot that may change; all others stay. */
export interface PlotContent {
  title: string;
  lines: readonly PlotLine[];
  /** The positions along x, then the values of each line; null interrupts a line. */
  columns: readonly (readonly (number | null)[])[];
  marks?: readonly PlotMark[];
  /** Entries of the legend of the saved plot besides the lines. */
  keys?: readonly PlotLine[];
}

export interface PlotParts extends PlotContent {
  /** Title of the x axis. */
  across: string;
  height: number;
  x: uPlot.Scale;
  y: uPlot.Scale;
  xAxis?: uPlot.Axis;
  yAxis: uPlot.Axis;
  /** Space above the plot for the names of marks, CSS pixels. */
  top?: number;
  /** Called with the position along x of a click. */
  onPick?: ((x: number) => void) | undefined;
}

/** Drawing of curves in an element. */
export class CurvePlot {
  readonly #parts: PlotParts;
  #content: PlotContent;
  readonly #plot: uPlot;
  /** Labelled values of the x and the y axis, as drawn last. */
  readonly #ticks: PlotAxis['ticks'][] = [[], []];
  readonly #size: ResizeObserver;
  readonly #ignoreScheme: () => void;

  constructor(holder: HTMLElement, parts: PlotParts) {
    this.#parts = parts;
    this.#content = parts;
    this.#plot = new uPlot(this.#options(), dataOf(parts), holder);
    this.#size = new ResizeObserver(() => {
      if (holder.clientWidth > 0) this.#plot.setSize({ width: holder.clientWidth, height: parts.height });
    });
    this.#size.observe(holder);
    this.#ignoreScheme = onSchemeChange(() => this.#plot.redraw());
    const { over } = this.#plot;
    over.addEventListener('click', ({ offsetX }) => parts.onPick?.(this.#plot.posToVal(offsetX, 'x')));
  }

  show(content: PlotContent): void {
    this.#content = content;
    this.#plot.setData(dataOf(content));
  }

  dispose(): void {
    this.#ignoreScheme();
    this.#size.disconnect();
    this.#plot.destroy();
  }

  /** Returns the plot as an SVG file, in the present colours. */
  toSvg(): string {
    const { lines, marks = [], keys = [], title } = this.#content;
    const colored = <T extends { color: string }>(one: T) => ({ ...one, color: token(one.color) });
    const [positions, ...columns] = this.#plot.data;
    return plotSvg({
      title,
      across: this.#parts.across,
      x: this.#axis('x', 0),
      y: this.#axis('y', 1),
      curves: lines.map((line, i) => ({
        ...colored(line),
        values: [...(columns[i] ?? [])].map((value) => value ?? null),
      })),
      positions: [...positions],
      marks: marks.map(colored),
      keys: keys.map(colored),
      colors: { background: token('--panel'), text: token('--text'), lines: token('--line') },
    });
  }

  #axis(scale: 'x' | 'y', index: 0 | 1): PlotAxis {
    const { min = 0, max = 1, distr } = this.#plot.scales[scale] ?? {};
    return { min: min ?? 0, max: max ?? 1, log: distr === 3, ticks: this.#ticks[index] ?? [] };
  }

  #options(): uPlot.Options {
    const { height, lines, x, y, xAxis = {}, yAxis, top = 8 } = this.#parts;
    const axis = (given: uPlot.Axis, index: 0 | 1): uPlot.Axis => ({
      stroke: () => token('--muted'),
      grid: { stroke: () => token('--line'), width: 1 },
      ticks: { show: false },
      font: '11px system-ui, sans-serif',
      ...given,
      values: (plot, splits, ...rest) => {
        const labels =
          typeof given.values === 'function'
            ? given.values(plot, splits, ...rest)
            : splits.map((at) => (at === null ? '' : NUMBERS.format(at)));
        this.#ticks[index] = splits.flatMap((at, i) => (at === null ? [] : [{ at, label: String(labels[i] ?? '') }]));
        return labels;
      },
    });
    return {
      width: 280,
      height,
      legend: { show: false },
      cursor: { y: false, drag: { x: false, y: false } },
      padding: [top, 12, 0, 0],
      scales: { x: { time: false, ...x }, y },
      axes: [axis({ size: 24, ...xAxis }, 0), axis(yAxis, 1)],
      series: [{}, ...lines.map(seriesFor)],
      hooks: { drawClear: [(plot) => drawMarks(plot, this.#content.marks ?? [])] },
    };
  }
}

const dataOf = ({ columns }: PlotContent) => columns as uPlot.AlignedData;

/** Returns the width of a vertical axis in which its labels have room, CSS pixels. */
export function roomFor(labels: readonly string[] | null): number {
  const longest = Math.max(0, ...(labels ?? []).map((label) => label.length));
  return Math.max(LEAST_AXIS, LABEL_GAP + DIGIT * longest);
}

function seriesFor({ label, color, dash, dots = false }: PlotLine): uPlot.Series {
  const points = { show: dots, size: 5 };
  return { label, stroke: () => token(color), width: 1.5, spanGaps: dots, points, ...(dash && { dash }) };
}

/** Draws lines with their names above, and tick marks at the bottom, one lane per kind, so that none hides another. */
function drawMarks({ ctx, bbox, valToPos }: uPlot, marks: readonly PlotMark[]): void {
  const [foot, lane] = [bbox.top + bbox.height, MARK_LANE * devicePixelRatio];
  ctx.save();
  ctx.font = `${10 * devicePixelRatio}px system-ui, sans-serif`;
  ctx.lineWidth = devicePixelRatio;
  ctx.fillStyle = token('--muted');
  ctx.textAlign = 'left';
  ctx.textBaseline = 'alphabetic';
  ctx.setLineDash([]);
  // Backwards, so that of overlapping names the later one is drawn.
  let free = Number.POSITIVE_INFINITY;
  for (const mark of [...marks].reverse()) {
    const x = Math.round(valToPos(mark.at, 'x', true));
    const ends = mark.lane === undefined ? [bbox.top, foot] : [foot - (mark.lane + 1) * lane, foot - mark.lane * lane];
    ctx.beginPath();
    for (const y of ends) ctx.lineTo(x, y);
    ctx.strokeStyle = token(mark.color);
    ctx.stroke();
    if (!mark.name) continue;
    const { width } = ctx.measureText(mark.name);
    const at = Math.min(x, bbox.left + bbox.width - width);
    if (at + width > free) continue;
    ctx.fillText(mark.name, at, bbox.top - 4 * devicePixelRatio);
    free = at - 4 * devicePixelRatio;
  }
  ctx.restore();
}
