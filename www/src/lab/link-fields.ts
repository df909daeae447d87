/**
 * The settings in links to a lab, as it declares them: how each is read from a text, and written. What a link has beyond them, or
 * what cannot be read, is named, so that the lab can say so.
 */
import type { ParamValues, Vec3 } from '../engine/protocol';
import type { OptionsOf, ViewDeclaration, ViewOption } from '../kit/view';
import { allIn, listOf, MOST_NAME, paramsIn, queryOf, readValue } from './link-query';

/** A setting in links. */
export interface Field<T> {
  /** Returns the value in a text; undefined if there is none. */
  read(text: string): T | undefined;
  write(value: T): string;
}

/** A setting that a link may have several times. */
export interface Repeated<T> extends Field<T> {
  /** How many times at most. */
  most: number;
}

/** Values of settings: lists of those that may be repeated. */
type Values<Fields> = {
  -readonly [Name in keyof Fields]?: Fields[Name] extends Repeated<infer T>
    ? T[]
    : Fields[Name] extends Field<infer T>
      ? T
      : never;
};

/** Settings in a link: those of the fields, the parameters of the method, and the options of the view. */
export type Linked<Fields, View extends ViewDeclaration> = Values<Fields> & {
  params: ParamValues;
  view: Partial<OptionsOf<View>>;
  /** Unknown settings, and those with an invalid value, as `name=text`. */
  unread?: string[];
};

/** A name, cut if it is long. */
export const name: Field<string> = { read: (text) => text.slice(0, MOST_NAME) || undefined, write: String };

/** A number; `suits` says whether it can be one. */
export const real = (suits: (value: number) => boolean = () => true): Field<number> => ({
  read: (text) => {
    const value = text === '' ? Number.NaN : Number(text);
    return Number.isFinite(value) && suits(value) ? value : undefined;
  },
  write: String,
});

/** An integer from `low` on. */
export const integer = (low: number) => real((value) => Number.isInteger(value) && value >= low);

export const flag: Field<boolean> = {
  read: (text) => (text === 'true' ? true : text === 'false' ? false : undefined),
  write: String,
};

/** One of the values of a selection list. */
export const oneOfChoices = <const T extends string>(choices: readonly { value: T }[]) =>
  oneOf(choices.map(({ value }) => value));

/** One of several texts. */
export const oneOf = <const T extends string>(values: readonly T[]): Field<T> => ({
  read: (text) => values.find((value) => value === text),
  write: String,
});

/** `length` numbers. */
export const numbers = (length: number): Field<readonly number[]> => ({
  read: (text) => listOf(text, length),
  write: (list) => list.join(','),
});

/** The values of another field, as they are in the app. */
export const as = <T, U>(field: Field<T>, of: (value: T) => U | undefined, to: (value: U) => T): Field<U> => ({
  read: (text) => {
    const value = field.read(text);
    return value === undefined ? undefined : of(value);
  },
  write: (value) => field.write(to(value)),
});

/** A point. */
export const point = as(
  numbers(3),
  ([x = 0, y = 0, z = 0]): Vec3 => [x, y, z],
  (one) => one,
);

/** A field that a link may have up to `most` times. */
export const many = <T>(field: Field<T>, most: number): Repeated<T> => ({ ...field, most });

/** Name of the version of the defaults that a link relies on, in links to any lab: not all labs have several. */
const VERSION = 'v';

/** How a lab's settings are written in links, and read from them. */
export interface LinkFormat<Fields, View extends ViewDeclaration> {
  /** Converts settings to the hash of an address. */
  toHash(settings: Linked<Fields, View>): string;
  /** Parses the hash of an address; undefined if it is for another lab or contains no settings. */
  fromHash(hash: string): Linked<Fields, View> | undefined;
}

/** Returns the field of an option of the view. */
function optionField(option: ViewOption): Field<unknown> {
  if ('entries' in option) return oneOf(Object.keys(option.entries));
  return 'step' in option ? real((value) => value >= 0 && value <= 1) : flag;
}

/**
 * Declares the settings in links to a lab: its own, and the options of its view. Whether their values suit its data, and
 * whether parameters are known, is not checked here.
 */
export function linkFormat<Fields extends Record<string, Field<unknown>>, View extends ViewDeclaration>(
  address: string,
  fields: Fields,
  options: View,
  readParam: (text: string) => unknown = readValue,
): LinkFormat<Fields, View> {
  const views = Object.entries(options).map(([name, option]) => [name, optionField(option)] as const);
  const all: (readonly [string, Field<unknown> | Repeated<unknown>])[] = [...Object.entries(fields), ...views];
  const known = new Set(all.map(([name]) => name));
  return {
    toHash({ params, view, unread: _, ...values }) {
      const query = new URLSearchParams();
      const given: Record<string, unknown> = { ...values, ...view };
      for (const [key, field] of all)
        if (given[key] !== undefined && !('most' in field)) query.set(key, field.write(given[key]));
      for (const [key, value] of Object.entries(params)) query.set(`p.${key}`, String(value));
      for (const [key, field] of all)
        if ('most' in field) for (const value of (given[key] ?? []) as unknown[]) query.append(key, field.write(value));
      const text = query.toString().replaceAll('%2C', ',').replaceAll('%3B', ';');
      return text ? `${address}?${text}` : address;
    },
    fromHash(hash) {
      const query = queryOf(hash, address);
      if (!query) return undefined;
      const [values, view, unread]: [Record<string, unknown>, Record<string, unknown>, string[]] = [{}, {}, []];
      const read = (key: string, field: Field<unknown>, text: string) => {
        const value = field.read(text);
        if (value === undefined) unread.push(`${key}=${text}`.slice(0, MOST_NAME));
        return value;
      };
      for (const [key, field] of all) {
        if (!query.has(key)) continue;
        if ('most' in field) {
          const texts = allIn(query, key, field.most);
          const list = texts.map((text) => read(key, field, text)).filter((value) => value !== undefined);
          if (list.length > 0) values[key] = list;
        } else {
          const value = read(key, field, query.get(key) ?? '');
          if (value !== undefined) (Object.hasOwn(options, key) ? view : values)[key] = value;
        }
      }
      for (const [key, text] of query)
        if (!known.has(key) && key !== VERSION && !key.startsWith('p.'))
          unread.push(`${key}=${text}`.slice(0, MOST_NAME));
      const params = paramsIn(query, readParam);
      return { ...values, params, view, ...(unread.length > 0 && { unread }) } as Linked<Fields, View>;
    },
  };
}

/** Returns the settings of those names that are among others. */
export function among<T extends object, Name extends keyof T>(values: T, names: readonly Name[]): Pick<T, Name> {
  return Object.fromEntries(names.filter((one) => values[one] !== undefined).map((one) => [one, values[one]])) as Pick<
    T,
    Name
  >;
}
