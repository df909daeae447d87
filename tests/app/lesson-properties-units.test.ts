/** Lessons of anyone: a lesson within bounds, or an error in words. */
import fc from 'fast-check';
import { expect, test } from 'vitest';
import { isTypeset } from '../../www/src/lessons/bounds';
import { holds, unmetPart } from '../../www/src/lessons/check';
import { filesOf, type LessonFiles, parseLesson } from '../../www/src/lessons/lesson';
import type { LabReading } from '../../www/src/lessons/reading';

const numRuns = Number(process.env.PROPERTY_RUNS ?? 500);

const READING: LabReading = {
  ...{ lab: 'extract', state: 'done', example: 'a' },
  ...{ params: {}, measures: { chi: 2 }, warnings: [] },
};

const name = fc.constantFrom(
  ...['all', 'any', 'not', 'lab', 'state', 'example', 'measure', 'param', 'equals', 'above', 'within', 'step', 'times'],
  ...['__proto__', 'constructor', 'toString'],
);
const { check } = fc.letrec((tie) => ({
  check: fc.oneof(
    { maxDepth: 6 },
    fc.jsonValue(),
    fc.record({ measure: fc.constantFrom('chi', 'x'), equals: tie('operand') }),
    fc.dictionary(name, fc.oneof(fc.jsonValue(), fc.array(tie('check')), tie('check'))),
    fc.record({ all: fc.array(tie('check')) }),
    fc.record({ not: tie('check') }),
  ),
  operand: fc.oneof(fc.jsonValue(), fc.record({ step: fc.constantFrom('a', 'b'), measure: fc.constant('chi') })),
}));
const step = fc.oneof(
  fc.jsonValue(),
  fc.record(
    { id: fc.constantFrom('a', 'b', 'c'), open: fc.constantFrom('extract', 'x', 'sculpt?p=1'), check, question: check },
    { requiredKeys: ['id'] },
  ),
);
const data = fc.oneof(
  fc.string(),
  fc.jsonValue().map((value) => JSON.stringify(value)),
  fc
    .record({ id: fc.constant('own'), languages: fc.constant(['en']), minutes: fc.anything(), steps: fc.array(step) })
    .map((value) => JSON.stringify(value)),
  fc.integer({ min: 0, max: 3000 }).map((depth) => `{"steps":${'['.repeat(depth)}${']'.repeat(depth)}}`),
);
const line = fc.constantFrom(
  ...['# Title', '## Step', '### do', '### watch', '### other', '$x^2$', '$$', '$', '> '.repeat(40), '- '.repeat(40)],
  ...[
    '|a|b|\n|-|-|',
    '[x](javascript:alert(1))',
    '<script>',
    '$\\def\\a{x}\\a$',
    '`'.repeat(30),
    '\\'.repeat(9),
    'words',
  ],
);
const text = fc.oneof(
  fc.string(),
  fc.array(line, { maxLength: 30 }).map((lines) => lines.join('\n')),
);

/** Returns a lesson; undefined if an error says what is wrong. */
function read(files: LessonFiles) {
  try {
    const [first = ''] = filesOf(files['lesson.json'] ?? '', 'en');
    expect(first).toBe('lesson.json');
    return parseLesson(files, 'en');
  } catch (error) {
    // A programming error throws others, such as a TypeError.
    expect((error as Error).constructor).toBe(Error);
    expect((error as Error).message.length).toBeLessThan(2500);
    return undefined;
  }
}

test('any files are a lesson, or refused in words', () => {
  fc.assert(
    fc.property(data, text, (data, text) => {
      const lesson = read({ 'lesson.json': data, 'text.en.md': text });
      for (const { check } of lesson?.steps ?? []) {
        if (!check) continue;
        expect(holds(check, READING, {})).toBeTypeOf('boolean');
        expect(unmetPart(check, READING, {}) === undefined).toBe(holds(check, READING, {}));
      }
    }),
    { numRuns },
  );
});

