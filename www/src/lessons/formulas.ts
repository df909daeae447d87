/** Markdown of lessons, as far as it is parsed: with formulas between dollar signs. Raw HTML is shown as text. */
import MarkdownIt, { type Token } from 'markdown-it';
import { FORMULA } from './bounds';

const FORMULA_HERE = new RegExp(FORMULA, 'y');

export const markdown = new MarkdownIt({ html: false, linkify: false }).disable('image');
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

/**
 * Returns the formulas in a text, those that are typeset, and its number of elements. Dollar signs in code, for example,
 * are no formulas.
 */
export function partsOf(source: string): { formulas: string[]; elements: number } {
  const blocks = markdown.parse(source, {});
  const inline = blocks.flatMap(({ children }) => children ?? []);
  const formulas = inline.filter(({ type }) => type === 'formula').map(({ content }) => content);
  return { formulas, elements: [...blocks, ...inline].filter(isElement).length };
}

/** Whether a token is an element, not its end, its text or what is in it. */
const isElement = ({ nesting, tag, hidden, type }: Token): boolean =>
  nesting >= 0 && tag !== '' && !hidden && type !== 'softbreak';
