import { h } from '../kit/dom';
import { LANGUAGE, text } from '../texts';
import { scaleOf } from './scale';
import type { Chart, Section } from './sections';
import { type Bar, type Figure, formatTarget, meetsTarget, type Target, verdict, withUnit } from './targets';

/**
 * Draws the section of one benchmark on the benchmark page: what was measured and how, its charts, and the same numbers
 * as tables.
 */
export function drawSection({ id, title, measured, command, notes, charts }: Section): HTMLElement {
  const list = notes.length > 0 ? [h('ul', { class: 'notes' }, ...notes.map((note) => h('li', {}, note)))] : [];
  return h(
    'section',
    { class: 'panel', id, 'data-bench': id, 'aria-labelledby': `${id}-title` },
    h('h2', { id: `${id}-title` }, title),
    h('p', {}, measured),
    h('p', {}, h('code', {}, command)),
    ...list,
    ...charts.map((chart) => drawChart(chart)),
    h('details', {}, h('summary', {}, text('bench.asTables')), ...charts.map((chart) => tableOf(title, chart))),
  );
}

/** Displayed labels of the verdicts: whether a measurement meets its target, or was not measured. */
export const VERDICTS = {
  met: text('bench.met'),
  'not met': text('bench.notMet'),
  'not measured': text('bench.notMeasured'),
};

const WORDS = { linear: '', log: text('bench.logarithmic'), ratio: text('bench.logarithmicRatio') };

function drawChart(chart: Chart): HTMLElement {
  const { title, unit, kind, figures } = chart;
  const values = figures.flatMap(({ bars, target }) => [...bars.map(({ value }) => value), target?.limit]);
  const scale = scaleOf(
    kind,
    values.filter((value) => value !== undefined),
  );
  const drawn: ChartLayout = { unit, ...scale };
  return h(
    'figure',
    { class: 'bench-chart' },
    h(
      'figcaption',
      {},
      h('h3', {}, title),
      ` ${unit === '×' ? text('bench.asRatio') : text('bench.inUnit', { unit })}${WORDS[kind]}`,
    ),
    ...figures.map((figure) => drawFigure(figure, drawn)),
    axis(drawn),
  );
}

interface ChartLayout {
  unit: string;
  at: (value: number) => number;
  base: number;
  ticks: number[];
}

function drawFigure(figure: Figure, drawn: ChartLayout): HTMLElement {
  const { name, target, bars } = figure;
  const verdictMarks = target ? [verdictMark(figure, formatTarget(target, drawn.unit))] : [];
  return h(
    'div',
    { class: 'bench-figure' },
    h('p', { class: 'bench-name' }, h('span', {}, name), ...verdictMarks),
    ...bars.map((bar) => drawBar(figure, bar, drawn)),
  );
}

function verdictMark(figure: Figure, target: string): HTMLElement {
  const found = verdict(figure);
  return h(
    'span',
    { class: 'verdict', 'data-verdict': found },
    text('bench.target', { target: target }),
    h('strong', {}, VERDICTS[found]),
  );
}

function drawBar(figure: Figure, bar: Bar, drawn: ChartLayout): HTMLElement {
  const { label, value, remark, skipped } = bar;
  const row = h('div', { class: 'bench-bar' }, h('span', { class: 'bench-label' }, label));
  if (value === undefined)
    row.append(h('span', { class: 'bench-skipped' }, text('bench.skipped', { reason: skipped ?? '' })));
  else {
    row.append(track(figure, bar, value, drawn), h('data', { value }, withUnit(value, drawn.unit)));
    if (remark) row.append(h('span', { class: 'bench-remark' }, remark));
  }
  return row;
}

/**
 * Draws the bar of a measured value, and a mark at the target if one applies to it; hidden from screen readers, since
 * the number beside the bar says the same.
 */
