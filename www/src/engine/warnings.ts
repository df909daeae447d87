/** Warnings of data and results, as the app's workers send them, and its pages show and keep them. */
import type { Warning } from 'vesicle';
import { text } from '../texts';

export type { Warning };

/** The part of the data that a warning concerns. */
export type Place = NonNullable<Warning['where']>;

/** Kinds of which there may be several that are not about the same. */
const SEVERAL: readonly string[] = ['reader', 'precision', 'parts'];

/** Returns a text that is equal for two warnings with the same kind and place. */
export function keyOf({ code, text: words, where }: Warning): string {
  return JSON.stringify([code, where, SEVERAL.includes(code) && words]);
}

/** Returns the warnings of several lists, each once: of those with the same kind and place, the first. */
export function merged(...lists: readonly (readonly Warning[])[]): Warning[] {
  const found = new Map<string, Warning>();
  for (const warning of lists.flat()) if (!found.has(keyOf(warning))) found.set(keyOf(warning), warning);
  return [...found.values()];
}

/** Returns the warnings that concern a frame or a label: all but those about others. */
export function concerning(warnings: readonly Warning[], place: { frame: number } | { label: number }): Warning[] {
  const [[kind, value] = []] = Object.entries(place);
  return warnings.filter(({ where }) => !where || !((kind as string) in where) || Object.values(where)[0] === value);
}

/** Describes the place of a warning in words, frames being counted from 1 as everywhere on the page. */
export function placeText(where: Place): string {
  if ('frame' in where) return text('warnings.frame', { frame: where.frame + 1 });
  if ('label' in where) return text('warnings.label', { label: where.label });
  return text('warnings.point', { point: where.point.map((x) => Number(x.toPrecision(5))).join(', ') });
}

/** Returns the codes and places of warnings for a cell of a CSV file, in English and without commas. */
export function cellOf(warnings: readonly Warning[]): string {
  const place = (where: Place) => {
    if ('frame' in where) return ` (frame ${where.frame + 1})`;
    return 'label' in where ? ` (label ${where.label})` : ` (point ${where.point.join(' ')})`;
  };
  return warnings.map(({ code, where }) => `${code}${where ? place(where) : ''}`).join('; ');
}
