/** Judges answers to questions about a number, as a teacher would: by their value, and with what is wrong about them. */

import { figure } from '../kit/format';
import { text } from '../texts';
import { quantityFrom } from './numerals';
import { PLAIN, unitIn, unitNamed } from './units';

/** The expected answer: a number within a tolerance, in a unit, or else without one. */
export interface Expected {
  /** Undefined as long as it has not been measured. */
  value: number | undefined;
  within?: number;
  unit?: string;
}

export interface Verdict {
  isRight: boolean;
  /** The verdict in words. */
  says: string;
}

const wrong = (says: string): Verdict => ({ isRight: false, says });

/** Words that make one number of several, or another of it. */
const UNCLEAR = /^(or|and|to|not|per|each|times|minus|plus|oder|und|bis|nicht|pro|je|mal)$/i;
/** A word or a mark, but neither digits nor an operator. */
const WORD = /^[\p{L}\p{M}%‰°'’."“”„?×-]*\p{L}[\p{L}\p{M}'’."“”„?-]*$|^[.?%‰×]+$/u;

const isClear = (word: string) => WORD.test(word) && !UNCLEAR.test(word);

/** Judges an answer that is not empty. */
export function judge(typed: string, expected: Expected): Verdict {
  const quantity = quantityFrom(typed);
  if (!quantity) return wrong(text('lessons.notUnderstood'));
  const { values, words } = quantity;
  const { unit: given, others } = unitIn(words);
  if (!others.every(isClear)) return wrong(text('lessons.notUnderstood'));
  const { value, unit } = expected;
  if (value === undefined) return wrong(text('lessons.notMeasured'));
  const asked = (unit !== undefined && unitNamed(unit)) || PLAIN;
  const fits = given ? given.kind === asked.kind : unit === undefined || others.length === 0;
  // Nothing is nothing in any unit.
  const isNothing = value === 0 && values.includes(0);
  if (!fits && !isNothing) return unit ? wrong(text('lessons.unitWrong', { unit })) : wrong(text('lessons.noUnit'));
  const verdict = compared(values, fits && given ? given.factor / asked.factor : 1, { ...expected, value });
  // A number typed as it is shown here needs no note.
  return verdict.says === rightAs(typed.trim()) ? { isRight: true, says: text('lessons.right') } : verdict;
}

/** Compares numbers, times the factor of a conversion of units, with what is expected. */
function compared(numbers: number[], factor: number, expected: Expected & { value: number }): Verdict {
  const { value, within = 0, unit = '' } = expected;
  const values = numbers.map((one) => one * factor);
  const right = values.find((one) => isNear(one, value, within));
  if (right === undefined) return wrong(mistake(values, value, within));
  const isPlain = values.length === 1 && isNear(factor, 1, 0);
  return { isRight: true, says: isPlain ? text('lessons.right') : rightAs(`${figure(right)} ${unit}`.trim()) };
}

const rightAs = (value: string) => text('lessons.rightAs', { value });

/** Tests whether two numbers are equal within a tolerance, and what rounding in a conversion of units may add. */
const isNear = (found: number, expected: number, within: number) =>
  Math.abs(found - expected) <= within + 1e-9 * Math.abs(expected);

/** Other powers of ten by which an answer may be wrong than a hundred. */
const POWERS = [1, 3, 4, 5, 6, 9].flatMap((power) => [10 ** power, 10 ** -power]);

/** Returns what to say about an answer that is not right. */
function mistake(values: number[], expected: number, within: number): string {
  const isOff = (factor: number) => expected !== 0 && values.some((one) => isNear(one * factor, expected, within));
  if (isOff(-1)) return text('lessons.signWrong');
  if (isOff(100) || isOff(0.01)) return text('lessons.percentWrong');
  return text(POWERS.some(isOff) ? 'lessons.factorWrong' : 'lessons.wrong');
}