const whole = (text: string, steps = [{ id: 'a' }]) =>
  parseLesson({ 'lesson.json': JSON.stringify({ id: 'own', languages: ['en'], steps }), 'text.en.md': text }, 'en');

test('what would keep the page busy is refused', () => {
  expect(whole(`# T\n\n## S\n${'$x$ '.repeat(600)}`).steps).toHaveLength(1);
  expect(() => whole(`# T\n\n## S\n${'$x$ '.repeat(15_000)}`)).toThrow('at most 600 formulas');
  expect(whole(`# T\n\n## S\n${'[a] '.repeat(4_000)}`).steps).toHaveLength(1);
  expect(() => whole(`# T\n\n## S\n${'['.repeat(5_001)}`)).toThrow('at most 5000 opening square brackets');
  const matrices = `$\\begin{matrix}${'&'.repeat(960)}\\end{matrix}$ `.repeat(5);
  expect(() => whole(`# T\n\n## S\n${matrices}`)).toThrow('at most 500 cells in all formulas');
  const deep = (depth: number) => whole(`# T\n\n## S\n$${'\\sqrt{'.repeat(depth)}x${'}'.repeat(depth)}$`);
  expect(deep(20).steps).toHaveLength(1);
  expect(() => deep(21)).toThrow('at most 20 braces within each other in a formula');
  // Neither escaped braces nor those in comments and quotations close any.
  for (const [open, close] of [
    ['{\\}', '}'],
    ['{%}\n', '}'],
    ['{\\verb|}|', '}'],
    ['\\left(', '\\right)'],
    ['\\begingroup ', '\\endgroup '],
  ] as const)
    expect(() => whole(`# T\n\n## S\n$$${open.repeat(21)}x${close.repeat(21)}$$`)).toThrow('within each other in a');
  // Dollar signs in code delimit no formula, so what is between two of them may be one.
  expect(() => whole(`# T\n\n## S\n${`\`$\` $${'x'.repeat(980)}$ `.repeat(40)}`)).toThrow('characters in all formulas');
  expect(whole('# T\n\n## S\n$$\\begin{pmatrix} a & b \\\\ c & d \\end{pmatrix}$$').steps).toHaveLength(1);
  const row = `${'|a'.repeat(20)}|\n`;
  const table = `# T\n\n## S\n${row}${'|-'.repeat(20)}|\n${row.repeat(2_000)}`;
  expect(() => whole(table)).toThrow('at most 5000 cells of tables');
  for (const many of ['x\n\n', '- x\n', '`x` ', '<https://x.org> ', '*x* '])
    expect(() => whole(`# T\n\n## S\n${many.repeat(6_000)}`)).toThrow('at most 5000 paragraphs');
  expect(() => whole(`# T\n\n## S\n$$${'x'.repeat(2000)}$$`)).toThrow('characters in a formula');
  expect(() => whole('# T\n\n## S\n'.padEnd(250_000))).toThrow('at most 200000 characters');
  const ids = Array.from({ length: 101 }, (_, k) => ({ id: `s${k}` }));
  expect(() => whole('# T', ids)).toThrow('at most 100 steps');
  const nested = `{"id":"a","languages":["en"],"steps":${'['.repeat(99_000)}${']'.repeat(99_000)}}`;
  expect(() => parseLesson({ 'lesson.json': nested }, 'en')).toThrow('within each other');
  // A kilobyte of this takes KaTeX minutes.
  expect(isTypeset(`\\def\\a{${'x'.repeat(500)}}${'\\a'.repeat(200)}`)).toBe(false);
  expect(['\\chi = 2c - 2g', '\\left(x\\right)', '\\define x', '\\lets'].map(isTypeset)).toEqual([
    true,
    true,
    true,
    true,
  ]);
  expect(['\\newcommand{\\a}{x}', '\\gdef\\a{x}', '\\let\\a=b'].map(isTypeset)).toEqual([false, false, false]);
});
