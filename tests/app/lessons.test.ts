/** Lessons in the browser: done by the interface, opened from files and addresses, saved, printed, and in German. */
import { readFile } from 'node:fs/promises';
import { zipSync } from 'three/addons/libs/fflate.module.js';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, drop, openApp, overflow, reach } from './browser';
import { doLesson, ticked as tickedIn } from './lesson-steps';
import { LONG } from './long';

let app: App;

beforeAll(async () => {
  app = await openApp({ width: 1400, height: 900 }, '#extract?example=linked-rings&v=2');
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const panel = () => app.page.locator('#lesson');
const step = () => panel().locator('.lesson-step');
const answerField = () => step().getByRole('textbox');
const ticked = () => tickedIn(app);
const next = () => step().getByRole('button', { name: 'Next' }).click();
const complete = () => panel().locator('.lesson-steps button', { hasText: '✓' }).count();

async function goTo(address: string): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(app.address + address);
}

/** Answers the question of the step that is shown and commits the answer, as a student does. */
async function answer(given: string): Promise<void> {
  await answerField().fill(given);
  await answerField().press('Tab');
}

/** Chooses an example in the open lab. */
const choose = (id: string) => app.page.selectOption('.data select', id);

describe('topology and χ, by the interface of the lab alone', () => {
  test('the list shows six lessons, and the first opens beside the lab', async () => {
    await app.page.getByRole('button', { name: 'Lessons' }).click();
    await panel().locator('.lesson-list li').nth(5).waitFor();
    expect(await panel().locator('.lesson-list li').count()).toBe(6);
    await panel().getByRole('button', { name: 'Open Topology and χ' }).press('Enter');
    expect(await panel().locator('h2').textContent()).toBe('Topology and χ');
    expect(await step().locator('.katex').count()).toBeGreaterThan(0);
    expect(new URL(app.page.url()).searchParams.get('lesson')).toBe('topology');
  });

  test('a step that is not ticked says why', async () => {
    const missing = () => panel().locator('.lesson-check .help').textContent();
    expect(await missing()).toMatch(/^Not yet\. The example “Figure 24: .*” is not open\.$/);
  });

  test('the page is not longer for what the panel hides', async () => {
    const { page } = app;
    await panel().getByText('Results', { exact: true }).click();
    expect(await page.evaluate(() => document.documentElement.scrollHeight - innerHeight)).toBeLessThanOrEqual(0);
    await panel().getByText('Results', { exact: true }).click();
  });

  test('a step is ticked and announced when the lab shows what it expects, and a wrong answer is told from a right one', async () => {
    expect(await step().locator('[data-ticked]').count()).toBe(0);
    await choose('figure-24');
    await ticked();
    await expect.poll(() => panel().locator('[role=status]').allTextContents()).toContain('Step 1 is ticked.');
    await answer('12');
    await step().getByText('Not yet. The hint may help.').waitFor();
    const measured = JSON.parse((await app.page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
    // As the table writes numbers, and with the button, which does not move away when the pointer leaves the field.
    await answerField().fill((1.5 * measured.triangles).toLocaleString('en'));
    await step().getByRole('button', { name: 'Check' }).click();
    await step().getByText('Right.').waitFor();
    expect(await complete()).toBe(1);
  });

  test('all its steps are complete at the end', async () => {
    await next();
    expect(await app.page.evaluate(() => document.activeElement?.textContent)).toBe('2. Three parts');
    await app.page.getByRole('button', { name: 'd: 0.75' }).click();
    await ticked();
    await answer('10');
    for (const [example, given] of [
      ['linked-rings', '2'],
      ['figure-7', '−2'],
      ['sponge', '81'],
    ] as const) {
      await next();
      await choose(example);
      await ticked();
      await answer(given);
    }
    await next();
    await answer('The genus is 5 and 109.');
    expect(await complete()).toBe(6);
  });

  test('progress survives another lab and a new visit', async () => {
    await app.page.locator('#labs [data-lab=reconstruct]').click();
    await app.page.locator('#lab[data-state=done]').waitFor();
    expect(await complete()).toBe(6);
    await goTo('?lesson=topology#extract?example=linked-rings&v=2');
    await expect.poll(complete).toBe(6);
    expect(await answerField().inputValue()).toBe('The genus is 5 and 109.');
  });

  test('results are saved as one page that contains them as JSON', async () => {
    await panel().getByText('Results', { exact: true }).click();
    await panel().getByLabel('Name').fill('Ada <b>');
    await panel().getByLabel('Name').press('Tab');
    const [download] = await Promise.all([
      app.page.waitForEvent('download'),
      panel().getByRole('button', { name: 'Save results' }).click(),
    ]);
    expect(download.suggestedFilename()).toBe('topology-results.html');
    const html = await readFile(await download.path(), 'utf8');
    const viewer = await app.page.context().newPage();
    await viewer.setContent(html);
    const { name, steps } = JSON.parse((await viewer.textContent('#results')) ?? '');
    const text = (await viewer.locator('body > p').allTextContents()).join();
    await viewer.close();
    expect([name, steps.length]).toEqual(['Ada <b>', 6]);
    expect(steps[4]).toMatchObject({ id: 'sponge', complete: true, answer: '81', measures: { chi: -160, genus: 81 } });
    expect(html).toContain(steps[4].measures.triangles.toLocaleString('en'));
    expect(steps[4].link).toContain('?lesson=topology#extract?example=sponge');
    expect(text).toContain('6 of 6 steps complete');
    expect(text).toContain('Ada <b>');
  });

  test('the sheet has ticks and answers of the student, but not those for teachers; the teacher’s page has', async () => {
    await goTo('?lesson=topology&view=sheet');
    const sheet = app.page.locator('.lesson-sheet');
    await sheet.locator('section').nth(5).waitFor();
    expect(await sheet.locator('[data-ticked]').count()).toBe(5);
    expect(await sheet.locator('.room').last().textContent()).toBe('The genus is 5 and 109.');
    expect(await sheet.locator('[data-part=answer]').count()).toBe(0);
    expect(await app.page.locator('#lab').count()).toBe(0);
    await goTo('?lesson=topology&view=teacher');
    await expect.poll(() => sheet.locator('[data-part=answer]').count()).toBe(6);
    expect(await sheet.textContent()).toContain('Expected number: 81');
  });

  test('start again deletes ticks and answers, once that is confirmed', async () => {
    await goTo('?lesson=topology#extract?example=linked-rings&v=2');
    await panel().getByText('Results', { exact: true }).click();
    app.page.once('dialog', (dialog) => dialog.dismiss());
    await panel().getByRole('button', { name: 'Start again' }).click();
    expect(await complete()).toBe(6);
    app.page.once('dialog', (dialog) => dialog.accept());
    await panel().getByRole('button', { name: 'Start again' }).click();
    expect(await complete()).toBe(0);
  });
});

test('detail on a base is ticked step by step with its settings', LONG, () => doLesson(app, 'detail'));

describe('lessons of the user', () => {
  const data = {
    id: 'mine',
    languages: ['en'],
    minutes: 5,
    steps: [{ id: 'a', check: { state: 'done' }, open: 'extract?example=linked-rings&v=2' }],
  };
  const files = (change = {}) => [
    { name: 'lesson.json', bytes: Buffer.from(JSON.stringify({ ...data, ...change })) },
    {
      name: 'text.en.md',
      bytes: Buffer.from(
        '# Mine\n\n<img src=x onerror=alert(1)> [x](javascript:alert(1))\n\n## Only step\n\n### check\n\nDone: $\\href{javascript:alert(1)}{x}$\n',
      ),
    },
  ];
  const dropOnPanel = (list: { name: string; bytes: Uint8Array }[]) => drop(app.page, list, '#lesson');

  test('are dropped on the panel; HTML in them is text, and the lab keeps its volume', async () => {
    await goTo('#extract?example=linked-rings&v=2');
    await reach(app.page, 'done');
    await app.page.getByRole('button', { name: 'Lessons' }).click();
    await panel().locator('.lesson-list li').nth(5).waitFor();
    await dropOnPanel(files());
    await step().getByRole('heading', { name: 'Only step' }).waitFor();
    await ticked();
    expect(await panel().locator('img, a[href^=javascript]').count()).toBe(0);
    expect(await app.page.getAttribute('#lab', 'data-state')).toBe('done');
    await app.page.reload();
    await step().getByRole('heading', { name: 'Only step' }).waitFor();
  });

  test('with an error are refused with what is accepted, and the open lesson stays', async () => {
    await dropOnPanel(files({ steps: [{ id: 'a', check: { states: 'done' } }] }));
    await expect
      .poll(() => panel().locator('.field-error').textContent())
      .toMatch(/step 1: .*states.*all,any,not,lab,state/);
    expect(await panel().locator('h2').textContent()).toBe('Mine');
  });

  test('are opened from a ZIP archive with a folder in it', LONG, async () => {
    const entries = files({ id: 'zipped' }).map(({ name, bytes }) => [`folder/${name}`, new Uint8Array(bytes)]);
    await goTo('?lesson=topology#extract?example=linked-rings&v=2');
    await panel().getByRole('button', { name: 'All lessons' }).click();
    await panel().locator('.lesson-list li').nth(5).waitFor();
    const buffer = Buffer.from(zipSync(Object.fromEntries(entries)));
    await panel().locator('input[type=file]').setInputFiles({ name: 'mine.zip', mimeType: 'application/zip', buffer });
    await step().getByRole('heading', { name: 'Only step' }).waitFor();
    expect(await panel().locator('.field-error').textContent()).toBe('');
  });

  test('with many formulas are typeset in parts, between which the page answers', async () => {
    const formula = `$${'\\sqrt2'.repeat(160)}$`;
    const bytes = Buffer.from(`# Mine\n\n## Only step\n\n${Array.from({ length: 15 }, () => formula).join(' ')}\n`);
    const [lesson = files()[0]] = files({ steps: [{ id: 'a' }] });
    await app.page.evaluate(() => {
      const counts: number[] = [];
      const count = () => {
        counts.push(document.querySelectorAll('#lesson .katex').length);
        requestAnimationFrame(count);
      };
      count();
      Object.assign(window, { counts });
    });
    await dropOnPanel([lesson as { name: string; bytes: Buffer }, { name: 'text.en.md', bytes }]);
    await expect.poll(() => step().locator('.katex').count()).toBe(15);
    const counts = await app.page.evaluate(() => (window as unknown as { counts: number[] }).counts);
    const parts = counts.map((count, k) => count - (counts[k - 1] ?? 0));
    expect(Math.max(...parts)).toBeLessThan(5);
  });

  test('that are dropped elsewhere are not read as data: the message says where they belong', async () => {
    const entries = files().map(({ name, bytes }) => [`folder/${name}`, new Uint8Array(bytes)]);
    const zip = { name: 'mine.zip', bytes: Buffer.from(zipSync(Object.fromEntries(entries))) };
    for (const list of [[zip], files()]) {
      await drop(app.page, list);
      await expect.poll(() => app.page.textContent('.banner')).toContain('This is a lesson.');
      await app.page.locator('.banner').getByRole('button', { name: 'Dismiss' }).click();
      expect(await app.page.getAttribute('#lab', 'data-state')).toBe('done');
    }
  });

  test('at an address that has none, the list says so', LONG, async () => {
    await goTo('?lesson=lessons/none/#extract?example=linked-rings&v=2');
    await expect.poll(() => panel().locator('.field-error').textContent()).toContain('404');
    await panel().locator('.lesson-list li').nth(5).waitFor();
    expect(app.complaints.splice(0).join()).toContain('404');
  });
});

describe('in German', LONG, () => {
  test('the page, the lab and the lesson are translated; the choice is kept', async () => {
    await goTo('?lesson=topology&lang=de#extract?example=figure-24&v=2');
    await ticked();
    expect(await app.page.getAttribute('html', 'lang')).toBe('de');
    expect(await panel().locator('h2').textContent()).toBe('Topologie und χ');
    expect(await app.page.locator('dt', { hasText: 'Euler-Charakteristik' }).count()).toBe(1);
    // The page asks first, since results are lost.
    await app.page.evaluate(() => {
      document.documentElement.dataset.asked = '';
    });
    const question = app.page.locator('dialog.question');
    await app.page.selectOption('#language', 'en');
    await question.getByRole('button', { name: 'Bleiben' }).click();
    expect(await app.page.inputValue('#language')).toBe('de');
    await app.page.selectOption('#language', 'en');
    await question.getByRole('button', { name: 'Verlassen' }).click();
    await expect.poll(() => app.page.getAttribute('html', 'lang')).toBe('en');
    await app.page.selectOption('#language', 'de');
    await panel().getByText('Topologie und χ').waitFor();
    await goTo('#extract?example=linked-rings&v=2');
    await app.page.getByRole('button', { name: 'Lektionen' }).waitFor();
  });

  test('English fetches no translation', async () => {
    const fetched: string[] = [];
    app.page.on('request', (request) => fetched.push(request.url()));
    await goTo('?lang=en#extract?example=linked-rings&v=2');
    await reach(app.page, 'done');
    expect(fetched.filter((url) => /assets\/(de|panel|katex)-/i.test(url))).toEqual([]);
    expect(fetched.length).toBeGreaterThan(5);
  });
});

test('on a phone the panel is above the lab, nothing is wider than the page, and it can be hidden', LONG, async () => {
  for (const language of ['de', 'en']) {
    await goTo(`?lesson=topology&lang=${language}#extract?example=linked-rings&v=2`);
    await step().waitFor();
    expect(await overflow(app.page, 390, 844)).toBeLessThanOrEqual(0);
  }
  const [above, lab] = [await panel().boundingBox(), await app.page.locator('#lab').boundingBox()];
  expect((above?.y ?? 0) + (above?.height ?? 0)).toBeLessThanOrEqual(lab?.y ?? 0);
  await panel().getByRole('button', { name: 'Hide' }).click();
  expect(await panel().isVisible()).toBe(false);
  expect(await app.page.evaluate(() => document.activeElement?.id)).toBe('lessons');
});
