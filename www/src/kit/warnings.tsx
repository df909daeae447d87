import { signal } from '@preact/signals';
import { keyOf, merged, type Place, placeText, type Warning } from '../engine/warnings';
import { legible, plural, text } from '../texts';
import { Button, Icon } from './ui/parts';

/** A triangle with an exclamation mark. */
const TRIANGLE = 'M12 2 1 21h22L12 2Zm-1 7h2v6h-2V9Zm0 8h2v2h-2v-2Z';
/** Number of warnings from which on the list may scroll, and can be reached by the keyboard to do so. */
const LONG = 4;
/** Most warnings that are listed; the number of the others is stated. */
const MOST_LISTED = 200;

/** Kinds that are about a result, and not about data. */
const OF_RESULTS: readonly string[] = [
  'begins-in-frame',
  'ends-in-frame',
  'handle-stopped',
  'handles',
  'inward-normals',
  'no-boundary',
  'self-intersecting',
  'outliers',
  'parts',
  'small-object',
  'thin-label',
  'thin-parts',
  'touches-box',
  'uneven-brightness',
  'volume-jump',
];

/** A report of a run, of which only the warnings matter. */
type Report = { warnings?: readonly Warning[] };

/** Actions of a click on the place of a warning, by the kind of place; others are shown as text. */
export interface PlaceActions {
  frame?: (frame: number) => void;
  label?: (label: number) => void;
  point?: (point: [number, number, number]) => void;
}

/** Warnings about the data and the result, each once. */
export class Warnings {
  readonly shown = signal<readonly Warning[]>([]);
  /** What is announced to screen readers: a warning once, when it appears. */
  readonly news = signal('');
  readonly actions = signal<PlaceActions>({});
  #data: readonly Warning[] = [];
  #report: Report | undefined;
  #restored: readonly Warning[] = [];

  get all(): readonly Warning[] {
    return this.shown.peek();
  }

  /** Shows the warnings of the data that are open. */
  showData(...lists: (readonly Warning[] | undefined)[]): void {
    this.#data = lists.flatMap((list) => list ?? []);
    this.#restored = [];
    this.#update();
  }

  /** Shows the warnings of the last report of a run; without one, none. May be called at every step, or more often. */
  showReport(report: Report | undefined): void {
    if (report === this.#report) return;
    this.#report = report;
    this.#restored = this.#restored.filter(({ code }) => !OF_RESULTS.includes(code));
    this.#update();
  }

  /** Shows the warnings of a session: those of results until there is another report, all until other data are open. */
  restore(warnings: readonly Warning[]): void {
    this.#restored = warnings;
    this.#update();
  }

  #update(): void {
    // Reports of older sessions have none.
    const warnings = merged(this.#data, this.#report?.warnings ?? [], this.#restored);
    const before = this.all;
    if (warnings.length + before.length === 0 || JSON.stringify(warnings) === JSON.stringify(before)) return;
    const known = new Set(before.map(keyOf));
    const found = warnings.filter((warning) => !known.has(keyOf(warning)));
    this.shown.value = warnings;
    // Only what is new: all of it at every change would be too much to listen to.
    const words = found.map(wordsOf).join(' ');
    this.news.value = found.length > 0 ? plural('warnings.news', found.length, { words }) : '';
  }
}

/** A list of warnings beside the measures of every lab, hidden while it is empty. */
export function WarningList({ warnings }: { warnings: Warnings }) {
  const shown = warnings.shown.value;
  const others = shown.length - MOST_LISTED;
  const isLong = shown.length > LONG;
  return (
    <div data-warning-list={JSON.stringify(shown.map(wordsOf))}>
      <div
        class="warnings"
        hidden={shown.length === 0}
        {...(isLong && { tabIndex: 0, role: 'region', 'aria-label': text('warnings.list') })}
      >
        <h3>
          <Icon path={TRIANGLE} />
          {plural('warnings.title', shown.length)}
        </h3>
        <ul>
          {shown.slice(0, MOST_LISTED).map((warning) => (
            <Item key={keyOf(warning)} warning={warning} actions={warnings.actions.value} />
          ))}
          {others > 0 && <li>{plural('warnings.more', others)}</li>}
        </ul>
      </div>
      <p class="visually-hidden" role="status">
        {warnings.news}
      </p>
    </div>
  );
}

function Item({ warning: { code, text: words, where }, actions }: { warning: Warning; actions: PlaceActions }) {
  return (
    <li data-code={code}>
      {where && <PlaceLink where={where} actions={actions} />}
      {where && ' '}
      {legible(words)}
    </li>
  );
}

/** The place of a warning in words, as a button if there is a way to go there. */
function PlaceLink({ where, actions }: { where: Place; actions: PlaceActions }) {
  const words = placeText(where);
  const go = goTo(where, actions);
  if (!go) return <b>{words}</b>;
  return (
    <Button class="place" title={text('warnings.goTo')} onClick={go}>
      {words}
    </Button>
  );
}

function goTo(where: Place, { frame, label, point }: PlaceActions): (() => void) | undefined {
  if ('frame' in where) return frame && (() => frame(where.frame));
  if ('label' in where) return label && (() => label(where.label));
  return point && (() => point(where.point));
}

function wordsOf({ text: words, where }: Warning): string {
  return where ? `${placeText(where)}: ${words}` : words;
}
