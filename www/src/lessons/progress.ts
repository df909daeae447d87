/** Progress of a student in a lesson, kept by the browser. */

import { text } from '../texts';
import { operandValue, type Records } from './check';
import { judge, type Verdict } from './judge';
import type { Lesson, Step } from './lesson';
import type { Value } from './reading';

/** A step whose condition was true, with what the lab showed then. */
export interface Tick {
  at: string;
  /** Link to the state of the lab. */
  link: string;
  measures: Record<string, Value>;
  /** The warnings beside the measures, in words, if there were any. */
  warnings?: string[];
}

export interface Progress {
  /** Index of the step that is shown. */
  step: number;
  name: string;
  ticks: Record<string, Tick | undefined>;
  answers: Record<string, string | undefined>;
}

const key = (id: string) => `vesicle.lesson.${id}`;
const NEW: Progress = { step: 0, name: '', ticks: {}, answers: {} };

/** Returns the progress in a lesson; where the browser keeps nothing, or something unreadable, a new one. */
export function loadProgress(id: string): Progress {
  try {
    return { ...structuredClone(NEW), ...JSON.parse(localStorage.getItem(key(id)) ?? '{}') };
  } catch {
    return structuredClone(NEW);
  }
}

/**
 * Keeps the progress in a lesson; returns whether the browser does. If its storage is full, or not permitted, the progress
 * lasts as long as the page.
 */
export function saveProgress(id: string, progress: Progress): boolean {
  try {
    localStorage.setItem(key(id), JSON.stringify(progress));
    return true;
  } catch {
    return false;
  }
}

/** Returns the measures that were recorded with each ticked step. */
export function recordsOf({ ticks }: Progress): Records {
  return Object.fromEntries(Object.entries(ticks).map(([id, tick]) => [id, tick?.measures]));
}

/**
 * Returns the verdict on the answer to a step's question; undefined if there is no answer. Any text is right as an answer
 * in words.
 */
export function verdictOn({ id, question }: Step, progress: Progress): Verdict | undefined {
  const typed = progress.answers[id]?.trim() ?? '';
  if (!question || typed === '') return undefined;
  if (question === 'text') return { isRight: true, says: text('lessons.noted') };
  const value = operandValue(question.answer, recordsOf(progress));
  return judge(typed, { ...question, value: value === undefined ? undefined : Number(value) });
}

/** Tests whether there is no question, or its answer is right. */
export function isAnswered(step: Step, progress: Progress): boolean {
  return !step.question || verdictOn(step, progress)?.isRight === true;
}

/** Tests whether a step is complete: its condition was true, and its question is answered. */
export function isComplete(step: Step, progress: Progress): boolean {
  return (!step.check || progress.ticks[step.id] !== undefined) && isAnswered(step, progress);
}

/** Returns the number of complete steps. */
export function completeSteps({ steps }: Lesson, progress: Progress): number {
  return steps.filter((step) => isComplete(step, progress)).length;
}
