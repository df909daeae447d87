/** The text of a lesson's step as elements, for the panel and the sheet. */
import { text } from '../texts';
import { h } from '../ui/dom';
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

/** Creates an element with a text in Markdown. */
export function prose(source: string): HTMLElement {
  const element = h('div', { class: 'prose' });
  renderMarkdown(source, element);
  return element;
}

/**
 * Returns the parts of a step as elements, by name; `unfolded` shows hint and explanation, too, and the teacher's answer
 * if `withAnswer`.
 */
export function partsOf(step: Step, unfolded = false, withAnswer = false): Partial<Record<Part, HTMLElement>> {
  const shown = PARTS.filter((part) => step.parts[part] && (part !== 'answer' || withAnswer));
  return Object.fromEntries(shown.map((part) => [part, partOf(part, step.parts[part] ?? '', unfolded)]));
}

function partOf(part: Part, source: string, unfolded: boolean): HTMLElement {
  const body = prose(source);
  if (part === 'goal') return body;
  if (FOLDED.includes(part) && !unfolded)
    return h('details', { 'data-part': part }, h('summary', {}, TITLES[part]), body);
  return h('div', { 'data-part': part }, h('h4', {}, TITLES[part]), body);
}
