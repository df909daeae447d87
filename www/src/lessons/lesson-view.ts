/** An open lesson: one step at a time, with its condition tested against the lab. */

import { h, uniqueId } from '../kit/dom';
import { download } from '../kit/download';
import { plural, text } from '../texts';
import { type Check, holds, namesIn, unmetPart } from './check';
import { shownValue } from './format';
import type { Lesson, Step } from './lesson';
import {
  completeSteps,
  isComplete,
  loadProgress,
  type Progress,
  recordsOf,
  saveProgress,
  type Tick,
  verdictOn,
} from './progress';
import { type LabReading, labelIn, labelOfExample, readLab, watchLab } from './reading';
import { resultsFile } from './results';
import { partsOf, prose } from './step';

export class LessonView {
  readonly element: HTMLElement;
  readonly #lesson: Lesson;
  readonly #lab: HTMLElement;
  #progress: Progress;
  /** Says that the progress is not kept. */
  readonly #notKept = h('p', { class: 'not-kept', role: 'alert' });
  readonly #steps = h('ol', { class: 'lesson-steps' });
  readonly #body = h('div', { class: 'lesson-step' });
  readonly #news = h('p', { class: 'visually-hidden', role: 'status' });
  readonly #complete = h('p', { class: 'help' });
  readonly #finished = h('p', { class: 'lesson-finished', role: 'status' });
  readonly #saved = h('p', { class: 'help', role: 'status' }, text('lessons.saveHelp'));
  readonly #closing = new AbortController();
  /** Element with the present values of what the step's condition is about. */
  #now: HTMLElement | undefined;
  /** Shows the verdict on the answer to the step's question. */
  #judge: () => void = () => undefined;

