/** Lessons' answers and figures are those of their runs: the runs of some seconds; `lessons.long.test.ts` does all. */
import { afterAll, beforeAll, expect, test } from 'vitest';
import { type App, openApp, reach, unfold } from './browser';
import { doLesson, ticked } from './lesson-steps';
import { LONG } from './long';

let app: App;

beforeAll(async () => {
  app = await openApp({ width: 1400, height: 900 });
});
afterAll(() => app.close());

test.each([
  ['coarse-to-fine', ['direct', 'pyramid', 'levels']],
  ['forces', ['free', 'spring', 'membrane', 'ratio']],
  ['regularisation', ['balanced']],
  ['heart', ['truth']],
  ['detail', ['map', 'too-far']],
] as const)('%s has the answers and the figures of its runs', async (id, steps) => {
  await doLesson(app, id, steps);
  expect(app.complaints).toEqual([]);
});

/** Opens a lesson that is not begun beside a lab, which has come to its end. */
async function openNew(id: string, lab: string): Promise<void> {
  await app.page.evaluate(() => localStorage.clear());
  await app.page.goto('about:blank');
  await app.page.goto(`${app.address}?lesson=${id}#${lab}`);
  await reach(app.page, 'done');
}

/** Enters a value of a parameter, as a student does. */
async function enter(param: string, value: string): Promise<void> {
  const field = app.page.locator(`#lab [data-param=${param}] input`);
  await field.first().fill(value);
  await field.first().press('Enter');
}

test('a finished run does not tick a step whose settings were just entered: their own run does', async () => {
  await openNew('forces', 'extract?example=linked-rings&v=2');
  for (const param of ['rigidity', 'stiffness', 'adaptivity']) {
    await enter(param, '0');
    await app.page.locator('#lab[data-state=done]:not([data-changing])').waitFor();
  }
  await ticked(app);
  const [recorded, shown] = await app.page.evaluate(() => [
    JSON.parse(localStorage.getItem('vesicle.lesson.forces') ?? '{}').ticks.free.measures.volume,
    JSON.parse(document.querySelector<HTMLElement>('#lab [data-measures]')?.dataset.measures ?? '{}').volume,
  ]);
  expect(recorded).toBe(shown);
});

test('more passes of D are seen as the lesson says, after reloading', LONG, async () => {
  await openNew('detail', 'sculpt?example=figure-10');
  const next = () => app.page.locator('#lesson .lesson-step').getByRole('button', { name: 'Next' }).click();
  await next();
  await ticked(app);
  await next();
  await unfold(app.page);
  await enter('distribute', '10');
  await app.page.waitForURL(/distribute=10/);
  await app.page.reload();
  await ticked(app);
});
