/** Values that the sessions of all labs consist of, within bounds: a session may come from anywhere. */
import {
  array,
  boolean,
  custom,
  finite,
  type GenericSchema,
  maxEntries,
  maxLength,
  maxValue,
  minValue,
  number,
  type ObjectSchema,
  type OptionalSchema,
  object,
  optional,
  picklist,
  pipe,
  record,
  safeInteger,
  strictTuple,
  string,
  transform,
  union,
  unknown,
} from 'valibot';
import { shortName } from '../../engine/labels';
import type { OptionsOf, ViewDeclaration, ViewOption } from '../../kit/view';

/** Most characters of a text that is shown as it is. */
const MOST_TEXT = 10_000;
/** Most entries of a list without a bound of its own. */
const MOST_ENTRIES = 100_000;
/** Largest coordinate, as of volumes and meshes: products of such numbers stay finite. */
const FARTHEST = 3.4e38;

/** A number that is neither NaN nor infinite. */
export const real = pipe(number(), finite());
/** Any number, also NaN. */
export const anyNumber = custom<number>((value) => typeof value === 'number');
export const flag = boolean();
/** An integer from 0. */
export const count = pipe(number(), safeInteger(), minValue(0));
/** Returns the schema of integers in a range. */
export const between = (low: number, high: number) => pipe(number(), safeInteger(), minValue(low), maxValue(high));
export const bytes = custom<Uint8Array>((value) => value instanceof Uint8Array);

const coordinate = pipe(number(), finite(), minValue(-FARTHEST), maxValue(FARTHEST));
export const vec3 = strictTuple([coordinate, coordinate, coordinate]);

/** A text of at most `most` characters. */
export const text = (most = MOST_TEXT) => pipe(string(), maxLength(most));
/** A name, cut if it is long. */
export const name = pipe(string(), transform(shortName));

/** A list of at most `most` items, which are not read if there are more. */
export const list = <const Item extends GenericSchema>(item: Item, most = MOST_ENTRIES) =>
  pipe(array(unknown()), maxLength(most), array(item));

/** Values by name, at most `most`. */
export const named = <const Value extends GenericSchema>(value: Value, most: number) =>
  pipe(record(text(100), value), maxEntries(most));

/** A value that may be missing, and is undefined then. */
export const maybe = <const Value extends GenericSchema>(value: Value) => optional(value, () => undefined);

/** One of the keys of `names`: all, as far as a type says so, else those that the lab takes. */
export const oneOf = <Name extends string>(names: Record<Name, true>) => picklist(Object.keys(names) as Name[]);

/** Values of a method's parameters. The worker tests names and values against the specification of the method. */
export const params = named(union([real, flag, text(200)]), 200);

type ValuesOf<Declared extends ViewDeclaration> = {
  [Name in keyof Declared]: OptionalSchema<GenericSchema<OptionsOf<Declared>[Name]>, OptionsOf<Declared>[Name]>;
};

/** The options of a lab's view; those that a session lacks, which were declared after it, have their initial values. */
export function viewOptions<Declared extends ViewDeclaration>(
  declared: Declared,
): ObjectSchema<ValuesOf<Declared>, undefined> {
  const entries = Object.entries(declared).map(([name, option]) => [name, optional(optionOf(option), option.initial)]);
  return object(Object.fromEntries(entries)) as ObjectSchema<ValuesOf<Declared>, undefined>;
}

function optionOf(option: ViewOption): GenericSchema<unknown> {
  if ('entries' in option) return picklist(Object.keys(option.entries));
  return 'step' in option ? pipe(number(), minValue(0), maxValue(1)) : flag;
}
