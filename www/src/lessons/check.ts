/**
 * Conditions of a lesson's steps: data, not code, evaluated against what the open lab shows. docs/lessons.md describes
 * them to authors.
 */
import { text } from '../texts';
import type { LabReading, Value } from './reading';

/** A measure as recorded when an earlier step was ticked, times a factor if one is given. */
export interface Recorded {
  step: string;
  measure: string;
  times?: number;
}
export type Operand = Value | Recorded;

/** A condition as a lesson states it, once {@link checkProblem} has found nothing wrong with it. */
export type Check = { [name: string]: unknown };

/** Measures recorded when steps were ticked, by the id of the step. */
export type Records = Record<string, Record<string, Value> | undefined>;

const JOINTS = ['all', 'any', 'not'];
/** Subjects of a condition; lab, state and example are compared for equality. */
const SUBJECTS = ['lab', 'state', 'example', 'measure', 'param'];

const COMPARISONS: Record<string, (value: Value, operand: Value, within: number) => boolean> = {
  equals: (value, operand, within) =>
    typeof value === 'number' && typeof operand === 'number' ? Math.abs(value - operand) <= within : value === operand,
  above: (value, operand) => value > operand,
  below: (value, operand) => value < operand,
  atLeast: (value, operand) => value >= operand,
  atMost: (value, operand) => value <= operand,
};

const isObject = (value: unknown): value is Check =>
  typeof value === 'object' && value !== null && !Array.isArray(value);
const isValue = (value: unknown): value is Value => ['number', 'string', 'boolean'].includes(typeof value);

/** Returns what is wrong with a condition, undefined if nothing; `steps` are the ids of the steps before. */
export function checkProblem(check: unknown, steps: string[]): string | undefined {
  if (!isObject(check)) return text('lessons.checkNotObject', { found: JSON.stringify(check) ?? '' });
  const [joint] = JOINTS.filter((name) => name in check);
  if (joint === 'not') return checkProblem(check.not, steps);
  if (joint) return listProblem(check[joint], joint, steps);
  const [subject] = SUBJECTS.filter((name) => name in check);
  if (!subject)
    return text('lessons.checkUnknown', {
      found: Object.keys(check).join(),
      accepted: [...JOINTS, ...SUBJECTS].join(),
    });
  if (typeof check[subject] !== 'string') return text('lessons.checkNotText', { name: subject });
  return subject === 'measure' || subject === 'param' ? comparisonProblem(check, subject, steps) : undefined;
}

function listProblem(list: unknown, joint: string, steps: string[]): string | undefined {
  if (!Array.isArray(list) || list.length === 0) return text('lessons.checkNotList', { name: joint });
  return list.map((one) => checkProblem(one, steps)).find((problem) => problem !== undefined);
}

function comparisonProblem(check: Check, subject: string, steps: string[]): string | undefined {
  const { [subject]: _, within = 0, ...comparisons } = check;
  if (typeof within !== 'number' || !(within >= 0)) return text('lessons.operandInvalid');
  const unknown = Object.keys(comparisons).find((name) => !Object.hasOwn(COMPARISONS, name));
  const accepted = Object.keys(COMPARISONS).join();
  if (unknown || Object.keys(comparisons).length === 0)
    return text('lessons.comparisonUnknown', { found: unknown ?? '', accepted });
  return Object.values(comparisons)
    .map((operand) => operandProblem(operand, steps))
    .find((problem) => problem !== undefined);
}

/** Returns what is wrong with a value to compare with, undefined if nothing. */
export function operandProblem(operand: unknown, steps: string[]): string | undefined {
  if (isValue(operand)) return undefined;
  const { step, measure } = isObject(operand) ? operand : {};
  if (typeof step !== 'string' || typeof measure !== 'string') return text('lessons.operandInvalid');
  return steps.includes(step) ? undefined : text('lessons.operandStep', { step });
}

/** Returns the value to compare with; undefined if nothing is recorded for its step yet. */
export function operandValue(operand: Operand, records: Records): Value | undefined {
  if (isValue(operand)) return operand;
  const recorded = records[operand.step]?.[operand.measure];
  return typeof recorded === 'number' ? recorded * (operand.times ?? 1) : recorded;
}

/** Tests whether a condition is true. A measure or parameter that the lab does not show makes a comparison false. */
export function holds(check: Check, reading: LabReading, records: Records): boolean {
  if (check.not) return !holds(check.not as Check, reading, records);
  const list = (check.all ?? check.any) as Check[] | undefined;
  if (list) return list[check.all ? 'every' : 'some']((one) => holds(one, reading, records));
  for (const name of ['lab', 'state', 'example'] as const) if (name in check) return check[name] === reading[name];
  const value = 'measure' in check ? reading.measures[String(check.measure)] : reading.params[String(check.param)];
  const { within = 0 } = check;
  return Object.entries(COMPARISONS).every(([name, compare]) => {
    if (!(name in check)) return true;
    const operand = operandValue(check[name] as Operand, records);
    return value !== undefined && operand !== undefined && compare(value, operand, Number(within));
  });
}

/** Returns the first part of a condition that is not true; undefined if all of it is. */
export function unmetPart(check: Check, reading: LabReading, records: Records): Check | undefined {
  if (holds(check, reading, records)) return undefined;
  const parts = (check.all ?? []) as Check[];
  return parts.map((one) => unmetPart(one, reading, records)).find((one) => one !== undefined) ?? check;
}

/** Returns the names of the measures and parameters that a condition is about. */
export function namesIn(check: Check): { kind: 'measure' | 'param'; name: string }[] {
  const list = (check.all ?? check.any ?? (check.not ? [check.not] : undefined)) as Check[] | undefined;
  if (list) return list.flatMap(namesIn);
  return (['measure', 'param'] as const).flatMap((kind) =>
    kind in check ? [{ kind, name: String(check[kind]) }] : [],
  );
}
