/** The lessons' panel beside the labs: a list of lessons, or one that is open. */
import './lessons.css';
import { fileChooser } from '../importers/chooser';
import { acceptDropsOn } from '../importers/files';
import { h, uniqueId } from '../kit/dom';
import { LESSON_GUIDE } from '../kit/guides';
import { LANGUAGE, plural, text, textNodes } from '../texts';
import { type Lesson, parseLesson } from './lesson';
import { LessonView } from './lesson-view';
import { completeSteps, loadProgress } from './progress';
import { fetchLesson, filesIn, OPENED_FILES, ownLessons, readLessonFiles } from './sources';
import { prose } from './step';

/** Shows the list of lessons, and the open one, in `root`; its conditions are tested against the lab in `lab`. */
export class LessonPanel {
  readonly #lab: HTMLElement;
  readonly #body = h('div', { class: 'lesson-body' });
  readonly #title = h('h2', { tabindex: -1 });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #back = h('button', { type: 'button', onclick: () => void this.showList() }, text('lessons.all'));
  #view: LessonView | undefined;

  constructor(root: HTMLElement, lab: HTMLElement, onHide: () => void) {
    this.#lab = lab;
    const hide = h('button', { type: 'button', class: 'quiet', onclick: onHide }, text('lessons.hide'));
    root.replaceChildren(h('div', { class: 'lesson-head' }, this.#back, hide), this.#title, this.#error, this.#body);
    root.setAttribute('aria-label', text('lessons.title'));
    acceptDropsOn(root, (data) => void filesIn(data).then((files) => this.#openFiles(files)));
  }

  /** Opens the lesson at an address, as in the page's own address; `files` for one that was opened from files. */
  async open(address: string): Promise<void> {
    await this.#try(async () => {
      this.#show(parseLesson(await fetchLesson(address, LANGUAGE), LANGUAGE), address);
    });
    if (!this.#view) await this.showList();
  }

  /** Shows the list of all lessons, each with the student's progress. */
  async showList(): Promise<void> {
    this.#close();
    setLesson(undefined);
    this.#title.textContent = text('lessons.title');
    this.#title.lang = LANGUAGE;
    this.#back.hidden = true;
    const list = h('ul', { class: 'lesson-list' });
    const chooser = fileChooser(
      (files) => void this.#openFiles(files),
      '.json,.md,.zip',
      text('lessons.openFile'),
      'any',
    );
    this.#body.replaceChildren(
      h('p', {}, text('lessons.intro')),
      list,
      h('div', { class: 'row' }, chooser),
      h(
        'p',
        { class: 'help' },
        ...textNodes('lessons.openHelp', {
          guide: h('a', { class: 'link', href: LESSON_GUIDE, target: '_blank' }, text('lessons.guide')),
        }),
      ),
    );
    await this.#try(async () => {
      for (const id of await ownLessons())
        list.append(this.#entry(id, parseLesson(await fetchLesson(id, LANGUAGE), LANGUAGE)));
    }, this.#error.textContent !== '');
  }

  #entry(address: string, lesson: Lesson): HTMLElement {
    const done = completeSteps(lesson, loadProgress(lesson.id));
    const facts = [
      plural('lessons.minutes', lesson.minutes),
      text('lessons.progress', { done, steps: lesson.steps.length }),
    ];
    const open = h('button', { type: 'button', onclick: () => this.#choose(lesson, address) }, text('lessons.open'));
    const id = uniqueId('lesson');
    open.setAttribute('aria-labelledby', `${id}-open ${id}`);
    open.id = `${id}-open`;
    return h(
      'li',
      {},
      h('h3', { id, lang: lesson.language }, lesson.title),
      prose(lesson.intro.split('\n\n')[0] ?? '', lesson.language),
      h('p', { class: 'help' }, facts.join(' · ')),
      open,
    );
  }

  #show(lesson: Lesson, address: string): void {
    this.#close();
    this.#error.textContent = '';
    setLesson(address);
    this.#title.textContent = lesson.title;
    this.#title.lang = lesson.language;
    this.#back.hidden = false;
    this.#view = new LessonView(lesson, this.#lab, address);
    this.#body.replaceChildren(this.#view.element);
  }

  /** Shows a lesson at the user's request, with the focus on its title. */
  #choose(lesson: Lesson, address: string): void {
    this.#show(lesson, address);
    this.#title.focus();
  }

  #close(): void {
    this.#view?.close();
    this.#view = undefined;
  }

  async #openFiles(files: File[]): Promise<void> {
    await this.#try(async () => {
      const content = await readLessonFiles(files);
      const lesson = parseLesson(content, LANGUAGE);
      sessionStorage.setItem(OPENED_FILES, JSON.stringify(content));
      this.#choose(lesson, OPENED_FILES);
    });
  }

  /** Runs `work`; if it fails, says so above what is shown, which stays. An earlier message goes unless `keep`. */
  async #try(work: () => Promise<void>, keep = false): Promise<void> {
    if (!keep) this.#error.textContent = '';
    try {
      await work();
    } catch (error) {
      this.#error.textContent = text('lessons.openFailed', {
        message: error instanceof Error ? error.message : String(error),
      });
    }
  }
}

/** Names the open lesson in the page's address, so that a copied link opens it, too. */
function setLesson(address: string | undefined): void {
  const url = new URL(location.href);
  if (address) url.searchParams.set('lesson', address);
  else url.searchParams.delete('lesson');
  history.replaceState(history.state, '', url);
}
