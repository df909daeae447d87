import { readFileSync } from 'node:fs';
import { expect } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { type Lesson, parseLesson } from '../../www/src/lessons/lesson';
import { type App, reach } from './browser';

const step = ({ page }: App) => page.locator('#lesson .lesson-step');

/** Waits until the step that is shown is ticked. */
export const ticked = (app: App) => step(app).locator('[data-ticked]').waitFor({ timeout: 240_000 });

function lessonOf(id: string): Lesson {
  const file = (name: string) => readFileSync(at(`www/public/lessons/${id}/${name}`), 'utf8');
  return parseLesson({ 'lesson.json': file('lesson.json'), 'text.en.md': file('text.en.md') }, 'en');
}

/** Opens a lesson and does its steps with the settings that they offer; fails if one is not ticked, or is beforehand. */
export async function doLesson(app: App, id: string): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(`${app.address}?lesson=${id}#extract?example=linked-rings&v=2`);
  await reach(app.page, 'done');
  for (const { check, open, title } of lessonOf(id).steps) {
    await step(app).getByRole('heading', { name: title }).waitFor();
    if (check) expect(await step(app).locator('[data-ticked]').count(), title).toBe(0);
    if (check && open) await step(app).getByRole('button', { name: 'Do it for me' }).click();
    if (check) await ticked(app);
    await step(app)
      .getByRole('button', { name: 'Next' })
      .evaluate((button: HTMLButtonElement) => button.click());
  }
}
