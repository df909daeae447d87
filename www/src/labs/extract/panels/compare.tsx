import { signal } from '@preact/signals';
import { count, figure, levelSymbol } from '../../../kit/format';
import { Help, Scrolling } from '../../../kit/ui/parts';
import { begun, ended, IDLE, Task, type TaskState } from '../../../kit/ui/task';
import { text } from '../../../texts';
import type { ComparisonProgressEvent, ExtractionRun, Requests } from '../protocol';
import { addTimes, seconds, TIME_NOTE, TIME_ROWS, timeOf } from './times';

type Result = NonNullable<Requests['compare']['reply']>;

const NAMES = { direct: text('extractPanels.direct'), coarseToFine: text('extractPanels.coarseToFine') } as const;

/**
 * Comparison of two runs of the same extraction, directly on the volume and coarse to fine, as in tables 1 and 2 of
 * Lachaud and Montanvert.
 */
export class Comparison {
  readonly task = signal<TaskState>(IDLE);
  readonly result = signal<Result | undefined>(undefined);
  /** Whether there is a volume, so that a comparison can be started. */
  readonly isEnabled = signal(false);

  /** Removes the results of the last comparison. */
  clear(): void {
    this.result.value = undefined;
    this.task.value = IDLE;
  }

  begin(): void {
    this.result.value = undefined;
    this.task.value = begun(text('controls.comparing'));
  }

  /** Shows the progress of a comparison, without announcing it to screen readers. */
  showProgress({ run, report }: ComparisonProgressEvent): void {
    const progress = (run === 'direct' ? 0 : 1) + (Number.isFinite(report.progress) ? report.progress : 0);
    const cancel = text('extractPanels.compareCancel', { run: NAMES[run], iteration: count(report.iteration) });
    this.task.value = { ...this.task.peek(), progress, cancel };
  }

  reject(message: string): void {
    this.task.value = ended(message);
  }

  finish(result: Result | undefined): void {
    this.result.value = result;
    this.task.value = ended(result ? describe(result) : text('controls.cancelled'));
  }
}

interface CompareProps {
  of: Comparison;
  onStart: () => void;
  onCancel: () => void;
}

/** Panel that has the two runs made, and compares them. */
export function ComparePanel({ of, onStart, onCancel }: CompareProps) {
  const result = of.result.value;
  return (
    <div class="compare">
      <Help>{text('extractPanels.compareHelp')}</Help>
      <Task
        {...{ name: 'compare', task: of.task.value, max: 2, isEnabled: of.isEnabled.value, onStart, onCancel }}
        {...{ start: text('controls.compare'), progress: text('controls.comparisonProgress') }}
      />
      <div data-comparison={JSON.stringify(result ? summaries(result) : {})}>{result && <Tables {...result} />}</div>
    </div>
  );
}

function Tables({ direct, coarseToFine }: Result) {
  return (
    <>
      <Scrolling label={text('extractPanels.compareTimes')}>
        <RunTimes coarseToFine={coarseToFine} direct={direct} />
      </Scrolling>
      <Help>{TIME_NOTE}</Help>
      <Scrolling label={text('controls.compareResults')}>
        <Outcomes runs={[coarseToFine, direct]} />
      </Scrolling>
    </>
  );
}

/** Says how much faster one of the runs was, and how far their surfaces differ. */
function describe(result: Result): string {
  const factor = total(result.direct) / total(result.coarseToFine);
  const key = factor >= 1 ? 'extractPanels.compareFaster' : 'extractPanels.compareSlower';
  const times = factor >= 1 ? factor : 1 / factor;
  return text(key, { factor: figure(Number(times.toPrecision(2))), difference: difference(result) });
}

function difference({ direct, coarseToFine }: Result): string {
  if (direct.info.vertices === 0 || coarseToFine.info.vertices === 0) return text('extractPanels.compareVanished');
  const part = (key: 'area' | 'volume') => {
    const off = Math.abs(coarseToFine.info[key] / direct.info[key] - 1);
    return text('controls.percent', { value: (100 * off).toFixed(off < 0.1 ? 2 : 0) });
  };
  return text('extractPanels.compareDifference', { area: part('area'), volume: part('volume') });
}

