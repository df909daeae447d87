import catalogue from './en.json';
import { chosenLanguage } from './language';
import type { Placeholders } from './placeholders';

/**
 * Language of the interface, for texts, plural and number formats. All texts are in `en.json`, by the part of the app; a
 * translation is another such file, and may lack texts, which are then shown in English.
 */
export const LANGUAGE = chosenLanguage();

type Catalogue = typeof catalogue;
type KeyIn<S extends keyof Catalogue> = `${S}.${keyof Catalogue[S] & string}`;
/** Key of a text in the catalogue, section and name, as in `extract.noVolume`. */
export type TextKey = { [S in keyof Catalogue]: KeyIn<S> }[keyof Catalogue];
/** Key of a text with plural forms, without the suffix of the form, such as `_one`. */
export type PluralKey = TextKey extends infer K ? (K extends `${infer Base}_other` ? Base : never) : never;
/** Values for the placeholders of a text, if it has any. */
type ValuesOf<Key> = Key extends keyof Placeholders
  ? [values: Readonly<Record<Placeholders[Key], string | number>>]
  : [values?: undefined];
/** The same for a text with plural forms, which may show the number in another way. */
type ValuesOfPlural<Key extends PluralKey> =
  OthersOf<`${Key}_other`> extends never
    ? [values?: { count?: string }]
    : [values: Readonly<Record<OthersOf<`${Key}_other`>, string | number>> & { count?: string }];
/** The placeholders of a text besides the number. */
type OthersOf<Key> = Key extends keyof Placeholders ? Exclude<Placeholders[Key], 'count'> : never;
/** Values for the placeholders of a text of the interface, by name. */
export type TextValues = Record<string, string | number>;

type Sections = Record<string, Record<string, string> | undefined>;
const english: Sections = catalogue;
/** Fetched before any text is used, and not at all for English. */
const translated: Sections = LANGUAGE === 'de' ? (await import('./de.json')).default : {};
const FORMS = new Intl.PluralRules(LANGUAGE);
const COUNT = new Intl.NumberFormat(LANGUAGE, { maximumFractionDigits: 0 });

/** Formats a number without decimals, in the interface's language. */
export function count(value: number): string {
  return COUNT.format(value);
}

/**
 * Returns a text of the interface with its placeholders `{name}` replaced.
 *
 * Throws an Error if the value of a placeholder is missing.
 */
export function text<Key extends TextKey>(key: Key, ...[values]: ValuesOf<Key>): string {
  return filled(key, values ?? {});
}

function filled(key: string, values: TextValues): string {
  return template(key).replace(/\{(\w+)\}/g, (_, name: string) => clipped(String(requiredValue(values, name, key))));
}

/** Most characters of what a text quotes: it may be from a file, and of any length. */
const MOST_QUOTED = 1000;

function clipped(quoted: string): string {
  const calm = legible(quoted);
  return calm.length > MOST_QUOTED ? `${calm.slice(0, MOST_QUOTED)}…` : calm;
}

/** Combining marks and modifiers of one character beyond those that any script has. */
const SURPLUS_MARKS =
  /([\p{M}\p{Grapheme_Extend}\p{Emoji_Modifier}]{8})[\p{M}\p{Grapheme_Extend}\p{Emoji_Modifier}]+/gu;

/**
 * Returns a text, which may come from anywhere, with at most eight combining marks for each character: laying out one with
 * thousands of them takes browsers seconds.
 */
export const legible = (foreign: string): string => foreign.replace(SURPLUS_MARKS, '$1');

/**
 * Returns the plural form of a text that the language uses for this number, as "1 frame" or "2 frames"; the placeholder
 * `{count}` is the number. The forms have the suffixes `_one`, `_other` and so on.
 */
export function plural<Key extends PluralKey>(key: Key, number: number, ...[values]: ValuesOfPlural<Key>): string {
  const form = `${key}_${FORMS.select(number)}`;
  const known = (find(form) === undefined ? `${key}_other` : form) as TextKey;
  return filled(known, { count: count(number), ...values });
}

/**
 * Returns a text of the interface whose placeholders may be elements, as a list of its parts.
 *
 * Throws an Error if the value of a placeholder is missing.
 */
export function textNodes<Part>(key: TextKey, values: Record<string, Part | string>): (Part | string)[] {
  return template(key)
    .split(/(\{\w+\})/)
    .filter((part) => part !== '')
    .map((part) => {
      const name = /^\{(\w+)\}$/.exec(part)?.[1];
      return name === undefined ? part : requiredValue(values, name, key);
    });
}

function template(key: string): string {
  return find(key) ?? key;
}

function find(key: string): string | undefined {
  const [section = '', name = ''] = key.split('.');
  return translated[section]?.[name] ?? english[section]?.[name];
}

function requiredValue<Value>(values: Record<string, Value>, name: string, key: string): Value {
  const value = values[name];
  if (value === undefined) throw new Error(`the text ${key} needs a value for {${name}}`);
  return value;
}
