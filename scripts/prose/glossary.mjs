// Reads the words that docs/glossary.md rules out: the column "not" of its tables.
import { readFile } from 'node:fs/promises';
import { at } from '../shell.mjs';

export const GLOSSARY = 'docs/glossary.md';

/**
 * Returns the entries of the glossary's column "not" as `{ word, use, meaning }`. `use` is the term of the row. A `meaning`, which
 * stands in parentheses behind the word, says in which sense it is not used; such a word needs a rule of its own in `phrases.mjs`.
 */
export async function ruledOut(file = at(GLOSSARY)) {
  return entriesOf(await readFile(file, 'utf8'));
}

export function entriesOf(text) {
  const rows = text.split('\n').filter((line) => /^\|(?! *-)(?!.*\| *not *\|)/.test(line));
  return rows.flatMap((row) => {
    const [term, , , not = ''] = row.split('|').slice(1, -1);
    const words = not.split(/,(?![^(]*\))/).map((word) => word.trim());
    return words.filter(Boolean).map((word) => entry(word, term.replaceAll('`', '').trim()));
  });
}

function entry(written, use) {
  const [, word, meaning] = written.replaceAll('`', '').match(/^([^(]+?)(?: \((.*)\))?$/) ?? [];
  if (!word) throw new Error(`${GLOSSARY}: '${written}' is not a word with its meaning in parentheses`);
  return { word, use, meaning };
}

/** The rules for words that are never used, in the singular or plural; those with a meaning have theirs in `phrases.mjs`. */
export const literalRules = (entries) =>
  entries.filter(({ meaning }) => !meaning).map(({ word, use }) => ({ word, use, find: literal(word) }));

const literal = (word) =>
  new RegExp(`(?<![\\w-])${word.replace(/[.*+?^${}()|[\]\\]/g, '\\$&')}(?:e?s)?(?![\\w-])`, 'i');
