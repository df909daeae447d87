/** Renders the Markdown of lessons, with formulas between dollar signs. Raw HTML is shown as text. */
import 'katex/dist/katex.min.css';
import katex from 'katex';
import MarkdownIt from 'markdown-it';

const FORMULA = /\$\$([^$]+)\$\$|\$((?:[^$\\\n]|\\.)+)\$/y;

const markdown = new MarkdownIt({ html: false, linkify: false }).disable('image');
markdown.inline.ruler.before('escape', 'formula', (state, silent) => {
  FORMULA.lastIndex = state.pos;
  const [found, display, inline = ''] = FORMULA.exec(state.src) ?? [];
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

/** Renders Markdown into an element; invalid formulas are shown as their source. */
export function renderMarkdown(source: string, element: HTMLElement): void {
  element.innerHTML = markdown.render(source);
  for (const span of element.querySelectorAll<HTMLElement>('[data-formula]')) {
    // KaTeX sets styles by script, which the page's content-security policy permits, unlike a style attribute in HTML.
    katex.render(span.textContent ?? '', span, {
      displayMode: span.dataset.formula === 'display',
      throwOnError: false,
      trust: false,
    });
  }
}
