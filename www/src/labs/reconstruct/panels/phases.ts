import type { StepReport } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
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

/** List of the phases of the implicit surface method, each with its progress and duration. */
export class PhaseList {
  readonly element = h('ol', { class: 'phases' });
  readonly #rows: { item: HTMLElement; bar: HTMLProgressElement; time: HTMLElement }[];

  constructor() {
    this.#rows = PHASES.map(({ name, text }) => {
      const bar = h('progress', { max: 1, value: 0, 'aria-label': text });
      const time = h('span', { class: 'time' });
      const item = h('li', { 'data-phase': name }, h('span', {}, text), time, bar);
      return { item, bar, time };
    });
    this.element.append(...this.#rows.map(({ item }) => item));
  }

  /** Updates the list of phases after new step reports. `going`: whether the run is in progress. */
  update(history: History, going: boolean): void {
    const last = history.reports.at(-1);
    const at = last ? PHASES.findIndex(({ name }) => name === last.phase) : -1;
    for (const [i, { item, bar, time }] of this.#rows.entries()) {
      const phase = PHASES[i]?.name ?? '';
      const over = last !== undefined && (last.done || i < at);
      const now = i === at && !over;
      item.classList.toggle('over', over);
      item.classList.toggle('now', now);
      if (now) item.setAttribute('aria-current', 'step');
      else item.removeAttribute('aria-current');
      showBar(bar, over ? 1 : now ? (last?.progress ?? 0) : 0, now && going);
      const spent = history.times.get(phase);
      time.textContent = spent ? milliseconds([...spent.values()].reduce((a, b) => a + b, 0)) : '';
    }
  }
}

/**
 * Shows progress of a phase, 0 to 1; unknown progress (NaN) is animated while the run is in progress, and else shown as
 * one half.
 */
function showBar(bar: HTMLProgressElement, part: number, going: boolean): void {
  if (Number.isFinite(part)) bar.value = part;
  else if (going) bar.removeAttribute('value');
  else bar.value = 0.5;
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
