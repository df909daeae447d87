import { signal } from '@preact/signals';
import { count } from '../../../kit/format';
import { type Change, type History, totals } from '../../../kit/history';
import { kept } from '../../../kit/ui/mount';
import { Help } from '../../../kit/ui/parts';
import { plural, text } from '../../../texts';

/** Largest number of entries of the event log; the totals above the list count all topology changes. */
const MOST_ENTRIES = 300;

interface Entry {
  iteration: number;
  kind: string;
  told: string;
}

/** The events of a run, newest first: level changes, joins, cuts, components that vanished or were seeded. */
export class EventLog {
  readonly entries = signal<readonly Entry[]>([]);
  readonly summary = signal(text('measures.noEvents'));
  #phases = 0;
  #changes = 0;

  clear(): void {
    this.#phases = 0;
    this.#changes = 0;
    this.entries.value = [];
    this.summary.value = text('measures.noEvents');
  }

  /** Adds entries for the events that the history has gained since the last call, at the top. */
  update(history: History): void {
    const fresh = [
      ...history.phases
        .slice(this.#phases)
        .map(({ iteration, phase }) => ({ iteration, kind: 'level', told: text('measures.phaseBegins', { phase }) })),
      ...history.changes
        .slice(this.#changes)
        .map((change) => ({ iteration: change.iteration, kind: kindOf(change), told: describe(change) })),
    ];
    if (fresh.length === 0) return;
    this.#phases = history.phases.length;
    this.#changes = history.changes.length;
    fresh.sort((a, b) => b.iteration - a.iteration);
    this.entries.value = [...fresh, ...this.entries.peek()].slice(0, MOST_ENTRIES);
    this.summary.value = totals(history.changes);
  }
}

/** Log of the events of a run. */
export function EventList({ log }: { log: EventLog }) {
  return (
    <div>
      <Help>{log.summary}</Help>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: it scrolls, also by keyboard. */}
      <ol class="log" tabIndex={0} aria-label={text('measures.eventsList')}>
        {log.entries.value.map((entry) => (
          <EntryRow key={`${entry.iteration} ${entry.kind}`} entry={entry} />
        ))}
      </ol>
    </div>
  );
}

const EntryRow = kept(({ entry: { iteration, kind, told } }: { entry: Entry }) => (
  <li>
    <span class="when">{count(iteration)}</span>
    <span class={`mark ${kind}`} aria-hidden="true" />
    {told}
  </li>
));

function kindOf(change: Change): string {
  return (['axial', 'annular', 'seeds', 'vanished'] as const).find((kind) => change[kind] > 0) ?? 'vanished';
}

export function describe({ axial, annular, vanished, seeds }: Change): string {
  const parts: string[] = [];
  if (axial > 0) parts.push(plural('measures.joins', axial));
  if (annular > 0) parts.push(plural('measures.cuts', annular));
  if (vanished > 0) parts.push(plural('measures.vanished', vanished));
  if (seeds > 0) parts.push(plural('measures.seeded', seeds));
  return parts.join(', ');
}
