/** Lessons as data: conditions, files and their errors, and those that are served with the app. */
import { readdirSync, readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { describe, expect, test } from 'vitest';
import { EXAMPLES } from '../../www/src/labs/extract/examples';
import { PRESETS } from '../../www/src/labs/extract/presets';
import { CLOUDS } from '../../www/src/labs/reconstruct/examples';
import { CLOUD_PRESETS } from '../../www/src/labs/reconstruct/presets';
import { SCENES } from '../../www/src/labs/sculpt/examples';
import { SCULPT_PRESETS } from '../../www/src/labs/sculpt/presets';
import { IMAGES } from '../../www/src/labs/track/examples';
import { TRACK_PRESETS } from '../../www/src/labs/track/presets';
import { type Check, checkProblem, holds, type Operand, unmetPart } from '../../www/src/lessons/check';
import { type Lesson, type LessonFiles, parseLesson } from '../../www/src/lessons/lesson';
import { isAnswered, isComplete, type Progress } from '../../www/src/lessons/progress';
import type { LabReading } from '../../www/src/lessons/reading';

const FOLDER = fileURLToPath(new URL('../../www/public/lessons/', import.meta.url));
const OWN: string[] = JSON.parse(readFileSync(`${FOLDER}index.json`, 'utf8'));
const filesOf = (id: string): LessonFiles =>
  Object.fromEntries(readdirSync(FOLDER + id).map((name) => [name, readFileSync(`${FOLDER}${id}/${name}`, 'utf8')]));

const READING: LabReading = {
  lab: 'extract',
  state: 'done',
  example: 'sponge',
  params: { rigidity: 0.3, integrator: 'euler' },
  measures: { chi: -160, volume: 90, closed: true },
  warnings: [],
};
const RECORDS = { first: { volume: 100 } };

describe('a condition', () => {
  test.each<[Check, boolean]>([
    [{ measure: 'chi', equals: -160 }, true],
    [{ measure: 'chi', equals: -158 }, false],
    [{ measure: 'chi', equals: -158, within: 2 }, true],
    [{ measure: 'closed', equals: true }, true],
    [{ measure: 'unknown', equals: 0 }, false],
    [{ param: 'rigidity', above: 0.3 }, false],
    [{ param: 'rigidity', atLeast: 0.3, below: 0.4 }, true],
    [{ param: 'rigidity', atMost: 0.2 }, false],
    [{ param: 'integrator', equals: 'euler' }, true],
    [{ state: 'done' }, true],
    [{ state: 'paused' }, false],
    [{ lab: 'extract' }, true],
    [{ example: 'ovule' }, false],
    [{ not: { example: 'ovule' } }, true],
    [{ all: [{ state: 'done' }, { measure: 'chi', below: 0 }] }, true],
    [{ all: [{ state: 'done' }, { measure: 'chi', above: 0 }] }, false],
    [{ any: [{ state: 'paused' }, { measure: 'chi', below: 0 }] }, true],
    [{ any: [{ state: 'paused' }] }, false],
    [{ measure: 'volume', below: { step: 'first', measure: 'volume', times: 0.95 } }, true],
    [{ measure: 'volume', below: { step: 'first', measure: 'volume', times: 0.85 } }, false],
    [{ measure: 'volume', below: { step: 'later', measure: 'volume' } }, false],
  ])('%j is %s', (check, expected) => {
    expect(checkProblem(check, ['first', 'later'])).toBeUndefined();
    expect(holds(check, READING, RECORDS)).toBe(expected);
  });

  test('says which part of it is not true first', () => {
    const unmet = (check: Check) => unmetPart(check, READING, RECORDS);
    const [example, state] = [{ example: 'ovule' }, { state: 'paused' }];
    expect(unmet({ all: [{ lab: 'extract' }, example, state] })).toBe(example);
    expect(unmet({ all: [{ lab: 'extract' }, { all: [state, example] }] })).toBe(state);
    expect(unmet({ any: [state, example] })).toEqual({ any: [state, example] });
    expect(unmet({ not: { state: 'done' } })).toEqual({ not: { state: 'done' } });
    expect(unmet({ state: 'done' })).toBeUndefined();
  });

  test.each<[unknown, RegExp]>([
    [5, /must be an object/],
    [{ measur: 'chi', equals: 0 }, /measur,equals.*all,any,not/],
    [{ measure: 'chi' }, /accepted are equals,above/],
    [{ measure: 'chi', is: 0 }, /“is”.*equals/],
    [{ measure: 'chi', toString: 0 }, /“toString”.*equals/],
    [{ measure: 'chi', equals: 0, within: 'all' }, /number/],
    [{ measure: 3, equals: 0 }, /must be text/],
    [{ all: {} }, /must be a list/],
    [{ any: [] }, /must be a list/],
    [{ all: [{ not: { state: 1 } }] }, /“state”.*must be text/],
    [{ measure: 'chi', equals: null }, /number, text/],
    [{ measure: 'chi', equals: { step: 'none', measure: 'chi' } }, /no step “none” before/],
  ])('%j is refused with what is accepted', (check, message) => {
    expect(checkProblem(check, ['first'])).toMatch(message);
  });
});

describe('files of a lesson', () => {
  const data = {
    id: 'rings',
    languages: ['en', 'de'],
    minutes: 5,
    steps: [{ id: 'a', question: 'text' }, { id: 'b' }],
  };
  const files = (
    change: object = {},
    text = '# Rings\n\nIntro\n\n## A\n\nGoal\n\n### hint\n\nH\n\n## B\n',
  ): LessonFiles => ({
    'lesson.json': JSON.stringify({ ...data, ...change }),
    'text.en.md': text,
    'text.de.md': text.replace('Rings', 'Ringe'),
  });

  test('are split into steps and their parts, in the language asked for, else in the first', () => {
    const lesson = parseLesson(files(), 'fr');
    expect(lesson).toMatchObject({ id: 'rings', language: 'en', title: 'Rings', intro: 'Intro', minutes: 5 });
    expect(lesson.steps).toEqual([
      { id: 'a', question: 'text', language: 'en', title: 'A', parts: { goal: 'Goal', hint: 'H' } },
      { id: 'b', language: 'en', title: 'B', parts: {} },
    ]);
    expect(parseLesson(files(), 'de').title).toBe('Ringe');
  });

  test.each<[LessonFiles, RegExp]>([
    [{}, /lesson\.json is missing/],
    [{ 'lesson.json': '{' }, /not valid JSON/],
    [files({ languages: ['it'] }), /text\.it\.md is missing/],
    [files({ languages: 'en' }), /a list such as \["en"\]/],
    [files({ id: '../x' }), /“id”/],
    [files({ steps: [] }), /“steps”/],
    [files({ steps: [{ id: 'a' }] }), /2 headings.*1 steps/],
    [files({ steps: [{ id: 'a' }, { id: 'a' }] }), /step 2: every step needs an “id” of its own/],
    [files({ steps: [{ id: 'a' }, null] }), /step 2/],
    [files({ steps: [{ id: 'a', open: 'https://example.org' }, { id: 'b' }] }), /step 1: “open”/],
    [files({ steps: [{ id: 'a', question: { answer: [] } }, { id: 'b' }] }), /step 1: “question”/],
    [files({ steps: [{ id: 'a', question: { answer: 'two' } }, { id: 'b' }] }), /step 1: “question”.*a number/],
    [
      files({ steps: [{ id: 'a', question: { answer: 2, within: '1' } }, { id: 'b' }] }),
      /step 1: “question”.*“within”/,
    ],
    [files({ steps: [{ id: 'a', question: { answer: 2, unit: 'ells' } }, { id: 'b' }] }), /step 1: “question”.*“unit”/],
    [files({ steps: [{ id: 'a', check: { state: 0 } }, { id: 'b' }] }), /step 1: “state”/],
    [files({}, '# T\n\n## A\n\n### tip\n\n## B\n'), /“### tip” in step “A”.*hint/],
  ])('with an error are refused: %#', (wrong, message) => {
    expect(() => parseLesson(wrong, 'en')).toThrow(message);
  });
});

describe('progress', () => {
  const progress: Progress = {
    step: 0,
    name: '',
    ticks: { a: { at: '', link: '', measures: { triangles: 10 } } },
    answers: { a: '15', b: ' ', c: '0,5' },
  };
  const step = (id: string, more: object) => ({ id, language: 'en', title: '', parts: {}, ...more });

  test('an answer is compared with a number or a recorded measure; words are right unless missing', () => {
    const answer = (operand: Operand, within?: number) => ({ question: { answer: operand, within } });
    expect(isAnswered(step('a', answer({ step: 'a', measure: 'triangles', times: 1.5 })), progress)).toBe(true);
    expect(isAnswered(step('a', answer({ step: 'b', measure: 'triangles' })), progress)).toBe(false);
    expect(isAnswered(step('c', answer(0.6)), progress)).toBe(false);
    expect(isAnswered(step('c', answer(0.6, 0.11)), progress)).toBe(true);
    expect(isAnswered(step('c', { question: 'text' }), progress)).toBe(true);
    expect(isAnswered(step('b', { question: 'text' }), progress)).toBe(false);
  });

  test('a step is complete when it is ticked and answered', () => {
    const check = { state: 'done' };
    expect(isComplete(step('a', { check, question: 'text' }), progress)).toBe(true);
    expect(isComplete(step('b', { check }), progress)).toBe(false);
    expect(isComplete(step('b', {}), progress)).toBe(true);
  });
});

/** Outline of a lesson, which a translation has in common with its original: the parts of each step, and how many of what is in each of them. */
const outlineOf = ({ intro, steps }: Lesson) =>
  [{ intro }, ...steps.map(({ parts }) => parts)].map((parts) =>
    Object.entries(parts).map(([name, source]) => [
      name,
      ...[/\n\n/g, /^\d+\. /gm, /\$\$/g, /\$/g, /\]\(/g].map((one) => source.match(one)?.length ?? 0),
    ]),
  );

describe('lessons of the app', () => {
  const EXAMPLE_IDS: Record<string, string[]> = {
    extract: [...EXAMPLES, ...PRESETS].map(({ id }) => id),
    reconstruct: [...CLOUDS, ...CLOUD_PRESETS].map(({ id }) => id),
    track: [...IMAGES, ...TRACK_PRESETS].map(({ id }) => id),
    sculpt: [...SCENES, ...SCULPT_PRESETS].map(({ id }) => id),
  };

  test('are the folders beside their index', () => {
    const folders = readdirSync(FOLDER).filter((name) => name !== 'index.json');
    expect(folders.sort()).toEqual([...OWN].sort());
    expect(OWN).toHaveLength(6);
  });

  test.each(OWN)('%s has every text in each of its languages, and opens examples that exist', (id) => {
    const files = filesOf(id);
    const { languages } = JSON.parse(files['lesson.json'] ?? '');
    expect(Object.keys(files).sort()).toEqual(
      ['lesson.json', ...languages.map((one: string) => `text.${one}.md`)].sort(),
    );
    const [first, ...others] = languages.map((language: string) => parseLesson(files, language));
    expect(first.id).toBe(id);
    for (const other of others) expect(outlineOf(other)).toEqual(outlineOf(first));
    for (const { open, check, question, parts } of first.steps) {
      const [lab = '', query] = open?.split('?') ?? [];
      if (open) expect(EXAMPLE_IDS[lab]).toContain(new URLSearchParams(query).get('example'));
      expect([parts.check !== undefined, parts.question !== undefined]).toEqual([
        check !== undefined,
        question !== undefined,
      ]);
      if (question) expect(parts).toHaveProperty('answer');
    }
  });
});
