import type { Result } from 'axe-core';
import axe from 'axe-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, LABS, open, openApp, QUICK, RUNNING, reach, unfold } from './browser';
import { inOneLab, LONG } from './long';

/** The rules of WCAG 2.2 up to level AA, best practices, and axe's experimental rules. */
const TAGS = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice', 'experimental'];
const WIDE = { width: 1280, height: 800 };
const NARROW = { width: 390, height: 844 };
/** Each colour scheme and each size. */
const LOOKS = [
  { colorScheme: 'light', size: WIDE },
  { colorScheme: 'dark', size: NARROW },
] as const;
/** Their other combinations. */
const OTHER_LOOKS = [
  { colorScheme: 'dark', size: WIDE },
  { colorScheme: 'light', size: NARROW },
] as const;
type Look = (typeof LOOKS)[number] | (typeof OTHER_LOOKS)[number];

let app: App;

beforeAll(async () => {
  app = await openApp(WIDE, 'bench.html');
  // Before the page's own scripts, since its policy does not allow later ones.
  await app.page.addInitScript({ content: axe.source });
  // Pauses the playback of Track's frames.
  await app.page.emulateMedia({ reducedMotion: 'reduce' });
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

/** Returns axe's findings for a part of the page in its current state, one line each. */
function violations(part: string): Promise<string[]> {
  return app.page.evaluate(
    async ([part, values]) => {
      const { axe } = window as unknown as { axe: { run: (...given: unknown[]) => Promise<{ violations: Result[] }> } };
      const found = await axe.run(part, { resultTypes: ['violations'], runOnly: { type: 'tag', values } });
      return found.violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html.slice(0, 200)}`));
    },
    [part, TAGS] as const,
  );
}

/** Fails with all findings for a part of the page in the given colour schemes. */
async function expectNothing(part = 'html', looks: readonly Look[] = LOOKS): Promise<void> {
  for (const { colorScheme, size } of looks) {
    await app.page.emulateMedia({ colorScheme });
    await app.page.setViewportSize(size);
    await app.page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    expect(await violations(part), `${colorScheme}, ${size.width} wide`).toEqual([]);
  }
}

/** Addresses of runs that take longer than the check does, also on a busy machine. */
const LONG_RUNS: Partial<typeof QUICK> = {
  extract: 'extract?p.timeStep=0.05&v=2',
  reconstruct: 'reconstruct?maxPoints=30000',
};

test('lessons: the list, an open one with everything unfolded, and its sheets', LONG, async () => {
  await open(app, QUICK.extract);
  await reach(app.page, 'done');
  await app.page.getByRole('button', { name: 'Lessons' }).click();
  await app.page.locator('.lesson-list li').nth(5).waitFor();
  await expectNothing('.lesson');
  await app.page.locator('.lesson-list button').first().click();
  await app.page.locator('.lesson-step').waitFor();
  await unfold(app.page);
  await expectNothing();
  for (const view of ['sheet', 'teacher']) {
    await app.page.goto(`${app.address}?lesson=forces&view=${view}`);
    await app.page.locator('.lesson-sheet section').first().waitFor();
    await expectNothing();
  }
});

describe.each(LABS)('the %s lab', (lab) => {
  // Segment only runs for moments, after a stroke.
  test.runIf(RUNNING.includes(lab))('has no violations while it runs', inOneLab(lab), async () => {
    await open(app, LONG_RUNS[lab] ?? lab);
    await reach(app.page, 'running');
    await expectNothing('html', [OTHER_LOOKS[0]]);
    expect(await app.page.getAttribute('[data-state]', 'data-state')).toBe('running');
  });

  /** Checks the lab when it is done, with everything expanded, and a message. */
  async function expectNothingWhenDone(looks: readonly Look[]): Promise<void> {
    await open(app, QUICK[lab]);
    await reach(app.page, 'done');
    await app.page.evaluate((address) => {
      location.hash = address;
    }, `${lab}?example=nowhere`);
    await app.page.waitForSelector('.banner:not([hidden])');
    await unfold(app.page);
    await expectNothing('html', looks);
  }

  test('has no violations when it is done and everything is expanded, nor in its message', inOneLab(lab), () =>
    expectNothingWhenDone(LOOKS),
  );

  test('has none in other looks either', LONG, () => expectNothingWhenDone(OTHER_LOOKS));

  test('has no violations in its list of keyboard shortcuts', LONG, async () => {
    await open(app, QUICK[lab]);
    await reach(app.page, 'done');
    await app.page.click('#help');
    await expectNothing('dialog');
  });
});

test('the benchmark page has no violations', LONG, async () => {
  await app.page.goto(`${app.address}bench.html`);
  await app.page.waitForSelector('[data-bench]');
  await unfold(app.page);
  await expectNothing();
});
