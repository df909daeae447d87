/** A lesson as a page to print: for students, with room for answers, or for teachers, with the answers. */
import './lessons.css';
import { h } from '../kit/dom';
import { LANGUAGE, plural, text } from '../texts';
import { shownValue } from './format';
import { type Lesson, parseLesson, type Step } from './lesson';
import { loadProgress, type Progress } from './progress';
import { fetchLesson } from './sources';
import { partsOf, prose } from './step';

/** Shows the sheet of the lesson at `address` in place of the page's content. */
export async function showSheet(address: string, forTeachers: boolean): Promise<void> {
  const sheet = h('main', { class: 'lesson-sheet' });
  document.body.replaceChildren(sheet);
  try {
    const lesson = parseLesson(await fetchLesson(address, LANGUAGE), LANGUAGE);
    document.title = lesson.title;
    fill(sheet, lesson, forTeachers);
  } catch (error) {
    sheet.append(h('p', { role: 'alert' }, text('lessons.openFailed', { message: (error as Error).message })));
  }
}

function fill(sheet: HTMLElement, lesson: Lesson, forTeachers: boolean): void {
  const progress = loadProgress(lesson.id);
  const title = forTeachers ? text('lessons.teacherTitle', { title: lesson.title }) : lesson.title;
  sheet.append(
    h('h1', { lang: lesson.language }, title),
    h('button', { type: 'button', onclick: () => window.print() }, text('lessons.print')),
    h('p', { class: 'help' }, plural('lessons.minutes', lesson.minutes)),
    ...(forTeachers ? [] : [h('p', { class: 'line' }, `${text('lessons.name')}: ${progress.name}`)]),
    prose(lesson.intro, lesson.language),
    ...lesson.steps.map((step, index) =>
      h(
        'section',
        {},
        h('h2', {}, text('lessons.stepTitle', { number: index + 1, title: step.title })),
        ...(forTeachers ? teacherParts(step) : studentParts(step, progress)),
      ),
    ),
  );
}

function teacherParts(step: Step): HTMLElement[] {
  const { open, question } = step;
  const { answer = undefined, unit = '' } = typeof question === 'object' ? question : {};
  const expected = typeof answer === 'object' ? undefined : answer;
  return [
    ...Object.values(partsOf(step, 'teacher')),
    ...(expected === undefined
      ? []
      : [h('p', {}, text('lessons.expected', { value: `${shownValue(expected)} ${unit}`.trim() }))]),
    ...(open ? [h('p', {}, h('a', { class: 'link', href: `./#${open}` }, text('lessons.openState')))] : []),
  ];
}

function studentParts(step: Step, { ticks, answers }: Progress): HTMLElement[] {
  const { goal, do: act, watch, check, question } = partsOf(step, 'sheet');
  const ticked = ticks[step.id] !== undefined;
  check?.classList.add('lesson-check');
  check?.toggleAttribute('data-ticked', ticked);
  for (const words of ticks[step.id]?.warnings ?? []) check?.append(h('p', {}, `⚠ ${words}`));
  if (question) question.append(h('p', { class: 'room' }, answers[step.id] ?? ''));
  return [goal, act, watch, check, question].filter((part) => part !== undefined);
}
