/** The lessons' panel beside the labs: a list of lessons, or one that is open. */
import './lessons.css';
import { signal } from '@preact/signals';
import { render } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { FileChooser } from '../importers/chooser';
import { acceptDropsOn } from '../importers/files';
import { LESSON_GUIDE } from '../kit/guides';
import { useId } from '../kit/ui/id';
import { Button, Refusal } from '../kit/ui/parts';
import { LANGUAGE, plural, text, textNodes } from '../texts';
import { type Lesson, parseLesson } from './lesson';
import { LessonView } from './lesson-view';
import { OpenLesson } from './open-lesson';
import { completeSteps, loadProgress } from './progress';
import { fetchLesson, filesIn, OPENED_FILES, ownLessons, readLessonFiles } from './sources';
import { Prose } from './step';

/** Shows the list of lessons, and the open one, in `root`; its conditions are tested against the lab in `lab`. */
export class LessonPanel {
  readonly #lab: HTMLElement;
  /** The open lesson; undefined while the list is shown. */
  readonly current = signal<OpenLesson | undefined>(undefined);
  /** The lessons of the list. */
  readonly listed = signal<readonly { address: string; lesson: Lesson }[]>([]);
  readonly error = signal('');
  /** Number of lessons that the student has opened here, whose titles then have the focus. */
  readonly chosen = signal(0);

  constructor(root: HTMLElement, lab: HTMLElement, onHide: () => void) {
    this.#lab = lab;
    root.setAttribute('aria-label', text('lessons.title'));
    root.replaceChildren();
    render(<Panel panel={this} onHide={onHide} />, root);
    acceptDropsOn(root, (data) => void filesIn(data).then((files) => this.openFiles(files)));
  }

  /** Opens the lesson at an address, as in the page's own address; `files` for one that was opened from files. */
  async open(address: string): Promise<void> {
    await this.#try(async () => {
      this.#show(parseLesson(await fetchLesson(address, LANGUAGE), LANGUAGE), address);
    });
    if (!this.current.peek()) await this.showList();
  }

  /** Shows the list of all lessons, each with the student's progress. */
  async showList(): Promise<void> {
    this.current.peek()?.close();
    this.current.value = undefined;
    this.listed.value = [];
    setLesson(undefined);
    await this.#try(async () => {
      for (const address of await ownLessons()) {
        const lesson = parseLesson(await fetchLesson(address, LANGUAGE), LANGUAGE);
        this.listed.value = [...this.listed.peek(), { address, lesson }];
      }
    }, this.error.peek() !== '');
  }

  /** Shows a lesson at the user's request, with the focus on its title. */
  choose(lesson: Lesson, address: string): void {
    this.#show(lesson, address);
    this.chosen.value += 1;
  }

  async openFiles(files: File[]): Promise<void> {
    await this.#try(async () => {
      const content = await readLessonFiles(files);
      const lesson = parseLesson(content, LANGUAGE);
      sessionStorage.setItem(OPENED_FILES, JSON.stringify(content));
      this.choose(lesson, OPENED_FILES);
    });
  }

  #show(lesson: Lesson, address: string): void {
    this.current.peek()?.close();
    this.error.value = '';
    setLesson(address);
    this.current.value = new OpenLesson(lesson, this.#lab, address);
  }

  /** Runs `work`; if it fails, says so above what is shown, which stays. An earlier message goes unless `keep`. */
  async #try(work: () => Promise<void>, keep = false): Promise<void> {
    if (!keep) this.error.value = '';
    try {
      await work();
    } catch (error) {
      const message = error instanceof Error ? error.message : String(error);
      this.error.value = text('lessons.openFailed', { message });
    }
  }
}

function Panel({ panel, onHide }: { panel: LessonPanel; onHide: () => void }) {
  const open = panel.current.value;
  const title = useRef<HTMLHeadingElement>(null);
  const chosen = panel.chosen.value;
  useLayoutEffect(() => {
    if (chosen > 0) title.current?.focus();
  }, [chosen]);
  return (
    <>
      <div class="lesson-head">
        <Button hidden={!open} onClick={() => void panel.showList()}>
          {text('lessons.all')}
        </Button>
        <Button class="quiet" onClick={onHide}>
          {text('lessons.hide')}
        </Button>
      </div>
      <h2 tabIndex={-1} lang={open?.lesson.language ?? LANGUAGE} ref={title}>
        {open?.lesson.title ?? text('lessons.title')}
      </h2>
      <Refusal>{panel.error}</Refusal>
      <div class="lesson-body">{open ? <LessonView key={open.address} open={open} /> : <List panel={panel} />}</div>
    </>
  );
}

/** The list of all lessons. */
function List({ panel }: { panel: LessonPanel }) {
  const guide = (
    <a class="link" href={LESSON_GUIDE} target="_blank" rel="noopener">
      {text('lessons.guide')}
    </a>
  );
  return (
    <>
      <p>{text('lessons.intro')}</p>
      <ul class="lesson-list">
        {panel.listed.value.map(({ address, lesson }) => (
          <Entry key={address} lesson={lesson} onOpen={() => panel.choose(lesson, address)} />
        ))}
      </ul>
      <div class="row">
        <FileChooser
          onFiles={(files) => void panel.openFiles(files)}
          accept=".json,.md,.zip"
          label={text('lessons.openFile')}
          admission="any"
        />
      </div>
      <p class="help">{textNodes('lessons.openHelp', { guide })}</p>
    </>
  );
}

function Entry({ lesson, onOpen }: { lesson: Lesson; onOpen: () => void }) {
  const id = useId();
  const done = completeSteps(lesson, loadProgress(lesson.id));
  const facts = [
    plural('lessons.minutes', lesson.minutes),
    text('lessons.progress', { done, steps: lesson.steps.length }),
  ];
  return (
    <li>
      <h3 id={id} lang={lesson.language}>
        {lesson.title}
      </h3>
      <Prose source={lesson.intro.split('\n\n')[0] ?? ''} lang={lesson.language} />
      <p class="help">{facts.join(' · ')}</p>
      <Button id={`${id}-open`} aria-labelledby={`${id}-open ${id}`} onClick={onOpen}>
        {text('lessons.open')}
      </Button>
    </li>
  );
}

/** Names the open lesson in the page's address, so that a copied link opens it, too. */
function setLesson(address: string | undefined): void {
  const url = new URL(location.href);
  if (address) url.searchParams.set('lesson', address);
  else url.searchParams.delete('lesson');
  history.replaceState(history.state, '', url);
}
