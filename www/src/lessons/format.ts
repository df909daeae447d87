import { count, figure } from '../kit/format';
import { text } from '../texts';
import type { Value } from './reading';

/** Formats a measured value; whole numbers in full, and a dash for an unknown value. */
export function shownValue(value: Value | undefined): string {
  if (value === undefined) return '–';
  if (typeof value === 'boolean') return text(value ? 'controls.yes' : 'controls.no');
  if (typeof value === 'string') return value;
  // With the minus sign of the lessons' texts.
  return (Number.isInteger(value) ? count(value) : figure(value)).replace(/^-/, '−');
}
