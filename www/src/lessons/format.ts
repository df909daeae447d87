import { text } from '../texts';
import { figure } from '../ui/format';
import type { Value } from './reading';

/** Formats a measured value, as the labs do; a dash if it is unknown. */
export function shownValue(value: Value | undefined): string {
  if (value === undefined) return '–';
  if (typeof value === 'boolean') return text(value ? 'controls.yes' : 'controls.no');
  return typeof value === 'number' ? figure(value) : value;
}
