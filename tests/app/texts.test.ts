/** The catalogue of the interface's texts fits its uses in the app's code. */
import { readdirSync, readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import ts from 'typescript';
import { expect, test } from 'vitest';
import { typesOf } from '../../scripts/texts.mjs';
import { legible, plural, type TextKey, text, textNodes } from '../../www/src/texts';
import german from '../../www/src/texts/de.json';
import catalogue from '../../www/src/texts/en.json';

const ROOT = fileURLToPath(new URL('../../www/src/', import.meta.url));
const FORMS = /_(zero|one|two|few|many|other)$/;

const textsOf = (sections: Record<string, Record<string, string>>) =>
  new Map(
    Object.entries(sections).flatMap(([section, entries]) =>
      Object.entries(entries).map(([name, value]): [string, string] => [`${section}.${name}`, value]),
    ),
  );
const texts = textsOf(catalogue);
const placeholders = (value: string) => new Set([...value.matchAll(/\{(\w+)\}/g)].map(([, name]) => name ?? ''));

/** A call of `text`, `plural` or `textNodes`, with its key and the names of its values if these are literal. */
interface Use {
  at: string;
  key: string;
  plural: boolean;
  names: Set<string> | undefined;
}

/** Names of the properties of an object literal; undefined if they are not all known. */
function namesOf(values: ts.Expression | undefined): Set<string> | undefined {
  if (!values) return new Set();
  if (!ts.isObjectLiteralExpression(values)) return undefined;
  const names = values.properties.map(({ name }) => (name && ts.isIdentifier(name) ? name.text : undefined));
  return names.includes(undefined) ? undefined : new Set(names as string[]);
}

/** Keys that an expression may give, as far as they are literal. */
function keysOf(key: ts.Expression | undefined): string[] {
  if (key && ts.isConditionalExpression(key)) return [...keysOf(key.whenTrue), ...keysOf(key.whenFalse)];
  return key && ts.isStringLiteral(key) ? [key.text] : [];
}

const strings = new Set<string>();
const uses: Use[] = [];

for (const file of readdirSync(ROOT, { recursive: true, encoding: 'utf8' }).filter((name) => /\.tsx?$/.test(name))) {
  const source = ts.createSourceFile(file, readFileSync(ROOT + file, 'utf8'), ts.ScriptTarget.Latest, true);
  const visit = (node: ts.Node): void => {
    if (ts.isStringLiteral(node)) strings.add(node.text);
    if (ts.isCallExpression(node) && ts.isIdentifier(node.expression)) note(node, node.expression.text);
    ts.forEachChild(node, visit);
  };
  const note = ({ arguments: [key, ...others], pos }: ts.CallExpression, name: string): void => {
    if (!['text', 'plural', 'textNodes'].includes(name)) return;
    const { line } = source.getLineAndCharacterOfPosition(pos);
    const isPlural = name === 'plural';
    const names = namesOf(others[isPlural ? 1 : 0]);
    if (isPlural) names?.add('count');
    for (const one of keysOf(key)) uses.push({ at: `${file}:${line + 1}`, key: one, plural: isPlural, names });
  };
  visit(source);
}

test('every key in the code is in the catalogue', () => {
  const unknown = uses.filter((use) => !texts.has(use.plural ? `${use.key}_other` : use.key));
  expect(unknown).toEqual([]);
});

test('every text of the catalogue is used', () => {
  const unused = [...texts.keys()].filter((key) => !strings.has(key) && !strings.has(key.replace(FORMS, '')));
  expect(unused).toEqual([]);
});

test('every use of a text gives the values of its placeholders, and no others', () => {
  const wrong = uses.flatMap(({ at, key, plural, names }) => {
    const wanted = placeholders(texts.get(plural ? `${key}_other` : key) ?? '');
    if (plural) wanted.add('count');
    return names && [...names].sort().join() !== [...wanted].sort().join() ? [{ at, key, names, wanted }] : [];
  });
  expect(wrong).toEqual([]);
});

test('the types of the placeholders are those of the catalogue', () => {
  const types = readFileSync(`${ROOT}texts/placeholders.ts`, 'utf8');
  expect(types, 'npm run texts writes them').toBe(typesOf(catalogue));
});

test('all plural forms of a text have the same placeholders, besides the number', () => {
  for (const [key, value] of texts) {
    const other = texts.get(key.replace(FORMS, '_other'));
    if (!FORMS.test(key) || other === undefined) continue;
    const [mine, theirs] = [placeholders(value), placeholders(other)];
    for (const names of [mine, theirs]) names.delete('count');
    expect([key, mine]).toEqual([key, theirs]);
  }
});

test('placeholders are replaced, a missing value is an error, and numbers choose the plural form', () => {
  const key: TextKey = 'labs.opening';
  expect(text(key, { name: 'a.nii' })).toBe('Opening a.nii.');
  expect(() => text(key, {} as never)).toThrow('{name}');
  expect(textNodes(key, { name: 'a.nii' })).toEqual(['Opening ', 'a.nii', '.']);
  expect([plural('counts.step', 1), plural('counts.step', 1200)]).toEqual(['1 step', '1,200 steps']);
});

test('characters keep the marks that scripts have, and no more than eight', () => {
  const plain = ['Ångström', 'ภาษาไทยที่', 'हिन्दी', 'x\u0302\u0305\u0323', '👩‍👩‍👧‍👦', '👍🏽', '🏴󠁧󠁢󠁳󠁣󠁴󠁿'];
  for (const one of plain) expect(legible(one)).toBe(one);
  for (const mark of ['\u0300', '🏿', '\u{e0061}', '\u200c', '\u093e'])
    expect(legible(`a${mark.repeat(20_000)}b`)).toBe(`a${mark.repeat(8)}b`);
  // Quoted text, too.
  expect(text('labs.opening', { name: `x${'\u0300'.repeat(900)}` })).toBe(
    text('labs.opening', { name: `x${'\u0300'.repeat(8)}` }),
  );
});

test('German has the texts of English, in the same order, with the same placeholders, and all forms of a plural', () => {
  const translated = textsOf(german);
  expect([...translated.keys()]).toEqual([...texts.keys()]);
  for (const [key, value] of translated)
    expect([key, placeholders(value)]).toEqual([key, placeholders(texts.get(key) ?? '')]);
  const needed = new Intl.PluralRules('de').resolvedOptions().pluralCategories;
  const forms = [...translated.keys()]
    .filter((key) => FORMS.test(key))
    .flatMap((key) => needed.map((form) => key.replace(FORMS, `_${form}`)));
  expect(forms.filter((key) => !translated.has(key))).toEqual([]);
});
