/** The text of a lesson's step as elements, for the panel and the sheet. */

import { h } from '../kit/dom';
import { text } from '../texts';
import { PARTS, type Part, type Step } from './lesson';
import { renderMarkdown } from './markdown';

const TITLES: Record<Part, string> = {
  goal: text('lessons.goal'),
  do: text('lessons.do'),
  watch: text('lessons.watch'),
  check: text('lessons.check'),
  question: text('lessons.question'),
  hint: text('lessons.hint'),
  explanation: text('lessons.explanation'),
  answer: text('lessons.answer'),
};
/** Parts that are collapsed until the student opens them. */
const FOLDED: Part[] = ['hint', 'explanation'];

/** Creates an element with a text in Markdown, which is in the given language. */
export function prose(source: string, lang: string): HTMLElement {
  const element = h('div', { class: 'prose', lang });
  renderMarkdown(source, element);
  return element;
}

/**
 * Returns the parts of a step as elements, by name: for the panel, where hint and explanation are collapsed, or for a
 * sheet, which for teachers contains the answer, too.
 */
export function partsOf(step: Step, on: 'panel' | 'sheet' | 'teacher'): Partial<Record<Part, HTMLElement>> {
  const shown = PARTS.filter((part) => part !== 'answer' || on === 'teacher');
  const entries = shown.flatMap((part) => {
    const source = step.parts[part];
    return source ? [[part, partOf(part, prose(source, step.language), on === 'panel')]] : [];
  });
  return Object.fromEntries(entries);
}

function partOf(part: Part, body: HTMLElement, inPanel: boolean): HTMLElement {
  if (part === 'goal') return body;
  if (inPanel && FOLDED.includes(part))
    return h('details', { 'data-part': part }, h('summary', {}, TITLES[part]), body);
  return h('div', { 'data-part': part }, h(inPanel ? 'h4' : 'h3', {}, TITLES[part]), body);
}
