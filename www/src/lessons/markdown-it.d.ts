/** The part of markdown-it that lessons use; the package has no types of its own. */
declare module 'markdown-it' {
  interface Token {
    type: string;
    tag: string;
    /** 1 for a beginning, −1 for an end, 0 for what has none. */
    nesting: number;
    /** Whether it is not rendered, as paragraphs in lists without empty lines. */
    hidden: boolean;
    children: Token[] | null;
    content: string;
    block: boolean;
    attrSet(name: string, value: string): void;
  }
  interface InlineState {
    src: string;
    pos: number;
    push(type: string, tag: string, nesting: number): Token;
  }
  interface Renderer {
    rules: Record<string, (tokens: Token[], index: number, options: object, env: unknown, self: Renderer) => string>;
    renderToken(tokens: Token[], index: number, options: object): string;
  }
  export default class MarkdownIt {
    constructor(options: { html: boolean; linkify: boolean });
    readonly inline: {
      ruler: { before(name: string, rule: string, apply: (state: InlineState, silent: boolean) => boolean): void };
    };
    readonly renderer: Renderer;
    readonly utils: { escapeHtml(text: string): string };
    disable(rule: string): this;
    parse(source: string, env: object): Token[];
    render(source: string): string;
  }
}
