/** An open lesson: one step at a time, with its condition tested against the lab. */
import { computed, signal } from '@preact/signals';
import { download } from '../kit/download';
import { plural, text } from '../texts';
import { type Check, holds, namesIn, unmetPart } from './check';
import { shownValue } from './format';
import type { Lesson, Step } from './lesson';
import { completeSteps, loadProgress, type Progress, recordsOf, saveProgress, type Tick, verdictOn } from './progress';
import { type LabReading, labelIn, labelOfExample, readLab, watchLab } from './reading';
import { resultsFile } from './results';

export class OpenLesson {
  readonly lesson: Lesson;
  /** Where the lesson comes from, for links to it. */
  readonly address: string;
  readonly progress;
  /** Number of times that the student has gone to a step. */
  readonly visits = signal(0);
  /** Whether the browser keeps the progress. */
  readonly isKept = signal(true);
  /** Announcement to screen readers. */
  readonly news = signal('');
  readonly saved = signal(text('lessons.saveHelp'));
  /** The step to whose question an empty answer was given. */
  readonly emptyAnswer = signal<string | undefined>(undefined);
  readonly #lab: HTMLElement;
  readonly #reading;
  readonly #closing = new AbortController();

  constructor(lesson: Lesson, lab: HTMLElement, address: string) {
    this.lesson = lesson;
    this.address = address;
    this.#lab = lab;
    this.progress = signal<Progress>(loadProgress(lesson.id));
    this.#reading = signal(readLab(lab));
    watchLab(lab, this.#closing.signal, () => this.#test());
    this.#test();
  }

  close(): void {
    this.#closing.abort();
  }

  /** The step that is shown. */
  readonly step = computed((): Step => {
    const { steps } = this.lesson;
    return steps[this.progress.value.step] ?? (steps[0] as Step);
  });

  /** Number of complete steps. */
  readonly done = computed(() => completeSteps(this.lesson, this.progress.value));

  /** The verdict on the answer to the step's question. */
  readonly verdict = computed(() =>
    this.emptyAnswer.value === this.step.value.id
      ? { isRight: false, says: text('lessons.empty') }
      : verdictOn(this.step.value, this.progress.value),
  );

  /** Present values of what the step's condition is about, or those with which it was met. */
  readonly now = computed(() => {
    const { id, check } = this.step.value;
    if (!check) return '';
    const tick = this.progress.value.ticks[id];
    return tick ? this.#tickedText(check, tick) : this.#missing(check);
  });

  go(step: number): void {
    this.emptyAnswer.value = undefined;
    this.#save({ step });
    this.visits.value += 1;
    this.#test();
  }

  rename(name: string): void {
    this.#save({ name });
  }

  /** Takes the answer to the step's question. */
  answer(typed: string): void {
    const { id } = this.step.peek();
    this.#save({ answers: { ...this.progress.peek().answers, [id]: typed } });
    this.emptyAnswer.value = typed.trim() === '' ? id : undefined;
  }

  startAgain(): void {
    this.#save({ ticks: {}, answers: {} });
    this.go(0);
  }

  #save(changed: Partial<Progress>): void {
    this.progress.value = { ...this.progress.peek(), ...changed };
    this.isKept.value = saveProgress(this.lesson.id, this.progress.peek());
  }

  /** Tests the condition of the step that is shown, and ticks the step if it is true. */
  #test(): void {
    const reading = readLab(this.#lab);
    this.#reading.value = reading;
    const { id, check } = this.step.peek();
    const { ticks, step } = this.progress.peek();
    if (!check || ticks[id] || !holds(check, reading, recordsOf(this.progress.peek()))) return;
    const { measures, warnings } = reading;
    const known = warnings.length > 0 && { warnings };
    const tick: Tick = { at: new Date().toISOString(), link: location.href, measures, ...known };
    this.#save({ ticks: { ...ticks, [id]: tick } });
    this.news.value = text('lessons.tickedNews', { number: step + 1 });
  }

  #tickedText(check: Check, { measures }: Tick): string {
    // Those at the time of the tick, which the lab may have left since.
    return `${text('lessons.ticked')} ${this.#facts(check, { ...this.#reading.value, measures })}`.trim();
  }

  /** Returns why the step is not ticked yet: what is not open, or not done, and the values that are to change. */
  #missing(check: Check): string {
    const reading = this.#reading.value;
    const { lab, example, state } = unmetPart(check, reading, recordsOf(this.progress.value)) ?? {};
    const reason =
      (lab !== undefined && text('lessons.labNotOpen', { lab: nameOfLab(String(lab)) })) ||
      (example !== undefined && text('lessons.exampleNotOpen', { name: labelOfExample(this.#lab, String(example)) })) ||
      (state === 'done' && text('lessons.notDone'));
    const isElsewhere = lab !== undefined || example !== undefined;
    return [text('lessons.unticked'), reason, !isElsewhere && this.#facts(check, reading)].filter(Boolean).join(' ');
  }

  #facts(check: Check, { measures, params }: LabReading): string {
    const facts = namesIn(check).map(({ kind, name }) => {
      const value = (kind === 'measure' ? measures : params)[name];
      return text('lessons.fact', { name: labelIn(this.#lab, kind, name), value: shownValue(value) });
    });
    return [...new Set(facts)].join(', ');
  }

  saveResults(): void {
    const progress = this.progress.peek();
    const file = resultsFile(this.lesson, progress, (name) => labelIn(this.#lab, 'measure', name));
    download(`${this.lesson.id}-results.html`, new TextEncoder().encode(file), 'text/html');
    this.saved.value = plural('lessons.saved', this.done.peek());
  }
}

const nameOfLab = (lab: string) => document.querySelector(`#labs [data-lab="${CSS.escape(lab)}"]`)?.textContent ?? lab;
