const [WIDTH, HEIGHT] = [640, 400];
/** Space around the curves, for the title and the names of marks above, and the legend below. */
const MARGIN = { left: 72, right: 20, top: 56, bottom: 72 };
/** Height of a row of the legend. */
const ROW = 20;
/** Height of the tick marks of one kind of event. */
const LANE = 8;

/** An axis of a plot; `ticks` are the values that are labelled. */
export interface PlotAxis {
  min: number;
  max: number;
  log?: boolean;
  ticks: { at: number; label: string }[];
}

/** A vertical line at the position `at` with a name above, or with `lane` a tick mark in that row above the x axis. */
export interface PlotMark {
  at: number;
  color: string;
  name?: string;
  lane?: number;
}

/** A plot, to be drawn as SVG; colours are in any notation of CSS. */
export interface PlotDrawing {
  title: string;
  /** Title of the x axis. */
  across: string;
  x: PlotAxis;
  y: PlotAxis;
  curves: {
    label: string;
    color: string;
    dash?: number[] | undefined;
    dots?: boolean | undefined;
    values: (number | null)[];
  }[];
  /** The x of each value of the curves. */
  positions: number[];
  marks: PlotMark[];
  /** Further entries of the legend. */
  keys: { label: string; color: string }[];
  colors: { background: string; text: string; lines: string };
}

/** Returns a plot as an SVG file. */
export function plotSvg(plot: PlotDrawing): string {
  const { title, colors, keys, curves } = plot;
  const shown = curves.filter(({ values }) => values.some((value) => value !== null));
  const [entries, height] = legend([...shown, ...keys]);
  const parts = [
    element('title', {}, escaped(title)),
    element('rect', { width: WIDTH, height, fill: colors.background }),
    label(title, { x: MARGIN.left, y: 22, 'font-size': 15, 'font-weight': 600 }),
    ...axes(plot),
    ...plot.marks.flatMap((mark) => markOf(plot, mark)),
    ...shown.flatMap((curve) => curveOf(plot, curve)),
    ...entries,
  ];
  const attributes = {
    xmlns: 'http://www.w3.org/2000/svg',
    viewBox: `0 0 ${WIDTH} ${height}`,
    'font-family': 'system-ui, sans-serif',
    'font-size': 12,
    fill: colors.text,
  };
  return `<?xml version="1.0" encoding="UTF-8"?>\n${element('svg', attributes, `\n${parts.join('\n')}\n`)}\n`;
}

function axes({ across, x, y, colors }: PlotDrawing): string[] {
  const [left, right, top, bottom] = [MARGIN.left, WIDTH - MARGIN.right, MARGIN.top, HEIGHT - MARGIN.bottom];
  const line = (from: [number, number], to: [number, number]) =>
    element('line', { x1: from[0], y1: from[1], x2: to[0], y2: to[1], stroke: colors.lines });
  const within = ({ min, max, ticks }: PlotAxis) => ticks.filter(({ at }) => at >= min && at <= max);
  return [
    ...within(x).flatMap(({ at, label: name }) => [
      line([xOf(x, at), top], [xOf(x, at), bottom]),
      label(name, { x: xOf(x, at), y: bottom + 16, 'text-anchor': 'middle' }),
    ]),
    ...within(y).flatMap(({ at, label: name }) => [
      line([left, yOf(y, at)], [right, yOf(y, at)]),
      label(name, { x: left - 8, y: round(yOf(y, at) + 4), 'text-anchor': 'end' }),
    ]),
    label(across, { x: (left + right) / 2, y: bottom + 34, 'text-anchor': 'middle' }),
  ];
}

function markOf({ x, colors }: PlotDrawing, { at, color, name, lane }: PlotMark): string[] {
  const bottom = HEIGHT - MARGIN.bottom;
  const [y1, y2] = lane === undefined ? [MARGIN.top, bottom] : [bottom - (lane + 1) * LANE, bottom - lane * LANE];
  const line = element('line', { x1: xOf(x, at), y1, x2: xOf(x, at), y2, stroke: color });
  return name ? [line, label(name, { x: xOf(x, at), y: MARGIN.top - 6, fill: colors.text })] : [line];
}

function curveOf(
  { x, y, positions }: PlotDrawing,
  { color, dash, dots, values }: PlotDrawing['curves'][number],
): string[] {
  const points = values.map((value, i) =>
    value === null ? undefined : ([xOf(x, positions[i] ?? 0), yOf(y, value)] as const),
  );
  // A missing value interrupts the curve.
  const path = points.map((point, i) => (point ? `${points[i - 1] ? 'L' : 'M'}${point.join(' ')}` : '')).join('');
  const line = element('path', {
    d: path,
    fill: 'none',
    stroke: color,
    'stroke-width': 2,
    'stroke-dasharray': dash?.join(' '),
  });
  const circles = points.flatMap((point) =>
    dots && point ? [element('circle', { cx: point[0], cy: point[1], r: 3, fill: color })] : [],
  );
  return [line, ...circles];
}

/** Returns the entries of the legend, and its height: entries are side by side, as far as they fit into a row. */
function legend(entries: { label: string; color: string; dash?: number[] | undefined }[]): [string[], number] {
  let [x, y] = [MARGIN.left, HEIGHT - 14];
  const parts = entries.flatMap(({ label: name, color, dash }) => {
    // The width of the text is estimated: the program that shows the file chooses the font.
    const width = 44 + 6.6 * name.length;
    if (x + width > WIDTH) [x, y] = [MARGIN.left, y + ROW];
    const stroke = { stroke: color, 'stroke-width': 2, 'stroke-dasharray': dash?.join(' ') };
    const line = element('line', { x1: x, y1: y, x2: round(x + 18), y2: y, ...stroke });
    const entry = [line, label(name, { x: round(x + 24), y: y + 4 })];
    x = round(x + width);
    return entry;
  });
  return [parts, y + 18];
}

const round = (value: number) => Number(value.toFixed(1));

/** Position of a value along an axis, 0 to 1. */
function fraction({ min, max, log }: PlotAxis, value: number): number {
  const scale = log ? Math.log : (x: number) => x;
  return (scale(value) - scale(min)) / (scale(max) - scale(min));
}

function xOf(axis: PlotAxis, value: number): number {
  return round(MARGIN.left + fraction(axis, value) * (WIDTH - MARGIN.left - MARGIN.right));
}

function yOf(axis: PlotAxis, value: number): number {
  return round(HEIGHT - MARGIN.bottom - fraction(axis, value) * (HEIGHT - MARGIN.top - MARGIN.bottom));
}

function label(content: string, attributes: Record<string, unknown>): string {
  return element('text', attributes, escaped(content));
}

function element(tag: string, attributes: Record<string, unknown>, content = ''): string {
  const given = Object.entries(attributes).filter(([, value]) => value !== undefined);
  const list = given.map(([name, value]) => ` ${name}="${escaped(String(value))}"`).join('');
  return content ? `<${tag}${list}>${content}</${tag}>` : `<${tag}${list}/>`;
}

function escaped(text: string): string {
  return text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;').replaceAll('"', '&quot;');
}
