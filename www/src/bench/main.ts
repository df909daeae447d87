import { text, textNodes } from '../texts';
import '../kit/style.css';
import './bench.css';
import json from '../../../bench.json';
import { h } from '../kit/dom';
import { LAB_IDS } from '../lab/address';
import { drawSection, rowOf, scrolling, VERDICTS } from './draw';
import type { Report } from './report';
import { type Chart, type Section, sectionsOf } from './sections';
import { type Figure, formatTarget, verdict, withUnit } from './targets';

const report = json as unknown as Report;

interface Targeted {
  chart: Chart;
  figure: Figure;
}

function targetsIn({ charts }: Section): Targeted[] {
  return charts.flatMap((chart) => chart.figures.filter(({ target }) => target).map((figure) => ({ chart, figure })));
}

/**
 * Creates the table of all measurements with a target: each measurement, the verdict, the target, and the worst value.
 */
function summary(sections: Section[]): HTMLElement {
  const targets = sections.flatMap(targetsIn);
  const met = targets.filter(({ figure }) => verdict(figure) === 'met').length;
  const heads = [
    text('bench.columnMeasured'),
    text('bench.columnVerdict'),
    text('bench.columnTarget'),
    text('bench.columnWorst'),
  ].map((text) => h('th', { scope: 'col' }, text));
  return h(
    'section',
    { class: 'panel', id: 'summary' },
    h('h2', {}, text('bench.targetsMet', { met, targets: targets.length })),
    scrolling(
      text('bench.summary'),
      h(
        'table',
        { class: 'times bench-table summary' },
        h('thead', {}, h('tr', {}, ...heads)),
        ...sections.filter((section) => targetsIn(section).length > 0).map((section) => group(section)),
      ),
    ),
  );
}

function group(section: Section): HTMLElement {
  const link = h('a', { href: `#${section.id}` }, section.title);
  const head = h('tr', { class: 'group' }, h('th', { scope: 'rowgroup', colspan: 4 }, link));
  return h('tbody', {}, head, ...targetsIn(section).map((targeted) => summaryRow(targeted)));
}

function summaryRow({ chart, figure }: Targeted): HTMLElement {
  const { name, target } = figure;
  const outcome = verdict(figure);
  const row = rowOf([
    name,
    VERDICTS[outcome],
    target ? formatTarget(target, chart.unit) : '',
    worstValue(figure, chart.unit),
  ]);
  row.dataset.verdict = outcome;
  return row;
}

/**
 * Returns the worst value among the bars to which the target applies (the largest, or the smallest if the target is a
 * least value), with the name of its host; a dash if none was measured.
 */
function worstValue({ bars, target }: Figure, unit: string): string {
  const sign = target?.sense === 'least' ? -1 : 1;
  const judged = bars.filter(({ label, value }) => value !== undefined && label.startsWith(target?.host ?? ''));
  const [worst] = judged.sort((one, other) => sign * ((other.value ?? 0) - (one.value ?? 0)));
  return worst?.value === undefined ? '–' : `${withUnit(worst.value, unit)} ${worst.label.replace(/ .*/, '')}`;
}

const hostsOf = ({ points, head }: Report) => (points ?? head ?? []).map(({ host }) => host);

/** Fills the header of the benchmark page: its name, the links to the labs, and what it shows. */
function fillHeader(): void {
  const fill = (id: string, ...children: (Node | string)[]) => document.getElementById(id)?.append(...children);
  const links = LAB_IDS.map((id) => h('a', { href: `./index.html#${id}` }, text(`shell.${id}`)));
  fill('page-name', text('bench.pageName'));
  fill('labs', ...links);
  document.getElementById('labs')?.setAttribute('aria-label', text('shell.labs'));
  fill('tagline', text('bench.tagline'));
}

fillHeader();
const root = document.getElementById('bench');
if (root) {
  const sections = sectionsOf(report);
  const machine = report.processor ? text('bench.processor', { processor: report.processor }) : '';
  const intro = textNodes('bench.intro', {
    machine,
    command: h('code', {}, 'npm run bench'),
    runs: String(report.bestOf),
    hosts: hostsOf(report).join(text('bench.and')),
  });
  root.append(
    h('p', { class: 'bench-intro' }, ...intro),
    summary(sections),
    ...sections.map((section) => drawSection(section)),
  );
  // Scrolls to the benchmark in the address, which was not drawn yet when the page was opened.
  document.getElementById(location.hash.slice(1))?.scrollIntoView();
}