function track(figure: Figure, bar: Bar, value: number, { at, base }: ChartLayout): HTMLElement {
  const missed = meetsTarget(figure, bar) === false;
  const [from, to] = [Math.min(at(value), base), Math.max(at(value), base)];
  const filled = h('div', { class: missed ? 'bench-fill missed' : 'bench-fill' });
  // Set by script: the page's content security policy allows no inline style in the markup.
  filled.style.left = percent(from);
  filled.style.width = percent(to - from);
  const element = h('div', { class: 'bench-track', 'aria-hidden': true }, filled);
  const limit = limitFor(figure.target, bar);
  if (limit !== undefined) element.append(placed('bench-limit', at(limit)));
  return element;
}

/**
 * Returns the limit of a target if the target applies to the host of a bar, else undefined; a target for one host is
 * not shown on the others.
 */
function limitFor(target: Target | undefined, { label }: Bar): number | undefined {
  return target && (!target.host || label.startsWith(target.host)) ? target.limit : undefined;
}

const percent = (share: number) => `${(100 * share).toFixed(2)}%`;

function placed(kind: string, share: number, ...children: string[]): HTMLElement {
  const element = h('div', { class: kind }, ...children);
  element.style.left = percent(share);
  return element;
}

function axis({ ticks, at }: ChartLayout): HTMLElement {
  const label = (tick: number) => placed('bench-tick', at(tick), short(tick));
  return h('div', { class: 'bench-axis', 'aria-hidden': true }, h('div', {}, ...ticks.map(label)));
}

const short = (value: number) => new Intl.NumberFormat(LANGUAGE, { maximumSignificantDigits: 3 }).format(value);

/**
 * Creates the table with the numbers of a chart: a row per bar for a chart of kind `ratio`, else a row per measurement
 * with a column per host.
 */
function tableOf(section: string, chart: Chart): HTMLElement {
  const { title, kind } = chart;
  const [head, rows] = kind === 'ratio' ? listed(chart) : byHost(chart);
  return scrolling(
    // Charts of different sections have the same title.
    text('bench.chartTable', { section, title }),
    h(
      'table',
      { class: 'times bench-table' },
      h('caption', {}, title),
      h('thead', {}, h('tr', {}, ...head.map((text) => h('th', { scope: 'col' }, text)))),
      h('tbody', {}, ...rows.map((row) => rowOf(row))),
    ),
  );
}

/**
 * Wraps a table of the benchmark page, which may be wider than a phone, so that it scrolls by itself, also by keyboard.
 */
export function scrolling(label: string, table: HTMLElement): HTMLElement {
  return h('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, table);
}

export function rowOf([first = '', ...rest]: string[]): HTMLElement {
  return h('tr', {}, h('th', { scope: 'row' }, first), ...rest.map((text) => h('td', {}, text)));
}

type Table = [head: string[], rows: string[][]];

function byHost({ unit, figures }: Chart): Table {
  const hosts = [...new Set(figures.flatMap(({ bars }) => bars.map(({ label }) => label)))];
  const hasTargets = figures.some(({ target }) => target);
  const row = (figure: Figure) => [figure.name, ...hosts.map((host) => shownAt(figure, host, unit))];
  const targetCells = (figure: Figure) =>
    figure.target ? [formatTarget(figure.target, unit), VERDICTS[verdict(figure)]] : ['–', '–'];
  return [
    [
      text('bench.columnMeasured'),
      ...hosts,
      ...(hasTargets ? [text('bench.columnTarget'), text('bench.columnVerdict')] : []),
    ],
    figures.map((figure) => [...row(figure), ...(hasTargets ? targetCells(figure) : [])]),
  ];
}

function shownAt({ bars }: Figure, host: string, unit: string): string {
  const value = bars.find(({ label }) => label === host)?.value;
  return value === undefined ? '–' : withUnit(value, unit);
}

function listed({ unit, figures }: Chart): Table {
  const row = (name: string, { label, value, skipped, remark }: Bar) => [
    name,
    label,
    value === undefined ? text('bench.skippedShort') : withUnit(value, unit),
    remark ?? skipped ?? '',
  ];
  return [
    [
      text('bench.columnMeasured'),
      text('bench.columnCompared'),
      text('bench.columnRatio'),
      text('bench.columnResults'),
    ],
    figures.flatMap(({ name, bars }) => bars.map((bar) => row(name, bar))),
  ];
}
