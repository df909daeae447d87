import { signal } from '@preact/signals';
import { count, figure, milliseconds } from '../../../kit/format';
import { useId } from '../../../kit/ui/id';
import { Help, Scrolling, Select } from '../../../kit/ui/parts';
import { begun, ended, IDLE, Task, type TaskState } from '../../../kit/ui/task';
import { text } from '../../../texts';
import { beatOf } from '../curve';
import type { Alternative, ComparedTrack, FrameStatistics, Preparation, SurfaceError } from '../protocol';

/** One of the two tracking runs of a comparison, in the form that the panel shows. */
export interface TrackingRun {
  name: string;
  facts: readonly FrameStatistics[];
  closing: number | undefined;
  error: SurfaceError | undefined;
  /** Duration of the run in milliseconds, if known. */
  duration: number | undefined;
}

type Runs = [TrackingRun, TrackingRun];

/** Comparison of the tracking run with a second one of the same image, in which one setting is another. */
export class TrackComparison {
  readonly task = signal<TaskState>(IDLE);
  readonly runs = signal<Runs | undefined>(undefined);
  /** Whether the current tracking run is finished, so that it can be compared with another. */
  readonly isEnabled = signal(false);
  /** The setting that is another in the second run. */
  readonly chosen = signal<Alternative>('prediction');
  /** The settings of the current run; what it has is not offered. */
  readonly present = signal<{ prediction: boolean; enrichment: Preparation['enrichment'] }>({
    ...{ prediction: true, enrichment: 'none' },
  });

  /** Updates the choice of alternative settings for the second run. */
  show(prediction: boolean, { enrichment }: Preparation): void {
    this.present.value = { prediction, enrichment };
    if (this.chosen.peek() === enrichment) this.chosen.value = 'prediction';
  }

  clear(): void {
    this.runs.value = undefined;
    this.task.value = IDLE;
  }

  begin(): void {
    this.runs.value = undefined;
    this.task.value = begun(text('controls.comparing'));
  }

  /** Shows the progress of the second run, 0 to 1, and its phase, without announcing them to screen readers. */
  showProgress(progress: number, phase: string): void {
    this.task.value = { ...this.task.peek(), progress, cancel: text('trackPanels.cancelPhase', { phase }) };
  }

  reject(message: string): void {
    this.task.value = ended(message);
  }

  finish(runs: Runs): void {
    this.runs.value = runs;
    this.task.value = ended(describeResult(runs));
  }
}

interface CompareProps {
  of: TrackComparison;
  onStart: (other: Alternative) => void;
  onCancel: () => void;
}

/** Panel that starts the second run, and compares the volume curves and measures of both. */
export function ComparePanel({ of, onStart, onCancel }: CompareProps) {
  const id = useId();
  const runs = of.runs.value;
  const { prediction, enrichment } = of.present.value;
  const choices: Record<Alternative, string> = {
    prediction: text(prediction ? 'trackPanels.withoutPrediction' : 'trackPanels.withPrediction'),
    none: text('trackPanels.otherNone'),
    linear: text('trackPanels.otherLinear'),
    flow: text('trackPanels.otherFlow'),
  };
  return (
    <div class="compare">
      <Help>{text('trackPanels.compareHelp')}</Help>
      <div class="row stacked">
        <label for={id}>{text('trackPanels.changedSetting')}</label>
        <Select
          {...{ id, choices, value: of.chosen.value, disabledChoices: [enrichment], 'data-compare': 'with' }}
          onChoose={(chosen) => {
            of.chosen.value = chosen;
          }}
        />
      </div>
      <Task
        {...{ name: 'compare', task: of.task.value, isEnabled: of.isEnabled.value, onCancel }}
        {...{ start: text('controls.compare'), progress: text('controls.comparisonProgress') }}
        onStart={() => onStart(of.chosen.peek())}
      />
      <div data-comparison={JSON.stringify(runs ? runs.map(summary) : {})}>{runs && <Measures runs={runs} />}</div>
    </div>
  );
}

/**
 * Returns the numbers in a run's column of the comparison table, also published as JSON in the element's
 * `data-comparison`.
 */
