import { readdirSync, readFileSync } from 'node:fs';
import { build, type Plugin } from 'esbuild';
import { expect } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { holds, type Records } from '../../www/src/lessons/check';
import { type Lesson, parseLesson, type Step } from '../../www/src/lessons/lesson';
import type { LabReading } from '../../www/src/lessons/reading';
import { type App, reach } from './browser';
import { REFERENCES, type Shown, type ShownIn } from './lesson-references';

const step = ({ page }: App) => page.locator('#lesson .lesson-step');

/** Waits until the step that is shown is ticked. */
export const ticked = (app: App) => step(app).locator('[data-ticked]').waitFor({ timeout: 240_000 });

/** Returns a lesson of the app in all its languages, English first. */
function lessonsOf(id: string): [Lesson, ...Lesson[]] {
  const folder = at(`www/public/lessons/${id}`);
  const files = Object.fromEntries(
    readdirSync(folder).map((name) => [name, readFileSync(`${folder}/${name}`, 'utf8')]),
  );
  const { languages } = JSON.parse(files['lesson.json'] ?? '') as { languages: string[] };
  const [first, ...others] = languages.map((language) => parseLesson(files, language));
  if (first?.language !== 'en') throw new Error(`${id} is not in English first`);
  return [first, ...others];
}

/** Leaves out the catalogue of texts, which waits for a translation, and which reading a lab does not need. */
const WITHOUT_TEXTS: Plugin = {
  name: 'without texts',
  setup: ({ onResolve, onLoad }) => {
    onResolve({ filter: /texts$/ }, ({ path }) => ({ path, namespace: 'texts' }));
    onLoad({ filter: /./, namespace: 'texts' }, () => ({ contents: 'export const text = String' }));
  },
};

/** Reads the lab as lessons do. */
async function readingOf({ page }: App): Promise<LabReading> {
  const { outputFiles } = await build({
    entryPoints: [at('www/src/lessons/reading.ts')],
    ...{ bundle: true, write: false, format: 'iife', globalName: 'lessons', plugins: [WITHOUT_TEXTS] },
  });
  const read = `${outputFiles?.[0]?.text}; lessons.readLab(document.querySelector('#lab'))`;
  return (await page.evaluate(read)) as LabReading;
}

/** Reads the numbers that the lab shows, as a student does: of the table, of the iteration, and of the heartbeat. */
async function shownBy({ page }: App): Promise<Shown> {
  const shown = await page.evaluate(() => {
    const entries = [...document.querySelectorAll<HTMLElement>('#lab [data-measure]')].map((row) => [
      row.dataset.measure,
      row.textContent,
    ]);
    const [largest, smallest] = document.querySelector('#lab [data-beat]')?.textContent?.match(/[\d.]+(?= ml)/g) ?? [];
    const iteration = document.querySelector('#lab .iteration')?.textContent ?? '';
    return { ...Object.fromEntries(entries), largest, smallest, iteration } as Record<string, string | undefined>;
  });
  return (measure) => {
    const [number] = shown[measure]?.replaceAll(',', '').match(/-?\d[\d.]*(e[+-]?\d+)?/) ?? [];
    if (number === undefined) throw new Error(`the lab does not show ${measure}`);
    return Number(number);
  };
}

/** Answers the question of the step that is shown; returns whether this is right, and what is said. */
async function answered(app: App, given: string): Promise<[isRight: boolean, says: string]> {
  const field = step(app).getByRole('textbox');
  await field.fill(given);
  await field.press('Tab');
  const feedback = step(app).locator('.lesson-feedback');
  return [(await feedback.getAttribute('data-right')) !== null, (await feedback.textContent()) ?? ''];
}