  /** `address` is where the lesson comes from, for links to it. */
  constructor(lesson: Lesson, lab: HTMLElement, address: string) {
    this.#lesson = lesson;
    this.#lab = lab;
    this.#progress = loadProgress(lesson.id);
    const steps = h('nav', { 'aria-label': text('lessons.steps') }, this.#steps);
    this.element = h('div', {}, steps, this.#notKept, this.#body, this.#finished, this.#news, this.#results(address));
    watchLab(lab, this.#closing.signal, () => this.#test());
    this.#show();
  }

  close(): void {
    this.#closing.abort();
  }

  get #step(): Step {
    const { steps } = this.#lesson;
    return steps[this.#progress.step] ?? (steps[0] as Step);
  }

  #go(step: number): void {
    this.#progress.step = step;
    this.#save();
    this.#show();
    this.#body.querySelector('h3')?.focus();
  }

  #save(): void {
    const isKept = saveProgress(this.#lesson.id, this.#progress);
    this.#notKept.textContent = isKept ? '' : text('lessons.notKept');
    this.#showSteps();
  }

  #showSteps(): void {
    const { steps } = this.#lesson;
    this.#steps.replaceChildren(...steps.map((step, index) => h('li', {}, this.#stepButton(step, index))));
    const done = completeSteps(this.#lesson, this.#progress);
    const isFinished = done === steps.length;
    this.#complete.textContent = text('lessons.progress', { done, steps: steps.length });
    this.#finished.textContent = isFinished ? text('lessons.finished') : '';
  }

  #stepButton(step: Step, index: number): HTMLElement {
    const complete = isComplete(step, this.#progress);
    const label = text(complete ? 'lessons.stepComplete' : 'lessons.stepOpen', {
      number: index + 1,
      title: step.title,
    });
    const current = index === this.#progress.step && 'step';
    return h(
      'button',
      { type: 'button', title: label, 'aria-label': label, 'aria-current': current, onclick: () => this.#go(index) },
      complete ? `${index + 1} ✓` : String(index + 1),
    );
  }

  #show(): void {
    const step = this.#step;
    const index = this.#progress.step;
    const parts = partsOf(step, 'panel');
    const link = (name: 'lessons.back' | 'lessons.next', to: number) =>
      h('button', { type: 'button', disabled: !this.#lesson.steps[to], onclick: () => this.#go(to) }, text(name));
    this.#now = undefined;
    this.#judge = () => undefined;
    this.#body.replaceChildren(
      ...(index === 0 ? [prose(this.#lesson.intro, this.#lesson.language)] : []),
      h(
        'h3',
        { tabindex: -1, lang: step.language },
        text('lessons.stepTitle', { number: index + 1, title: step.title }),
      ),
      ...[parts.goal, parts.do, this.#doButton(step), parts.watch, this.#check(step, parts.check)].filter(isPresent),
      ...[parts.question && this.#question(step, parts.question), parts.hint, parts.explanation].filter(isPresent),
      h('div', { class: 'buttons' }, link('lessons.back', index - 1), link('lessons.next', index + 1)),
    );
    this.#showSteps();
    this.#test();
  }

  #doButton({ open }: Step): HTMLElement | undefined {
    if (!open) return undefined;
    const help = h('p', { class: 'help', id: uniqueId('do') }, text('lessons.doForMeHelp'));
    const act = () => {
      if (location.hash === `#${open}`) window.dispatchEvent(new HashChangeEvent('hashchange'));
      location.hash = open;
    };
    const button = h('button', { type: 'button', 'aria-describedby': help.id, onclick: act }, text('lessons.doForMe'));
    return h('div', { class: 'do-for-me' }, button, help);
  }

  #check({ id, check }: Step, part: HTMLElement | undefined): HTMLElement | undefined {
    if (!check || !part) return undefined;
    this.#now = h('p', { class: 'help' });
    part.classList.add('lesson-check');
    part.toggleAttribute('data-ticked', this.#progress.ticks[id] !== undefined);
    part.append(this.#now);
    return part;
  }

  /** Tests the condition of the step that is shown, and ticks the step if it is true. */
  #test(): void {
    const { id, check } = this.#step;
    if (!check) return;
    const reading = readLab(this.#lab);
    const tick = this.#progress.ticks[id];
    if (this.#now)
      this.#now.textContent = tick ? this.#tickedText(check, tick, reading) : this.#missing(check, reading);
    if (tick || !holds(check, reading, recordsOf(this.#progress))) return;
    const { measures, warnings } = reading;
    const known = warnings.length > 0 && { warnings };
    this.#progress.ticks[id] = { at: new Date().toISOString(), link: location.href, measures, ...known };
    this.#save();
    this.#body.querySelector('.lesson-check')?.toggleAttribute('data-ticked', true);
    this.#news.textContent = text('lessons.tickedNews', { number: this.#progress.step + 1 });
    // An answer may have waited for what was measured.
    this.#judge();
    this.#test();
  }

  #tickedText(check: Check, { measures }: Tick, reading: LabReading): string {
    // Those at the time of the tick, which the lab may have left since.
    return `${text('lessons.ticked')} ${this.#facts(check, { ...reading, measures })}`.trim();
  }

  /** Returns why the step is not ticked yet: what is not open, or not done, and the values that are to change. */
  #missing(check: Check, reading: LabReading): string {
    const { lab, example, state } = unmetPart(check, reading, recordsOf(this.#progress)) ?? {};
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

  #question(step: Step, part: HTMLElement): HTMLElement {
    const asked = part.querySelector<HTMLElement>('.prose') ?? part;
    asked.id = uniqueId('question');
    const feedback = h('p', { class: 'help lesson-feedback', role: 'status' });
    const attributes = { 'aria-labelledby': asked.id };
    const field =
      step.question === 'text'
        ? h('textarea', { rows: 6, ...attributes })
        : h('input', { type: 'text', inputmode: 'decimal', autocomplete: 'off', ...attributes });
    field.value = this.#progress.answers[step.id] ?? '';
    this.#judge = () => {
      const { isRight = false, says = '' } = verdictOn(step, this.#progress) ?? {};
      feedback.textContent = says;
      feedback.toggleAttribute('data-right', isRight);
    };
    const commit = () => {
      this.#progress.answers[step.id] = field.value;
      this.#save();
      this.#judge();
      if (field.value.trim() === '') feedback.textContent = text('lessons.empty');
    };
    field.addEventListener('change', commit);
    this.#judge();
    const label = text(step.question === 'text' ? 'lessons.keepAnswer' : 'lessons.checkAnswer');
    const { unit = undefined } = typeof step.question === 'object' ? step.question : {};
    const after = unit === undefined ? [] : [h('span', {}, unit)];
    const form = h('form', { class: 'lesson-answer' }, field, ...after, h('button', {}, label));
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      commit();
      feedback.scrollIntoView({ block: 'nearest' });
    });
    part.append(form, feedback);
    return part;
  }

  /** Returns the controls below the steps: results, sheets, and a new start. */
  #results(address: string): HTMLElement {
    const id = uniqueId('student');
    const name = h('input', { type: 'text', id, autocomplete: 'name' });
    name.value = this.#progress.name;
    name.addEventListener('change', () => {
      this.#progress.name = name.value;
      this.#save();
    });
    const sheet = (view: string, label: string) =>
      h('a', { class: 'link', href: sheetAddress(address, view), target: '_blank', rel: 'opener' }, label);
    return h(
      'details',
      { class: 'lesson-results' },
      h('summary', {}, text('lessons.results')),
      this.#complete,
      h('div', { class: 'row stacked' }, h('label', { for: id }, text('lessons.name')), name),
      h('button', { type: 'button', onclick: () => this.#saveResults() }, text('lessons.save')),
      this.#saved,
      h('p', {}, sheet('sheet', text('lessons.sheet')), ' · ', sheet('teacher', text('lessons.teacher'))),
      h('button', { type: 'button', onclick: () => this.#startAgain() }, text('lessons.again')),
      h('p', { class: 'help' }, text('lessons.againHelp')),
    );
  }

  #saveResults(): void {
    download(
      `${this.#lesson.id}-results.html`,
      new TextEncoder().encode(
        resultsFile(this.#lesson, this.#progress, (name) => labelIn(this.#lab, 'measure', name)),
      ),
      'text/html',
    );
    this.#saved.textContent = plural('lessons.saved', completeSteps(this.#lesson, this.#progress));
  }

  #startAgain(): void {
    if (!window.confirm(text('lessons.againConfirm'))) return;
    this.#progress = { step: 0, name: this.#progress.name, ticks: {}, answers: {} };
    this.#go(0);
  }
}

/** Returns the address of a lesson's sheet for students (`sheet`) or teachers (`teacher`). */
function sheetAddress(address: string, view: string): string {
  const url = new URL(location.href);
  url.hash = '';
  url.searchParams.set('lesson', address);
  url.searchParams.set('view', view);
  return url.href;
}

const nameOfLab = (lab: string) => document.querySelector(`#labs [data-lab="${CSS.escape(lab)}"]`)?.textContent ?? lab;

const isPresent = (element: HTMLElement | undefined): element is HTMLElement => element !== undefined;
