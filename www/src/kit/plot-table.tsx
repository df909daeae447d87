import { type ReadonlySignal, useSignal } from '@preact/signals';
import type { StepReport } from '../engine/protocol';
import { text } from '../texts';
import { count, figure } from './format';
import type { Curve } from './plots';
import { Scrolling } from './ui/parts';

/** Largest number of iterations listed in the table: few enough to be read, or listened to. */
const ROWS = 12;

interface TableProps {
  curves: readonly Curve[];
  run: ReadonlySignal<{ reports: readonly StepReport[] }>;
}

/**
 * The curves of several plots as a table, at a few iterations from the first to the last; the accessible form of the
 * plots.
 */
export function PlotTable({ curves, run }: TableProps) {
  const isOpen = useSignal(false);
  return (
    <details
      onToggle={({ currentTarget }) => {
        isOpen.value = currentTarget.open;
      }}
    >
      <summary>{text('measures.plotTableSummary')}</summary>
      <Scrolling label={text('measures.plotTable')}>
        <table class="times" data-plot-table="">
          <thead>
            <tr>
              {[text('measures.columnIteration'), ...curves.map(({ label }) => label)].map((label, i) => (
                <th key={i} scope="col">
                  {label}
                </th>
              ))}
            </tr>
          </thead>
          {isOpen.value && <Rows {...{ curves, run }} />}
        </table>
      </Scrolling>
    </details>
  );
}

/** The rows are always the same elements, so that screen readers keep their position. */
function Rows({ curves, run }: TableProps) {
  const chosen = spread(run.value.reports);
  return (
    <tbody>
      {Array.from({ length: ROWS }, (_, i) => {
        const report = chosen[i];
        return (
          <tr key={i} hidden={!report}>
            <th scope="row">{report && count(report.iteration)}</th>
            {curves.map(({ of }, k) => (
              <td key={k}>{report && figure(of(report))}</td>
            ))}
          </tr>
        );
      })}
    </tbody>
  );
}

/** Returns at most `ROWS` reports, evenly spaced, including the first and the last. */
function spread(reports: readonly StepReport[]): StepReport[] {
  const { length } = reports;
  if (length <= ROWS) return [...reports];
  return Array.from({ length: ROWS }, (_, i) => reports[Math.round((i * (length - 1)) / (ROWS - 1))]).filter(
    (report) => report !== undefined,
  );
}