function summary({ name, facts, closing, error, duration }: TrackingRun) {
  const mean = (of: (one: FrameStatistics) => number) =>
    facts.reduce((sum, one) => sum + of(one), 0) / (facts.length || 1);
  const later = facts.slice(1);
  const rest = later.reduce((sum, { meanFinalCorrection }) => sum + meanFinalCorrection, 0) / (later.length || 1);
  const steps = later.reduce((sum, one) => sum + one.steps, 0) / (later.length || 1);
  const beat = beatOf(facts.map(({ volume }) => volume));
  return {
    name,
    ejection: beat?.ejection,
    diastole: beat?.largest,
    systole: beat?.smallest,
    rest,
    steps,
    folded: mean(({ folded, triangles }) => folded / (triangles || 1)),
    area: mean(({ area }) => area),
    closing,
    error: error?.mean,
    most: error?.p95,
    took: duration,
  };
}

export type Summary = ReturnType<typeof summary>;

function describeResult(runs: Runs): string {
  const [here, there] = runs.map(summary) as [Summary, Summary];
  const percent = (share: number | undefined) =>
    share === undefined ? '–' : text('controls.percent', { value: (100 * share).toFixed(1) });
  return text('trackPanels.compareTold', {
    first: percent(here.ejection),
    firstName: here.name,
    second: percent(there.ejection),
    secondName: there.name,
    firstSteps: figure(round(here.steps)),
    secondSteps: figure(round(there.steps)),
  });
}

const round = (value: number) => Number(value.toPrecision(3));

const size = (value: number | undefined) => (value === undefined ? '–' : figure(round(value)));

/** The rows of the table; those with `only` are shown only if it is known. */
const ROWS: { label: string; cell: (one: Summary) => string; only?: keyof Summary }[] = [
  { label: text('trackPanels.largestVolume'), cell: ({ diastole }) => size(diastole) },
  { label: text('trackPanels.smallestVolume'), cell: ({ systole }) => size(systole) },
  {
    label: text('trackPanels.ejectionFraction'),
    cell: ({ ejection }) =>
      ejection === undefined ? '–' : text('controls.percent', { value: (100 * ejection).toFixed(1) }),
  },
  { label: text('trackPanels.meanSteps'), cell: ({ steps }) => size(steps) },
  { label: text('trackPanels.meanFinalCorrection'), cell: ({ rest }) => size(rest) },
  {
    label: text('trackPanels.foldedShare'),
    cell: ({ folded }) => text('controls.percent', { value: (100 * folded).toFixed(2) }),
  },
  { label: text('measures.area'), cell: ({ area }) => size(area) },
  { label: text('trackPanels.cycleClosureError'), cell: ({ closing }) => size(closing), only: 'closing' },
  { label: text('trackPanels.meanError'), cell: ({ error }) => size(error), only: 'error' },
  { label: text('trackPanels.error95'), cell: ({ most }) => size(most), only: 'error' },
  { label: text('controls.time'), cell: ({ took }) => (took === undefined ? '–' : milliseconds(took)) },
];

function Measures({ runs }: { runs: Runs }) {
  const both = runs.map(summary);
  const rows = ROWS.filter(({ only }) => !only || both.some((one) => one[only] !== undefined));
  return (
    <Scrolling label={text('trackPanels.compareTable', { frames: count(runs[0].facts.length) })}>
      <table class="times">
        <thead>
          <tr>
            {[text('controls.measure'), ...runs.map(({ name }) => name)].map((title) => (
              <th key={title} scope="col">
                {title}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {rows.map(({ label, cell }) => (
            <tr key={label}>
              <th scope="row">{label}</th>
              {both.map((one, k) => (
                <td key={k}>{cell(one)}</td>
              ))}
            </tr>
          ))}
        </tbody>
      </table>
    </Scrolling>
  );
}

/** Converts the result of the comparison's second run to the form that the panel shows, under the name `name`. */
export function comparedRun(name: string, { facts, closing, error, duration }: ComparedTrack): TrackingRun {
  return { name, facts, closing, error, duration };
}
