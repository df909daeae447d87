import '../style.css';
import './bench.css';
import json from '../../../bench.json';
import { h } from '../ui/dom';
import { drawSection, rowOf, scrolling } from './draw';
import type { Report } from './report';
import { type Chart, type Section, sectionsOf } from './sections';
import { askedOf, type Figure, verdict, withUnit } from './targets';

const report = json as unknown as Report;

interface Asked {
  chart: Chart;
  figure: Figure;
}

function askedIn({ charts }: Section): Asked[] {
  return charts.flatMap((chart) => chart.figures.filter(({ target }) => target).map((figure) => ({ chart, figure })));
}

/** Summarises all measurements with a target and their results. */
function summary(sections: Section[]): HTMLElement {
  const asked = sections.flatMap(askedIn);
  const met = asked.filter(({ figure }) => verdict(figure) === 'met').length;
  const heads = ['Measured', 'Outcome', 'Asked', 'Found at worst'].map((text) => h('th', { scope: 'col' }, text));
  return h(
    'section',
    { class: 'panel', id: 'summary' },
    h('h2', {}, `${met} of ${asked.length} bounds kept`),
    scrolling(
      'Summary',
      h(
        'table',
        { class: 'times bench-table summary' },
        h('thead', {}, h('tr', {}, ...heads)),
        ...sections.filter((section) => askedIn(section).length > 0).map((section) => group(section)),
      ),
    ),
  );
}

function group(section: Section): HTMLElement {
  const link = h('a', { href: `#${section.id}` }, section.title);
  const head = h('tr', { class: 'group' }, h('th', { scope: 'rowgroup', colspan: 4 }, link));
  return h('tbody', {}, head, ...askedIn(section).map((asked) => summaryRow(asked)));
}

function summaryRow({ chart, figure }: Asked): HTMLElement {
  const { name, target } = figure;
  const outcome = verdict(figure);
  const row = rowOf([name, outcome, target ? askedOf(target, chart.unit) : '', foundIn(figure, chart.unit)]);
  row.dataset.verdict = outcome;
  return row;
}

/** Returns the value of the worst bar with a target. */
function foundIn({ bars, target }: Figure, unit: string): string {
  const sign = target?.sense === 'least' ? -1 : 1;
  const judged = bars.filter(({ label, value }) => value !== undefined && label.startsWith(target?.host ?? ''));
  const [worst] = judged.sort((one, other) => sign * ((other.value ?? 0) - (one.value ?? 0)));
  return worst?.value === undefined ? '–' : `${withUnit(worst.value, unit)} ${worst.label.replace(/ .*/, '')}`;
}

const hostsOf = ({ points, head }: Report) => (points ?? head ?? []).map(({ host }) => host);

const root = document.getElementById('bench');
if (root) {
  const sections = sectionsOf(report);
  const machine = report.processor ? ` on one core of ${report.processor}` : '';
  const intro = `Measured${machine} by \`npm run bench\`, the best of ${report.bestOf} runs where nothing else is said; in WebAssembly in ${hostsOf(report).join(' and ')}, and some natively, too. A line across a bar is the bound that was set; bars that do not keep to it are striped.`;
  const [before = '', command = '', after = ''] = intro.split('`');
  root.append(
    h('p', { class: 'bench-intro' }, before, h('code', {}, command), after),
    summary(sections),
    ...sections.map((section) => drawSection(section)),
  );
  // Scrolls to the benchmark in the address, which was not drawn yet when the page was opened.
  document.getElementById(location.hash.slice(1))?.scrollIntoView();
}
