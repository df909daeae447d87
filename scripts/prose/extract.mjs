// The prose of a file: all of a Markdown file, comments and messages of a source file, the texts of a catalogue. Every line of it has
// the number of the line it is from.

/**
 * Returns the prose in `text` as documents `{ kind, ext, text }` whose lines are numbered like those of the file: `markdown`,
 * `comments` and `strings`. Files of other kinds have none.
 */
export function proseOf(path, text) {
  if (path.endsWith('.md')) return [{ kind: 'markdown', ext: '.md', text: markdown(path, text) }];
  if (path.endsWith('.json')) return [{ kind: 'strings', ext: '.txt', text: catalogue(text) }];
  const tokens = TOKENS.find(([ending]) => ending.test(path))?.[1];
  if (!tokens) return [];
  const { comments, strings } = read(text, tokens);
  const found = [{ kind: 'comments', ext: '.md', text: comments }];
  if (MESSAGES.test(path)) found.push({ kind: 'strings', ext: '.txt', text: strings });
  return found;
}

/** Where string literals are messages, labels and hints that users read. */
const MESSAGES = /^(src|js)\//;

/** Front matter without its fences and keys, so that its title is a paragraph; and a glossary without the words it rules out. */
const markdown = (path, text) => {
  const titled = text.replace(/^---\n([\s\S]*?)\n---\n/, (_, inside) => `\n${inside.replace(/^\w+: /gm, '')}\n\n`);
  return path.endsWith('glossary.md') ? titled.replace(NOT_COLUMN, '$1 |') : titled;
};

/** The last cell of a row with four cells. */
const NOT_COLUMN = /^(\|(?:[^|\n]*\|){3})[^|\n]*\|$/gm;

/** The texts of a catalogue, an object of sections of strings, each on its line. */
function catalogue(text) {
  const value = /"(?:[^"\\]|\\.)*"\s*:\s*("(?:[^"\\]|\\.)*")/;
  const textOf = (line) => {
    const found = line.match(value);
    return found ? JSON.parse(found[1]).replaceAll('\n', ' ') : '';
  };
  return text.split('\n').map(textOf).join('\n');
}

const JS_STRING = /'(?:[^'\\\n]|\\.)*'|"(?:[^"\\\n]|\\.)*"/y;
const LINE_COMMENT = /\/\/[^\n]*/y;

/** Kinds of tokens by a file's ending, in the order they are tried; what is none of them is skipped a character at a time. */
const TOKENS = [
  [
    /\.rs$/,
    [
      ['comment', LINE_COMMENT],
      ['comment', /\/\*[\s\S]*?\*\//y],
      ['skip', /b?r(#*)"[\s\S]*?"\1/y],
      ['skip', /b"(?:[^"\\]|\\[\s\S])*"/y],
      ['string', /"(?:[^"\\]|\\[\s\S])*"/y],
      ['skip', /'(?:[^'\\\n]|\\[^\n]+?)'/y],
      ['skip', /\w+/y],
    ],
  ],
  [
    /\.[mc]?[jt]s$/,
    [
      ['comment', LINE_COMMENT],
      ['comment', /\/\*[\s\S]*?\*\//y],
      ['string', JS_STRING],
      ['template', /`/y],
      // An expression follows none of the characters after which `/` divides.
      [
        'skip',
        /(?<=(?:^|[(,=:[!&|?{};+>~\n]|\breturn)\s*)\/(?![/*])(?:[^/\\[\n]|\\.|\[(?:[^\]\\\n]|\\.)*\])+\/[a-z]*/y,
      ],
      ['skip', /[\w$]+/y],
    ],
  ],
  [
    /\.py$/,
    [
      ['comment', /#[^\n]*/y],
      ['comment', /"""[\s\S]*?"""/y],
      ['skip', JS_STRING],
      ['skip', /\w+/y],
    ],
  ],
  [
    /\.css$/,
    [
      ['comment', /\/\*[\s\S]*?\*\//y],
      ['skip', JS_STRING],
    ],
  ],
  [
    /\.(toml|ya?ml)$|(^|\/)run$/,
    [
      ['skip', JS_STRING],
      ['comment', /(?<=^|\s)#[^\n]*/y],
    ],
  ],
];

/** Sorts the text of a source file into comments and strings. */
function read(text, tokens) {
  const count = text.split('\n').length;
  const pages = { comment: Array(count).fill(''), string: Array(count).fill('') };
  let at = 0;
  let line = 0;
  const advance = (length) => {
    for (const end = at + length; at < end; at++) if (text[at] === '\n') line++;
  };
  while (at < text.length) {
    const [kind, found] = next(text, at, tokens);
    if (kind === 'comment')
      for (const [i, part] of found.split('\n').entries()) add(pages.comment, line + i, bare(part));
    if (kind === 'string' && isProse(found)) add(pages.string, line, literal(found));
    advance(found.length);
  }
  return { comments: pages.comment.join('\n'), strings: pages.string.join('\n') };
}

function next(text, at, tokens) {
  for (const [kind, pattern] of tokens) {
    pattern.lastIndex = at;
    const found = pattern.exec(text)?.[0];
    if (found) return kind === 'template' ? ['string', template(text, at)] : [kind, found];
  }
  return ['skip', text[at]];
}

/** A template literal from its first backtick to its last one, with all that is within. */
function template(text, start) {
  let depth = 0;
  for (let i = start + 1; i < text.length; i++) {
    if (text[i] === '\\') i++;
    else if (text[i] === '$' && text[i + 1] === '{') depth++;
    else if (text[i] === '}' && depth > 0) depth--;
    else if (text[i] === '`' && depth === 0) return text.slice(start, i + 1);
    else if (text[i] === '`') i += template(text, i).length - 1;
  }
  return text.slice(start);
}

/** Two texts on one line are two paragraphs to the rules, which stop at this mark. */
const SEPARATOR = ' ¶ ';

function add(lines, index, text) {
  lines[index] = lines[index] && text ? lines[index] + SEPARATOR + text : lines[index] || text;
}

/** A line of a comment without its mark and, so that it is no block of code in Markdown, without the indentation before it. */
const bare = (line) =>
  line.replace(/^\s*(\/\/[/!]?|\/\*[*!]?|\*\/|\*(?!\*)|#+|""")? ?/, '').replace(/\s*(\*\/|""")$/, '');

/** The text of a string on one line; code in it and escapes are left out. */
const literal = (found) =>
  found
    .slice(1, -1)
    .replace(/\\\r?\n\s*/g, '')
    .replace(/\$?\{[^{}]*\}/g, '…')
    .replace(/\\[nrt]|\s+/g, ' ')
    .replace(/\\(.)/g, '$1');

/** Whether a literal has three words or more: names, keys and code hardly ever have. */
const isProse = (found) => /[A-Za-z’'),;:]\s+\S*[A-Za-z]\S*\s+\S*[A-Za-z]/.test(found);
