/** The text of a lesson's step, for the panel and the sheet. */
import type { ComponentChildren } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { text } from '../texts';
import type { Part, Step } from './lesson';
import { renderMarkdown } from './markdown';

const TITLES: Record<Part, string> = {
  goal: text('lessons.goal'),
  do: text('lessons.do'),
  watch: text('lessons.watch'),
  check: text('lessons.check'),
  question: text('lessons.question'),
  hint: text('lessons.hint'),
  explanation: text('lessons.explanation'),
  answer: text('lessons.answer'),
};

/** A text in Markdown, which is in the given language. */
export function Prose({ source, lang, id }: { source: string; lang: string; id?: string }) {
  const element = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => {
    if (element.current) renderMarkdown(source, element.current);
  }, [source]);
  return <div class="prose" lang={lang} id={id} ref={element} />;
}

interface PartProps {
  step: Step;
  part: Part;
  /** Whether the part is in the panel, and not on a sheet. */
  inPanel?: boolean;
  /** Whether the condition of the step is known to be true; undefined for parts that are no condition. */
  isTicked?: boolean;
  /** Id of the text. */
  id?: string;
  /** Content below the text. */
  children?: ComponentChildren;
}

/** A part of a step, if the step has it. */
export function StepPart({ step, part, inPanel = false, isTicked, id, children }: PartProps) {
  const source = step.parts[part];
  if (!source) return null;
  const body = <Prose source={source} lang={step.language} {...(id && { id })} />;
  if (part === 'goal') return body;
  const Title = inPanel ? 'h4' : 'h3';
  const check = isTicked !== undefined && { class: 'lesson-check', 'data-ticked': isTicked ? '' : undefined };
  return (
    <div data-part={part} {...check}>
      <Title>{TITLES[part]}</Title>
      {body}
      {children}
    </div>
  );
}

/** A part of a step that is collapsed until the student opens it. */
export function FoldedPart({ step, part }: { step: Step; part: Part }) {
  const source = step.parts[part];
  if (!source) return null;
  return (
    <details data-part={part}>
      <summary>{TITLES[part]}</summary>
      <Prose source={source} lang={step.language} />
    </details>
  );
}
