/** A lesson as a page to print: for students, with room for answers, or for teachers, with the answers. */
import './lessons.css';
import { render } from 'preact';
import { Button } from '../kit/ui/parts';
import { LANGUAGE, plural, text } from '../texts';
import { shownValue } from './format';
import { type Lesson, PARTS, parseLesson, type Step } from './lesson';
import { loadProgress, type Progress } from './progress';
import { fetchLesson } from './sources';
import { Prose, StepPart } from './step';

/** Shows the sheet of the lesson at `address` in place of the page's content. */
export async function showSheet(address: string, forTeachers: boolean): Promise<void> {
  document.body.replaceChildren();
  render(<main class="lesson-sheet" />, document.body);
  try {
    const lesson = parseLesson(await fetchLesson(address, LANGUAGE), LANGUAGE);
    document.title = lesson.title;
    render(<Sheet lesson={lesson} forTeachers={forTeachers} />, document.body);
  } catch (error) {
    const message = text('lessons.openFailed', { message: (error as Error).message });
    render(
      <main class="lesson-sheet">
        <p role="alert">{message}</p>
      </main>,
      document.body,
    );
  }
}

function Sheet({ lesson, forTeachers }: { lesson: Lesson; forTeachers: boolean }) {
  const progress = loadProgress(lesson.id);
  return (
    <main class="lesson-sheet">
      <h1 lang={lesson.language}>
        {forTeachers ? text('lessons.teacherTitle', { title: lesson.title }) : lesson.title}
      </h1>
      <Button onClick={() => window.print()}>{text('lessons.print')}</Button>
      <p class="help">{plural('lessons.minutes', lesson.minutes)}</p>
      {!forTeachers && (
        <p class="line">
          {text('lessons.name')}: {progress.name}
        </p>
      )}
      <Prose source={lesson.intro} lang={lesson.language} />
      {lesson.steps.map((step, index) => (
        <section key={step.id}>
          <h2>{text('lessons.stepTitle', { number: index + 1, title: step.title })}</h2>
          {forTeachers ? <ForTeachers step={step} /> : <ForStudents step={step} progress={progress} />}
        </section>
      ))}
    </main>
  );
}

function ForTeachers({ step }: { step: Step }) {
  const { open, question } = step;
  const { answer = undefined, unit = '' } = typeof question === 'object' ? question : {};
  const expected = typeof answer === 'object' ? undefined : answer;
  return (
    <>
      {PARTS.map((part) => (
        <StepPart key={part} step={step} part={part} />
      ))}
      {expected !== undefined && <p>{text('lessons.expected', { value: `${shownValue(expected)} ${unit}`.trim() })}</p>}
      {open && (
        <p>
          <a class="link" href={`./#${open}`}>
            {text('lessons.openState')}
          </a>
        </p>
      )}
    </>
  );
}

function ForStudents({ step, progress: { ticks, answers } }: { step: Step; progress: Progress }) {
  const tick = ticks[step.id];
  return (
    <>
      <StepPart step={step} part="goal" />
      <StepPart step={step} part="do" />
      <StepPart step={step} part="watch" />
      <StepPart step={step} part="check" isTicked={tick !== undefined}>
        {tick?.warnings?.map((words) => (
          <p key={words}>⚠ {words}</p>
        ))}
      </StepPart>
      <StepPart step={step} part="question">
        <p class="room">{answers[step.id]}</p>
      </StepPart>
    </>
  );
}
