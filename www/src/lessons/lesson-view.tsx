import { useLayoutEffect, useRef } from 'preact/hooks';
import { useId } from '../kit/ui/id';
import { Button, Help } from '../kit/ui/parts';
import { text } from '../texts';
import type { Step } from './lesson';
import type { OpenLesson } from './open-lesson';
import { isComplete, type Progress } from './progress';
import { FoldedPart, Prose, StepPart } from './step';

/** An open lesson: its steps, the one that is shown, and the results. */
export function LessonView({ open }: { open: OpenLesson }) {
  const isFinished = open.done.value === open.lesson.steps.length;
  return (
    <div>
      <StepList open={open} />
      <p class="not-kept" role="alert">
        {!open.isKept.value && text('lessons.notKept')}
      </p>
      <StepView key={open.step.value.id} open={open} />
      <p class="lesson-finished" role="status">
        {isFinished && text('lessons.finished')}
      </p>
      <p class="visually-hidden" role="status">
        {open.news}
      </p>
      <Results open={open} />
    </div>
  );
}

function StepList({ open }: { open: OpenLesson }) {
  const progress = open.progress.value;
  return (
    <nav aria-label={text('lessons.steps')}>
      <ol class="lesson-steps">
        {open.lesson.steps.map((step, index) => (
          <li key={step.id}>
            <StepButton {...{ step, index, progress }} onGo={() => open.go(index)} />
          </li>
        ))}
      </ol>
    </nav>
  );
}

interface ButtonProps {
  step: Step;
  index: number;
  progress: Progress;
  onGo: () => void;
}

function StepButton({ step, index, progress, onGo }: ButtonProps) {
  const number = index + 1;
  const isDone = isComplete(step, progress);
  const label = text(isDone ? 'lessons.stepComplete' : 'lessons.stepOpen', { number, title: step.title });
  return (
    <Button
      {...{ title: label, 'aria-label': label, onClick: onGo }}
      aria-current={index === progress.step ? 'step' : undefined}
    >
      {isDone ? `${number} ✓` : number}
    </Button>
  );
}

function StepView({ open }: { open: OpenLesson }) {
  const { lesson } = open;
  const [step, index] = [open.step.value, open.progress.value.step];
  const heading = useRef<HTMLHeadingElement>(null);
  const visits = open.visits.value;
  useLayoutEffect(() => {
    if (visits > 0) heading.current?.focus();
  }, [visits]);
  const link = (name: 'lessons.back' | 'lessons.next', to: number) => (
    <Button disabled={!lesson.steps[to]} onClick={() => open.go(to)}>
      {text(name)}
    </Button>
  );
  return (
    <div class="lesson-step">
      {index === 0 && <Prose source={lesson.intro} lang={lesson.language} />}
      <h3 tabIndex={-1} lang={step.language} ref={heading}>
        {text('lessons.stepTitle', { number: index + 1, title: step.title })}
      </h3>
      <StepPart step={step} part="goal" inPanel />
      <StepPart step={step} part="do" inPanel />
      {step.open && <DoForMe address={step.open} />}
      <StepPart step={step} part="watch" inPanel />
      {step.check && (
        <StepPart step={step} part="check" inPanel isTicked={open.progress.value.ticks[step.id] !== undefined}>
          <Help>{open.now}</Help>
        </StepPart>
      )}
      {step.question && <Question open={open} step={step} />}
      <FoldedPart step={step} part="hint" />
      <FoldedPart step={step} part="explanation" />
      <div class="buttons">
        {link('lessons.back', index - 1)}
        {link('lessons.next', index + 1)}
      </div>
    </div>
  );
}

function DoForMe({ address }: { address: string }) {
  const id = useId();
  const act = () => {
    if (location.hash === `#${address}`) window.dispatchEvent(new HashChangeEvent('hashchange'));
    location.hash = address;
  };
  return (
    <div class="do-for-me">
      <Button aria-describedby={id} onClick={act}>
        {text('lessons.doForMe')}
      </Button>
      <p class="help" id={id}>
        {text('lessons.doForMeHelp')}
      </p>
    </div>
  );
}

/** The question of a step, with the verdict on the answer. */
function Question({ open, step }: { open: OpenLesson; step: Step }) {
  const id = useId();
  const feedback = useRef<HTMLParagraphElement>(null);
  const field = useRef<HTMLInputElement & HTMLTextAreaElement>(null);
  const { isRight = false, says = '' } = open.verdict.value ?? {};
  const isText = step.question === 'text';
  const { unit = undefined } = typeof step.question === 'object' ? step.question : {};
  const given = {
    ...{ 'aria-labelledby': id, ref: field, value: open.progress.value.answers[step.id] ?? '' },
    onChange: () => commit(),
  };
  const commit = () => open.answer(field.current?.value ?? '');
  const submit = (event: Event) => {
    event.preventDefault();
    commit();
    feedback.current?.scrollIntoView({ block: 'nearest' });
  };
  return (
    <StepPart step={step} part="question" inPanel id={id}>
      <form class="lesson-answer" onSubmit={submit}>
        {isText ? (
          <textarea rows={6} {...given} />
        ) : (
          <input type="text" inputMode="decimal" autoComplete="off" {...given} />
        )}
        {unit !== undefined && <span>{unit}</span>}
        <button type="submit">{text(isText ? 'lessons.keepAnswer' : 'lessons.checkAnswer')}</button>
      </form>
      <p class="help lesson-feedback" role="status" data-right={isRight ? '' : undefined} ref={feedback}>
        {says}
      </p>
    </StepPart>
  );
}

/** The controls below the steps: results, sheets, and a new start. */
function Results({ open }: { open: OpenLesson }) {
  const id = useId();
  const sheet = (view: string, label: string) => (
    <a class="link" href={sheetAddress(open.address, view)} target="_blank" rel="noopener opener">
      {label}
    </a>
  );
  const startAgain = () => {
    if (window.confirm(text('lessons.againConfirm'))) open.startAgain();
  };
  return (
    <details class="lesson-results">
      <summary>{text('lessons.results')}</summary>
      <Help>{text('lessons.progress', { done: open.done.value, steps: open.lesson.steps.length })}</Help>
      <div class="row stacked">
        <label for={id}>{text('lessons.name')}</label>
        <input
          {...{ type: 'text', id, autoComplete: 'name', value: open.progress.value.name }}
          onChange={({ currentTarget }) => open.rename(currentTarget.value)}
        />
      </div>
      <Button onClick={() => open.saveResults()}>{text('lessons.save')}</Button>
      <p class="help" role="status">
        {open.saved}
      </p>
      <p>
        {sheet('sheet', text('lessons.sheet'))} · {sheet('teacher', text('lessons.teacher'))}
      </p>
      <Button onClick={startAgain}>{text('lessons.again')}</Button>
      <Help>{text('lessons.againHelp')}</Help>
    </details>
  );
}

/** Returns the address of a lesson's sheet for students (`sheet`) or teachers (`teacher`). */
function sheetAddress(address: string, view: string): string {
  const url = new URL(location.href);
  url.hash = '';
  url.searchParams.set('lesson', address);
  url.searchParams.set('view', view);
  return url.href;
}
