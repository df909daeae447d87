import type { ReadonlySignal } from '@preact/signals';
import type { StepReport } from '../../../engine/protocol';
import { milliseconds } from '../../../kit/format';
import type { History } from '../../../kit/history';
import { text } from '../../../texts';

/** The phases of the implicit surface method, in order, by their names in step reports. */
const PHASES = [
  { name: 'subsample', text: text('pointPanels.phaseSubsample') },
  { name: 'constraints', text: text('pointPanels.phaseConstraints') },
  { name: 'solve', text: text('pointPanels.phaseSolve') },
  { name: 'extract', text: text('pointPanels.phaseExtract') },
  { name: 'colour', text: text('pointPanels.phaseColour') },
] as const;

/** Returns the name of a phase of the implicit surface method for messages; an unknown phase is returned as it is. */
export function phaseName(phase: string): string {
  return PHASES.find(({ name }) => name === phase)?.text ?? phase;
}

interface Phase {
  name: string;
  label: string;
  isOver: boolean;
  isNow: boolean;
  /** Progress, 0 to 1; undefined if it is unknown. */
  progress: number | undefined;
  /** Duration so far, milliseconds; undefined before the phase. */
  spent: number | undefined;
}

/** Returns the phases of a run, each with its progress and duration. `going`: whether the run is in progress. */
export function phasesOf(history: History, going: boolean): Phase[] {
  const last = history.reports.at(-1);
  const at = last ? PHASES.findIndex(({ name }) => name === last.phase) : -1;
  return PHASES.map(({ name, text: label }, i) => {
    const isOver = last !== undefined && (last.done || i < at);
    const isNow = i === at && !isOver;
    const progress = isOver ? 1 : isNow ? knownProgress(last?.progress ?? 0, going) : 0;
    const spent = history.times.get(name);
    return { name, label, isOver, isNow, progress, spent: spent && [...spent.values()].reduce((a, b) => a + b, 0) };
  });
}

/** Returns progress to show: unknown progress (NaN) is unknown while the run is in progress, and else one half. */
function knownProgress(part: number, going: boolean): number | undefined {
  if (Number.isFinite(part)) return part;
  return going ? undefined : 0.5;
}

/** List of the phases of the implicit surface method, each with its progress and duration. */
export function PhaseList({ phases }: { phases: ReadonlySignal<readonly Phase[]> }) {
  return (
    <ol class="phases">
      {phases.value.map(({ name, label, isOver, isNow, progress, spent }) => (
        <li
          key={name}
          class={[isOver && 'over', isNow && 'now'].filter(Boolean).join(' ')}
          {...{ 'data-phase': name, 'aria-current': isNow ? 'step' : undefined }}
        >
          <span>{label}</span>
          <span class="time">{spent === undefined ? '' : milliseconds(spent)}</span>
          {/* Without a value it is animated. */}
          <progress max={1} aria-label={label} value={progress} />
        </li>
      ))}
    </ol>
  );
}

/**
 * Returns the progress of a whole run of the implicit surface method, 0 to 1, with each phase weighted by its usual
 * fraction of the time.
 */
export function overallProgress({ phase, progress, done }: StepReport): number {
  if (done) return 1;
  const shares = [0.05, 0.1, 0.45, 0.35, 0.05];
  const at = PHASES.findIndex(({ name }) => name === phase);
  const before = shares.slice(0, at).reduce((a, b) => a + b, 0);
  return before + (shares[at] ?? 0) * (Number.isFinite(progress) ? progress : 0.5);
}