/** Answers as a student does who has read the lab right, and who has made one of the usual mistakes. */
async function answerAll(app: App, { id, question }: Step, answer: number, decimals: number): Promise<void> {
  const written = (value: number, more = 0) => value.toFixed(value === 0 ? 0 : decimals + more);
  const { unit = '' } = typeof question === 'object' ? question : {};
  const right = written(answer);
  for (const given of [right, right.replace('.', ','), right.replace('-', '−'), `${right} ${unit}`.trim()])
    expect(await answered(app, given), `${id}: ${given}`).toEqual([true, 'Right.']);
  if (answer === 0) return expect((await answered(app, 'zero'))[0]).toBe(true);
  for (const [given, why] of [
    [written(100 * answer), 'factor 100'],
    [written(answer / 100, 2), 'factor 100'],
    [written(-answer), 'the sign'],
    [`${right} kilometres`, 'unit'],
    ['zero', ''],
  ] as const) {
    const [isRight, says] = await answered(app, given);
    expect([isRight, says], `${id}: ${given}`).toEqual([false, expect.stringContaining(why)]);
  }
}

/** Matches a figure in German: points and commas in numbers are swapped, and its words are others. */
function inGerman(figure: string): RegExp {
  const swapped = figure.replace(/(?<=\d)[.,](?=\d)/g, (mark) => (mark === '.' ? ',' : '.'));
  const escaped = swapped.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');
  return new RegExp(escaped.replace(/\p{L}+( \p{L}+)*/gu, '\\p{L}+( \\p{L}+)*'), 'u');
}

/** Expects that the texts of a step state these figures, in each language of the lesson. */
function expectStated(lessons: Lesson[], id: string, figures: string[]): void {
  for (const { language, steps } of lessons) {
    const text = Object.values(steps.find((one) => one.id === id)?.parts ?? {}).join('\n');
    for (const figure of figures)
      if (language === 'de') expect(text, id).toMatch(inGerman(figure));
      else expect(text, id).toContain(figure);
  }
}

/** Expects that no step is ticked by the run of another one. */
function expectOwnTicks(steps: Step[], readings: Map<string, LabReading>): void {
  const records: Records = Object.fromEntries([...readings].map(([id, { measures }]) => [id, measures]));
  for (const { id, check } of steps)
    for (const [other, reading] of readings)
      if (check && readings.has(id)) expect(holds(check, reading, records), `${id} by ${other}`).toBe(id === other);
}

/**
 * Opens a lesson and does its steps, or those listed, with the settings that they offer. Fails if one is not ticked, is
 * beforehand, or is by the run of another; if its question is not answered by what the lab shows, or by something else;
 * and if a text states another figure than the lab.
 */
export async function doLesson(app: App, id: string, only?: readonly string[]): Promise<void> {
  const lessons = lessonsOf(id);
  const [{ steps }] = lessons;
  const [readings, shown] = [new Map<string, LabReading>(), new Map<string, Shown>()];
  const shownIn: ShownIn = (name) => (measure) => shown.get(name)?.(measure) ?? Number.NaN;
  await app.page.goto('about:blank');
  await app.page.goto(`${app.address}?lesson=${id}#extract?example=linked-rings&v=2`);
  await reach(app.page, 'done');
  for (const one of steps) {
    const { check, open, title, question } = one;
    await step(app).getByRole('heading', { name: title }).waitFor();
    if (check) expect(await step(app).locator('[data-ticked]').count(), title).toBe(0);
    if (!only || only.includes(one.id)) {
      if (check && open) await step(app).getByRole('button', { name: 'Do it for me' }).click();
      if (check) {
        await ticked(app);
        readings.set(one.id, await readingOf(app));
        shown.set(one.id, await shownBy(app));
      }
      const { answer, decimals = 0, stated } = REFERENCES[id]?.[one.id] ?? {};
      if (typeof question === 'object') await answerAll(app, one, answer?.(shownIn) ?? Number.NaN, decimals);
      expectStated(lessons, one.id, stated?.(shownIn) ?? []);
    }
    await step(app)
      .getByRole('button', { name: 'Next' })
      .evaluate((button: HTMLButtonElement) => button.click());
  }
  expectOwnTicks(steps, readings);
}
