import { signal } from '@preact/signals';
import type { UncoveredRegion, Vec3 } from '../../../engine/protocol';
import { count, lengths, place } from '../../../kit/format';
import { COVERAGE_GUIDE } from '../../../kit/guides';
import { Button, Help } from '../../../kit/ui/parts';
import { begun, ended, IDLE, Task, type TaskState } from '../../../kit/ui/task';
import { plural, text } from '../../../texts';
import type { CoverageProgressEvent, MeasuredCoverage } from '../protocol';

/**
 * Largest number of uncovered regions listed in the panel and marked in the views; the sentence above the list counts
 * all.
 */
const MOST_PARTS = 20;

const KINDS: Record<UncoveredRegion['kind'], string> = {
  matter: text('extractPanels.missingObject'),
  cavity: text('extractPanels.missingCavity'),
};

export interface CoverageEvents {
  onStart: () => void;
  onCancel: () => void;
  onSeed: () => void;
  /** Called to show a position, in world coordinates, in the slices and to centre the 3D view on it. */
  onGoTo: (point: Vec3) => void;
  /** Called with the uncovered regions to mark in the views. */
  onMark: (parts: readonly UncoveredRegion[]) => void;
}

/** The share of the volume's iso-surface that the extracted surface covers, once it is measured. */
export class Coverage {
  readonly measured = signal<MeasuredCoverage | undefined>(undefined);
  readonly task = signal<TaskState>(IDLE);
  /** Whether there is a surface whose coverage can be measured. */
  readonly isEnabled = signal(false);
  /** Unit of length in the volume's world space, for areas; empty if unknown. */
  unit = '';
  /** Size of the volume, to which positions are rounded. */
  size = 0;
  readonly events: CoverageEvents;

  constructor(events: CoverageEvents) {
    this.events = events;
  }

  /** Removes the results of the last coverage measurement. */
  clear(): void {
    this.#show(undefined);
    this.task.value = IDLE;
  }

  begin(): void {
    this.#show(undefined);
    this.task.value = begun(text('controls.measuring'));
  }

  showProgress({ share }: CoverageProgressEvent): void {
    this.task.value = { ...this.task.peek(), progress: share };
  }

  /** Shows a message beside the buttons and ends a measurement; results shown before are kept. */
  say(message: string): void {
    this.task.value = ended(message);
  }

  finish(coverage: MeasuredCoverage | undefined): void {
    if (coverage) this.#show(coverage);
    this.say(coverage ? describe(coverage) : text('controls.cancelled'));
  }

  #show(coverage: MeasuredCoverage | undefined): void {
    this.measured.value = coverage;
    this.events.onMark(listed(coverage));
  }
}

const listed = (coverage: MeasuredCoverage | undefined) => coverage?.uncovered.slice(0, MOST_PARTS) ?? [];

function describe({ iteration, uncovered }: MeasuredCoverage): string {
  const values = { iteration: count(iteration), listed: MOST_PARTS };
  if (uncovered.length === 0) return text('extractPanels.uncoveredNone', values);
  const key = uncovered.length <= MOST_PARTS ? 'extractPanels.uncoveredAll' : 'extractPanels.uncoveredMost';
  return plural(key, uncovered.length, values);
}

/** Panel that shows the coverage, and lists the regions that are not covered. */
export function CoveragePanel({ of }: { of: Coverage }) {
  const { onStart, onCancel, onSeed } = of.events;
  const measured = of.measured.value;
  const parts = listed(measured);
  const isEnabled = of.isEnabled.value;
  const seed = (
    <Button data-coverage-action="seed" disabled={!isEnabled} onClick={onSeed}>
      {text('extractPanels.seedMissing')}
    </Button>
  );
  return (
    <div class="coverage">
      <Help>
        {text('extractPanels.coverageHelp')}
        <a href={COVERAGE_GUIDE} target="_blank" rel="noopener">
          {text('extractPanels.coverageGuide')}
        </a>
      </Help>
      <Task
        {...{ name: 'coverage-action', task: of.task.value, isEnabled, onStart, onCancel, others: seed }}
        {...{ start: text('extractPanels.measureCoverage'), progress: text('controls.measurementProgress') }}
      />
      <dl class="facts" data-coverage={JSON.stringify(measured ?? {})}>
        {measured && <Shares {...measured} />}
      </dl>
      <ol class="uncovered" aria-label={text('extractPanels.uncoveredList')} hidden={parts.length === 0}>
        {parts.map((part, index) => (
          <Part key={index} of={of} {...part} />
        ))}
      </ol>
    </div>
  );
}

function Shares({ recall, precision }: MeasuredCoverage) {
  return (
    <>
      <div title={text('extractPanels.recallHelp')}>
        <dt>{text('extractPanels.recall')}</dt>
        <dd>{percent(recall)}</dd>
      </div>
      <div title={text('extractPanels.precisionHelp')}>
        <dt>{text('extractPanels.precision')}</dt>
        <dd>{percent(precision)}</dd>
      </div>
    </>
  );
}

function Part({ of, kind, area, position }: UncoveredRegion & { of: Coverage }) {
  const where = place(position, of.size);
  const size = lengths([Number(area.toPrecision(3))], of.unit, 2);
  const label = text('extractPanels.uncoveredShow', { kind: KINDS[kind], size, where });
  return (
    <li>
      <Button class="quiet" aria-label={label} onClick={() => of.events.onGoTo(position)}>
        <span class={`kind ${kind}`} aria-hidden="true" />
        <span>{KINDS[kind]}</span>
        <span class="area">{size}</span>
        <span class="where">{where}</span>
      </Button>
    </li>
  );
}

/** Formats a coverage, 0 to 1, in percent, rounded down to a tenth, so that 100 % means complete coverage. */
function percent(share: number): string {
  return text('controls.percent', { value: (Math.floor(share * 1000) / 10).toFixed(1) });
}
