// Elements of XML, enough for the descriptions in OME-TIFF, in workers and Node too.

/** A start or end of an element. */
export interface Tag {
  /** Name without its prefix. */
  name: string;
  isEnd: boolean;
  /** Returns the value of an attribute; undefined if the element does not have it. */
  attribute(name: string): string | undefined;
  /** Text up to the next tag. */
  text: string;
}

/** Sections that are passed over, and how they end. */
const PASSED: [string, string][] = [
  ['<!--', '-->'],
  ['<![CDATA[', ']]>'],
  ['<?', '?>'],
  ['<!', '>'],
];

/** Yields the tags of a document in their order. Time is linear in its length, whatever it contains. */
export function* tagsOf(xml: string): Generator<Tag> {
  for (let at = xml.indexOf('<'); at >= 0; ) {
    const passed = PASSED.find(([start]) => xml.startsWith(start, at));
    const end = passed ? xml.indexOf(passed[1], at) : endOfTag(xml, at);
    if (end < 0) return;
    const next = xml.indexOf('<', end);
    if (!passed) yield tagIn(xml.slice(at + 1, end), xml.slice(end + 1, next < 0 ? undefined : next));
    at = next;
  }
}

/** Returns the index of the bracket that ends a tag, which may be inside quotes before; -1 if there is none. */
function endOfTag(xml: string, start: number): number {
  let quote = '';
  for (let at = start + 1; at < xml.length; at++) {
    const sign = xml.charAt(at);
    if (quote !== '') quote = sign === quote ? '' : quote;
    else if (sign === '>') return at;
    else if (sign === '"' || sign === "'") quote = sign;
  }
  return -1;
}

function tagIn(source: string, text: string): Tag {
  const isEnd = source.startsWith('/');
  const full = /^\/?([^\s/>]*)/.exec(source)?.[1] ?? '';
  let known: Map<string, string> | undefined;
  const attribute = (name: string) => {
    known ??= attributesIn(source.slice(full.length));
    return known.get(name);
  };
  return { name: full.slice(full.indexOf(':') + 1), isEnd, attribute, text };
}

function attributesIn(source: string): Map<string, string> {
  const found = new Map<string, string>();
  for (let at = 0; ; ) {
    const equals = source.indexOf('=', at);
    if (equals < 0) return found;
    const open = /\S/.exec(source.slice(equals + 1, equals + 64));
    const start = equals + 1 + (open?.index ?? 0);
    const end = source.indexOf(open?.[0] ?? '"', start + 1);
    if (end < 0) return found;
    found.set(source.slice(at, equals).trim(), unescaped(source.slice(start + 1, end)));
    at = end + 1;
  }
}

const ENTITIES: Record<string, string> = { lt: '<', gt: '>', quot: '"', apos: "'", amp: '&' };

function unescaped(text: string): string {
  return text.replace(/&(?:#(\d{1,7})|#x([\da-f]{1,6})|(\w{2,4}));/gi, (all, decimal, hex, name) => {
    if (name) return ENTITIES[name] ?? all;
    const code = decimal ? Number(decimal) : Number.parseInt(hex, 16);
    return code <= 0x10ffff ? String.fromCodePoint(code) : all;
  });
}