function total(run: ExtractionRun): number {
  return timeOf(addTimes(run.byLevel.map(({ times }) => new Map(Object.entries(times)))));
}

/** The figures of both runs, for other programs. */
const summaries = ({ direct, coarseToFine }: Result) => ({
  direct: summary(direct),
  coarseToFine: summary(coarseToFine),
});

function summary(run: ExtractionRun) {
  const { vertices, components, genus, area, volume } = run.info;
  const { iteration: iterations, done } = run.report;
  return { levels: run.levels, iterations, done, milliseconds: total(run), vertices, components, genus, area, volume };
}

/**
 * Table of durations in seconds, for both runs of a comparison: rows T (topology), N (normals) and F (forces and
 * motion) as in the paper, the sum of all parts, and the number of iterations; a column per pyramid level and one for
 * the whole run.
 */
function RunTimes({ coarseToFine, direct }: Result) {
  const levels = coarseToFine.byLevel.map(({ level }) => level);
  return (
    <table class="times">
      <Heads titles={[text('extractPanels.timePart'), ...levels.map(levelSymbol), text('extractPanels.timeTotal')]} />
      <tbody>
        <RunRows {...{ name: text('extractPanels.coarseToFine'), run: coarseToFine, levels }} />
        <RunRows {...{ name: text('extractPanels.direct'), run: direct, levels }} />
      </tbody>
    </table>
  );
}

function Heads({ titles }: { titles: string[] }) {
  return (
    <thead>
      <tr>
        {titles.map((title) => (
          <th key={title} scope="col">
            {title}
          </th>
        ))}
      </tr>
    </thead>
  );
}

function RunRows({ name, run, levels }: { name: string; run: ExtractionRun; levels: number[] }) {
  const byLevel = new Map(run.byLevel.map(({ level, times }) => [level, new Map(Object.entries(times))]));
  const all = addTimes([...byLevel.values()]);
  const timesOf = (parts?: readonly string[]) => [
    ...levels.map((level) => {
      const times = byLevel.get(level);
      return times ? seconds(timeOf(times, parts)) : '';
    }),
    seconds(timeOf(all, parts)),
  ];
  const iterations = new Map(run.byLevel.map((level) => [level.level, level.iterations]));
  const steps = [...levels.map((level) => iterations.get(level)), run.report.iteration];
  return (
    <>
      <tr class="group">
        <th scope="rowgroup" colSpan={levels.length + 2}>
          {name}
        </th>
      </tr>
      {TIME_ROWS.map(({ letter, parts }) => (
        <Row key={letter} head={letter} cells={timesOf(parts)} />
      ))}
      <Row class="sum" head="=" cells={timesOf()} />
      <Row
        class="detail"
        head={text('extractPanels.timeSteps')}
        cells={steps.map((value) => (value === undefined ? '' : count(value)))}
      />
    </>
  );
}

function Row({ head, cells, ...props }: { head: string; cells: string[]; class?: string }) {
  return (
    <tr {...props}>
      <th scope="row">{head}</th>
      {cells.map((cell, column) => (
        <td key={column}>{cell}</td>
      ))}
    </tr>
  );
}

const OUTCOMES: [string, (run: ExtractionRun) => string][] = [
  [text('extractPanels.outcomeIterations'), ({ report }) => count(report.iteration)],
  [text('extractPanels.outcomeConverged'), ({ report }) => text(report.done ? 'controls.yes' : 'controls.no')],
  [text('controls.time'), (run) => text('controls.seconds', { value: seconds(total(run)) })],
  [text('measures.vertices'), ({ info }) => count(info.vertices)],
  [text('measures.components'), ({ info }) => count(info.components)],
  [text('measures.genus'), ({ info }) => count(info.genus)],
  [text('measures.area'), ({ info }) => figure(info.area)],
  [text('measures.volume'), ({ info }) => figure(info.volume)],
];

function Outcomes({ runs }: { runs: ExtractionRun[] }) {
  return (
    <table class="times">
      <Heads titles={[text('controls.measure'), text('extractPanels.coarseToFine'), text('extractPanels.direct')]} />
      <tbody>
        {OUTCOMES.map(([name, value]) => (
          <Row key={name} head={name} cells={runs.map(value)} />
        ))}
      </tbody>
    </table>
  );
}
