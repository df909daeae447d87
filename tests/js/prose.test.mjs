// The prose linter: every rule by its own examples, the glossary it reads, and the files that it extracts text from.

import { existsSync } from 'node:fs';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { beforeAll, describe, expect, test } from 'vitest';
import { proseOf } from '../../scripts/prose/extract.mjs';
import { entriesOf, GLOSSARY, literalRules, ruledOut } from '../../scripts/prose/glossary.mjs';
import { PHRASES } from '../../scripts/prose/phrases.mjs';
import { allPhrases, lint, lintDocument } from '../../scripts/prose.mjs';
import { at, run } from '../../scripts/shell.mjs';

let phrases = [];
let entries = [];

beforeAll(async () => {
  phrases = await allPhrases();
  entries = await ruledOut();
});

/** Lints a text as the kind of document that a rule is for. */
const found = (text, rules, { only = 'markdown' } = {}) =>
  lintDocument('params.rs', { kind: only, ext: only === 'strings' ? '.txt' : '.md', text }, rules);

describe.each(PHRASES)('$bad', (phrase) => {
  test('is found', async () => {
    const findings = await found(phrase.bad, [phrase], phrase);
    expect(findings.map(({ use }) => use)).toContain(phrase.use);
  });

  test('has a better wording that passes all rules', async () => {
    expect(await found(phrase.good, phrases, phrase)).toEqual([]);
  });
});

const EXCEPTIONS = PHRASES.flatMap((phrase) => (phrase.except ?? []).map((exception) => ({ phrase, ...exception })));

test.each(EXCEPTIONS)('$good is an exception: $because', async ({ phrase, good }) => {
  expect(await found(good, [{ ...phrase, except: [] }], phrase)).not.toEqual([]);
  expect(await found(good, phrases, phrase)).toEqual([]);
});

test('a phrase is found across lines, wherever they break', async () => {
  const inParagraphs = PHRASES.filter(({ only }) => !only);
  for (const phrase of inParagraphs) {
    expect(await found(phrase.bad.replaceAll(' ', '\n'), [phrase]), phrase.bad).not.toEqual([]);
  }
});

test('words of the glossary are found in the singular, in the plural, and in no other word', async () => {
  const rules = literalRules(entriesOf('| outlier | a | b | stray |'));
  const text = 'A stray; two strays. The file astray strayed: `stray`, stray-light, <a href="stray">here</a>.';
  expect((await found(text, rules)).map((finding) => finding.found)).toEqual(['stray', 'strays']);
});

test('every word that the glossary rules out in one sense only has a rule of its own, and the reverse', () => {
  const inOneSense = entries.filter(({ meaning }) => meaning).map(({ word }) => word);
  expect(PHRASES.flatMap(({ word = [] }) => word).sort()).toEqual(inOneSense.sort());
});

test('the rows of the glossary are complete, and their links lead somewhere', async () => {
  const text = await readFile(at(GLOSSARY), 'utf8');
  const rows = text.split('\n').filter((line) => line.startsWith('|'));
  expect(rows.filter((row) => row.split('|').length !== 6)).toEqual([]);
  const links = [...text.matchAll(/\]\((?!https?:)([^)#]+)/g)].map(([, target]) => target);
  expect(links.length).toBeGreaterThan(100);
  expect(links.filter((target) => !existsSync(join(dirname(at(GLOSSARY)), target)))).toEqual([]);
  const terms = rows.map((row) => row.split('|')[1].trim()).filter((term) => !/^(term|-*)$/.test(term));
  expect(terms.filter((term, i) => terms.indexOf(term) !== i)).toEqual([]);
});

describe('text is extracted with its line numbers', () => {
  const texts = (path, source) => Object.fromEntries(proseOf(path, source).map(({ kind, text }) => [kind, text]));

  test('from Rust', () => {
    const source = `/// Returns \`a\`.
fn a<'a>(c: char) { // Not "quoted
    let x = ('"', '\\'', r#"// no comment "here" at all"#, b"no // comment");
    /* Over
     * lines. */
    #[error("a message \\
        of {two} lines")]
}`;
    const { comments, strings } = texts('src/x.rs', source);
    expect(comments.split('\n')).toEqual(['Returns `a`.', 'Not "quoted', '', 'Over', 'lines.', '', '', '']);
    expect(strings.split('\n')).toEqual(['', '', '', '', '', 'a message of … lines', '', '']);
  });

  test('from TypeScript', () => {
    const source = `// One
const a = /["'/*]/.test(b) ? \`not \${\`// a \${c}\`} comment here\` : 'no // comment of ours';
/** Two
 *  three */
const d = e / f; // four`;
    const { comments, strings } = texts('js/x.ts', source);
    expect(comments.split('\n')).toEqual(['One', '', 'Two', ' three', 'four']);
    expect(strings.split('\n')[1]).toContain('no // comment of ours');
    expect(texts('www/src/x.ts', source).strings).toBeUndefined();
  });

  test('from Python, style sheets and catalogues', () => {
    expect(texts('x.py', 'a = "# no"  # yes').comments).toBe('yes');
    expect(texts('x.css', 'a {}\n/* yes */').comments).toBe('\nyes');
    expect(texts('en.json', '{\n "a": {\n  "b": "yes, \\"indeed\\""\n }\n}').strings).toBe('\n\nyes, "indeed"\n\n');
  });

  test('from Markdown, whose code is left out', async () => {
    const source =
      'One.\n\n> It comes to\n> rest.\n\n```\ncomes to rest\n```\n\n`comes to rest`, [x](a.md "comes to rest")\n\n| a |\n| - |\n| at rest again |';
    const findings = await lint('x.md', source, phrases);
    expect(findings.map(({ line, found }) => [line, found])).toEqual([
      [3, 'comes to rest'],
      [14, 'at rest again'],
    ]);
  });
});

test('a file with one bad phrase fails, and the report names its line', async () => {
  const folder = await mkdtemp(join(tmpdir(), 'prose-'));
  try {
    const file = join(folder, 'x.rs');
    await writeFile(file, '/// Fits a surface.\n\n/// The surface comes to rest.\nfn x() {}\n');
    const bad = await run(process.execPath, [at('scripts/prose.mjs'), file], { echo: false });
    expect(bad).toMatchObject({
      code: 1,
      output: expect.stringContaining('x.rs:3: "comes to rest"; better: converges'),
    });
    await writeFile(file, '/// Fits a surface.\n\n/// The surface converges.\nfn x() {}\n');
    expect(await run(process.execPath, [at('scripts/prose.mjs'), file], { echo: false })).toMatchObject({ code: 0 });
  } finally {
    await rm(folder, { recursive: true });
  }
});
