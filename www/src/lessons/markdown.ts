/** Renders the Markdown of lessons, with formulas between dollar signs. Raw HTML is shown as text. */
import 'katex/dist/katex.min.css';
import katex from 'katex';
import MarkdownIt from 'markdown-it';
import { FORMULA, isTypeset } from './bounds';

const FORMULA_HERE = new RegExp(FORMULA, 'y');

/** Most commands that a formula may expand, and largest length, in em. */
const KATEX_BOUNDS = { maxExpand: 300, maxSize: 20 };

const markdown = new MarkdownIt({ html: false, linkify: false }).disable('image');
markdown.inline.ruler.before('escape', 'formula', (state, silent) => {
  FORMULA_HERE.lastIndex = state.pos;
  const [found, display, inline = ''] = FORMULA_HERE.exec(state.src) ?? [];
  if (!found) return false;
  if (!silent) {
    const token = state.push('formula', 'span', 0);
    token.content = display ?? inline;
    token.block = display !== undefined;
  }
  state.pos += found.length;
  return true;
});
markdown.renderer.rules.formula = (tokens, index) => {
  const { content = '', block } = tokens[index] ?? {};
  return `<span data-formula="${block ? 'display' : 'inline'}">${markdown.utils.escapeHtml(content)}</span>`;
};
markdown.renderer.rules.link_open = (tokens, index, options, _, renderer) => {
  tokens[index]?.attrSet('target', '_blank');
  tokens[index]?.attrSet('rel', 'noopener');
  return renderer.renderToken(tokens, index, options);
};

/** Renders Markdown into an element; invalid formulas, and those that define commands, are shown as their source. */
export function renderMarkdown(source: string, element: HTMLElement): void {
  element.innerHTML = markdown.render(source);
  for (const span of element.querySelectorAll<HTMLElement>('[data-formula]')) {
    const formula = span.textContent ?? '';
    if (!isTypeset(formula)) continue;
    // KaTeX sets styles by script, which the page's content-security policy permits, unlike a style attribute in HTML.
    katex.render(formula, span, {
      ...KATEX_BOUNDS,
      displayMode: span.dataset.formula === 'display',
      throwOnError: false,
      trust: false,
    });
  }
}
