/** Renders the Markdown of lessons, and typesets its formulas. */
import 'katex/dist/katex.min.css';
import katex from 'katex';
import { isTypeset } from './bounds';
import { markdown } from './formulas';

/** Most commands that a formula may expand, and largest length, in em. */
const KATEX_BOUNDS = { maxExpand: 300, maxSize: 20 };

markdown.renderer.rules.formula = (tokens, index) => {
  const { content = '', block } = tokens[index] ?? {};
  return `<span data-formula="${block ? 'display' : 'inline'}">${markdown.utils.escapeHtml(content)}</span>`;
};
markdown.renderer.rules.link_open = (tokens, index, options, _, renderer) => {
  tokens[index]?.attrSet('target', '_blank');
  tokens[index]?.attrSet('rel', 'noopener');
  return renderer.renderToken(tokens, index, options);
};

/**
 * Elements of formulas that are typeset in a frame: the browser needs .1 s to lay them out where boxes are nested, and what
 * most lessons have in all is less.
 */
const MOST_IN_FRAME = 2_000;

/** Formulas that are still to be typeset, in this order. */
let waiting: HTMLElement[] = [];
/** Elements for which there is room in this frame. */
let room = MOST_IN_FRAME;

/**
 * Renders Markdown into an element; invalid formulas, and those that define commands, are shown as their source. So are
 * those beyond what fits into a frame, until one of the next, so that the page answers in between.
 */
export function renderMarkdown(source: string, element: HTMLElement): void {
  element.innerHTML = markdown.render(source);
  waiting.push(...element.querySelectorAll<HTMLElement>('[data-formula]'));
  typesetWaiting();
}

/** Typesets formulas as long as there is room in this frame. */
function typesetWaiting(): void {
  const before = room;
  while (room > 0 && waiting.length > 0) room -= typeset(waiting.shift() as HTMLElement);
  // The first in a frame makes room in the next.
  if (before === MOST_IN_FRAME && room < before) requestAnimationFrame(() => setTimeout(continueTypesetting));
}

function continueTypesetting(): void {
  room = MOST_IN_FRAME;
  // Those of another step or lesson that was shown meanwhile are left.
  waiting = waiting.filter(({ isConnected }) => isConnected);
  typesetWaiting();
}

/** Typesets a formula; returns the number of elements that it has then, at least 1. */
function typeset(span: HTMLElement): number {
  const formula = span.textContent ?? '';
  if (!isTypeset(formula)) return 1;
  // KaTeX sets styles by script, which the page's content-security policy permits, unlike a style attribute in HTML.
  katex.render(formula, span, {
    ...KATEX_BOUNDS,
    displayMode: span.dataset.formula === 'display',
    throwOnError: false,
    trust: false,
  });
  return 1 + span.getElementsByTagName('*').length;
}
