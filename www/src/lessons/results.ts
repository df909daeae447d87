/** A student's results as one file: a page to read, which contains the same results as JSON. */

import { h } from '../kit/dom';
import { LANGUAGE, text } from '../texts';
import { shownValue } from './format';
import type { Lesson, Step } from './lesson';
import { completeSteps, isAnswered, isComplete, type Progress } from './progress';

const STYLE = `body { font: 15px/1.5 system-ui, sans-serif; max-width: 48em; margin: 2em auto; padding: 0 1em }
section { border-top: 1px solid #bbb } dl { display: grid; grid-template-columns: auto 1fr; gap: 0 1em } dd { margin: 0 }`;

/** Returns the results as an HTML file; `label` returns that of a measure by its name. */
export function resultsFile(lesson: Lesson, progress: Progress, label: (measure: string) => string): string {
  const page = document.implementation.createHTMLDocument(text('lessons.resultsOf', { title: lesson.title }));
  page.documentElement.lang = lesson.language;
  // Within JSON, this is the same character, but ends no element.
  const data = JSON.stringify(resultsData(lesson, progress), null, 1).replaceAll('<', '\\u003c');
  page.head.append(h('meta', { charset: 'utf-8' }));
  page.body.append(
    h('h1', {}, page.title),
    h('p', {}, progress.name),
    h('p', {}, text('lessons.progress', { done: completeSteps(lesson, progress), steps: lesson.steps.length })),
    ...lesson.steps.map((step, index) => stepResult(step, index + 1, progress, label)),
    h('script', { type: 'application/json', id: 'results' }, data),
  );
  // As an element, this page's security policy would forbid the style.
  const html = page.documentElement.outerHTML.replace('</head>', `<style>${STYLE}</style></head>`);
  return `<!doctype html>\n${html}\n`;
}

function resultsData(lesson: Lesson, progress: Progress): unknown {
  const steps = lesson.steps.map((step) => ({
    id: step.id,
    title: step.title,
    complete: isComplete(step, progress),
    ...progress.ticks[step.id],
    ...(step.question && { answer: progress.answers[step.id] ?? '', answered: isAnswered(step, progress) }),
  }));
  return { lesson: lesson.id, title: lesson.title, name: progress.name, saved: new Date().toISOString(), steps };
}

function stepResult(step: Step, number: number, progress: Progress, label: (measure: string) => string): HTMLElement {
  const tick = progress.ticks[step.id];
  const measures = Object.entries(tick?.measures ?? {}).flatMap(([name, value]) => [
    h('dt', {}, label(name)),
    h('dd', {}, shownValue(value)),
  ]);
  const answer = step.question && [
    h('p', {}, h('em', {}, step.parts.question ?? '')),
    h('p', {}, `${progress.answers[step.id] ?? ''} `, h('em', {}, verdict(step, progress))),
  ];
  return h(
    'section',
    {},
    h(
      'h2',
      {},
      `${isComplete(step, progress) ? '✓' : '○'} ${text('lessons.stepTitle', { number, title: step.title })}`,
    ),
    ...(tick
      ? [
          h(
            'p',
            {},
            h('a', { href: tick.link }, text('lessons.openState')),
            ` (${new Date(tick.at).toLocaleString(LANGUAGE)})`,
          ),
          h('dl', {}, ...measures),
          ...(tick.warnings ?? []).map((words) => h('p', { class: 'warning' }, `⚠ ${words}`)),
        ]
      : []),
    ...(answer ?? []),
  );
}

/** Tells whether the answer to a question about a number is right; empty for other questions. */
function verdict(step: Step, progress: Progress): string {
  if (step.question === 'text' || !progress.answers[step.id]) return '';
  return text(isAnswered(step, progress) ? 'lessons.right' : 'lessons.notRight');
}
