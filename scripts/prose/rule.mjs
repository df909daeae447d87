// The textlint rule: finds the phrases it is given in the running text of paragraphs, headings and cells of tables.

/** The character that replaces code and addresses before phrases are matched: neither word nor space nor punctuation. */
const HIDDEN = '\u2060';
const HIDDEN_NODES = new Set(['Code', 'Html', 'Image', 'FootnoteReference']);

/** Reports each phrase of `options.phrases` that is in the text and not one of its exceptions. */
export function phraseRule({ Syntax, RuleError, report, getSource, locator }, { phrases }) {
  const check = (node) => {
    const text = runningText(node, getSource);
    for (const [start, end, use] of findings(text, phrases)) {
      const padding = locator.range([start, end]);
      report(
        node,
        new RuleError(
          `${getSource(node)
            .slice(start, end)
            .replace(/\n[ \t>]*/g, ' ')}\t${use}`,
          { padding },
        ),
      );
    }
  };
  return { [Syntax.Paragraph]: check, [Syntax.Header]: check, [Syntax.TableCell]: check };
}

/** Finds phrases in plain text; returns `[start, end, use]` for each; of several that overlap, for that of the first rule. */
export function findings(text, phrases) {
  const flat = text.replace(/\s/g, ' ').replace(/[\u2019]/g, "'");
  const found = phrases.flatMap((phrase) => {
    const allowed = (phrase.except ?? []).flatMap(({ find }) => spans(flat, spaced(find)));
    return spans(flat, spaced(phrase.find))
      .filter(([start, end]) => !allowed.some(([from, to]) => from < end && start < to))
      .map(([start, end]) => [start, end, phrase.use]);
  });
  const isFirst = ([start, end], i) => !found.slice(0, i).some(([from, to]) => from < end && start < to);
  return found.filter(isFirst);
}

const spans = (text, pattern) => [...text.matchAll(pattern)].map(({ index, 0: { length } }) => [index, index + length]);

const compiled = new Map();

/** A pattern in which a space matches several. */
function spaced(find) {
  if (!compiled.has(find)) {
    const source = find.source.replaceAll('\u2019', "'").replace(/(?<!\[[^\]]*) /g, ' +');
    compiled.set(find, new RegExp(source, `g${find.flags}`));
  }
  return compiled.get(find);
}

/** Returns the source of a node, of the same length, with code and addresses hidden and without the marks of quotations. */
function runningText(node, getSource) {
  const base = node.range[0];
  const unquoted = getSource(node).replace(/\n[ \t]*>[ \t]?/g, (mark) => mark.replaceAll('>', ' '));
  return hide(node, unquoted.split(''), base).join('');
}

function hide(node, letters, base) {
  const cover = (from, to) => letters.fill(HIDDEN, Math.max(from - base, 0), to - base);
  if (HIDDEN_NODES.has(node.type)) cover(...node.range);
  if (node.type === 'Link' && node.children.length > 0) {
    cover(node.range[0], node.children[0].range[0]);
    cover(node.children.at(-1).range[1], node.range[1]);
  }
  for (const child of node.children ?? []) hide(child, letters, base);
  return letters;
}
