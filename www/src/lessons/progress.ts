/** Progress of a student in a lesson, kept by the browser. */

import { operandValue, type Records } from './check';
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

/** A number with its digits in groups of three, and decimals with the other separator. */
const GROUPED = /^(-?\d{1,3}([.,])\d{3}(?:\2\d{3})*)(?:(?!\2)[.,](\d+))?$/;

/**
 * Returns the numbers that a student may mean, with a decimal point or comma, and a minus sign of either kind: the comma
 * of "15,540" begins decimals or groups digits.
 */
export function numbersFrom(typed: string): number[] {
  const plain = typed.replace('−', '-').replace(/[\s'’]/g, '');
  if (plain === '') return [];
  const [, whole, , decimals = '0'] = GROUPED.exec(plain) ?? [];
  const readings = [plain.replace(',', '.')];
  if (whole) readings.push(`${whole.replace(/[.,]/g, '')}.${decimals}`);
  return readings.map(Number).filter((one) => !Number.isNaN(one));
}

/** Tests whether the answer to a step's question is right; any text is right as an answer in words. */
export function isAnswered({ id, question }: Step, progress: Progress): boolean {
  const typed = progress.answers[id]?.trim() ?? '';
  if (!question || question === 'text') return !question || typed !== '';
  const expected = Number(operandValue(question.answer, recordsOf(progress)));
  const { within = 0 } = question;
  return numbersFrom(typed).some((number) => Math.abs(number - expected) <= within);
}

/** Tests whether a step is complete: its condition was true, and its question is answered. */
export function isComplete(step: Step, progress: Progress): boolean {
  return (!step.check || progress.ticks[step.id] !== undefined) && isAnswered(step, progress);
}

/** Returns the number of complete steps. */
export function completeSteps({ steps }: Lesson, progress: Progress): number {
  return steps.filter((step) => isComplete(step, progress)).length;
}
