/** Numbers as students write them: in digits or in words of English and German, as fractions, roots, powers of ten. */

/** A number with the words after it, such as its unit. */
export interface Quantity {
  /** The numbers that may be meant: the comma of "15,540" begins decimals or groups digits. */
  values: number[];
  words: string;
}

/** Digits with separators, which {@link readings} reads. */
const DIGITS = String.raw`(?:\d{1,3}(?:[ '’]\d{3})+(?!\d)(?:[.,]\d+)?|[.,]?\d[\d.,]*)`;
const form = (source: string) => new RegExp(`^${source.replaceAll('N', `(${DIGITS})`)}(.*)$`, 'i');

const ratio = (above: number[], below: number[]) => above.flatMap((a) => below.map((b) => a / b));
const scaled = (values: number[], factor: number) => values.map((value) => value * factor);
const read = (digits: string | undefined) => (digits ? readings(digits) : [1]);

/** Ways to write a number, the longest first; the last group is what follows. */
const FORMS: [RegExp, (...groups: (string | undefined)[]) => number[]][] = [
  [form(String.raw`(\d+) (\d+)\s*/\s*(\d+)`), (whole, a, b) => [Number(whole) + Number(a) / Number(b)]],
  [form(String.raw`N\s*[/:]\s*N`), (a, b) => ratio(read(a), read(b))],
  [
    form(String.raw`N?\s*[·*×]?\s*(?:√|sqrt)\s*\(?N\)?`),
    (a, b) => read(a).flatMap((x) => scaled(read(b).map(Math.sqrt), x)),
  ],
  [form(String.raw`(?:N\s*[·*×x]\s*)?10\^\(?([+-]?\d+)\)?`), (a, power) => scaled(read(a), 10 ** Number(power))],
  [form(String.raw`N\s*e([+-]?\d+)`), (a, power) => scaled(read(a), 10 ** Number(power))],
  [form('N'), (a) => read(a)],
];

/** A number with its digits in groups of three, and decimals with the other separator. */
const GROUPED = /^([1-9]\d{0,2}([.,])\d{3}(?:\2\d{3})*)(?:(?!\2)[.,](\d+))?$/;

/** Returns the numbers that digits with separators may mean. */
function readings(digits: string): number[] {
  const plain = digits.replace(/[ '’]/g, '').replace(/[.,]+$/, '');
  const [, whole, , decimals = '0'] = GROUPED.exec(plain) ?? [];
  const found = [plain.replace(',', '.')];
  if (whole) found.push(`${whole.replace(/[.,]/g, '')}.${decimals}`);
  return found.map(Number).filter((one) => !Number.isNaN(one));
}

const list = (words: string) => words.split(' ');
/** Numbers from 0 in words, by language. */
const SMALL = [
  list(
    'zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen nineteen',
  ),
  list(
    'null eins zwei drei vier fünf sechs sieben acht neun zehn elf zwölf dreizehn vierzehn fünfzehn sechzehn siebzehn achtzehn neunzehn',
  ),
];
const TENS = [
  list('twenty thirty forty fifty sixty seventy eighty ninety'),
  list('zwanzig dreißig vierzig fünfzig sechzig siebzig achtzig neunzig'),
];
const NOTHING = list('nought nil none nothing keine keiner nichts');
/** Words after a number that multiply it. */
const SCALES: [RegExp, number][] = [
  [/^(tenths?|zehntel)$/, 0.1],
  [/^(hundredths?|hundertstel)$/, 0.01],
  [/^(thousandths?|tausendstel)$/, 0.001],
  [/^(hundred|hundert)$/, 100],
  [/^(thousand|tausend)$/, 1000],
  [/^(million|millionen)$/, 1e6],
];

/** Returns the number of a word from nought to ninety-nine; undefined if it is none. */
function numeral(word: string): number | undefined {
  if (NOTHING.includes(word)) return 0;
  const small = Math.max(...SMALL.map((words) => words.indexOf(word)));
  if (small >= 0) return small;
  const [, one = '', unit = '', ten = ''] = /^(?:(\p{L}+)und)?(\p{L}+?)(?:[- ](\p{L}+))?$/u.exec(word) ?? [];
  const tens = 20 + 10 * Math.max(...TENS.map((words) => words.indexOf(unit)));
  if (tens < 20) return undefined;
  const rest = one || ten;
  const ones = rest === 'ein' ? 1 : rest ? (numeral(rest) ?? 10) : 0;
  return ones < 10 ? tens + ones : undefined;
}

/** Returns the numbers at the beginning of a text in digits, and what follows. */
function inDigits(plain: string): [number[], string] | undefined {
  for (const [pattern, valuesOf] of FORMS) {
    const groups = pattern.exec(plain)?.slice(1);
    if (groups) return [valuesOf(...groups.slice(0, -1)).filter(Number.isFinite), groups.at(-1) ?? ''];
  }
  return undefined;
}

/** Returns the number at the beginning of a text in words, of which there may be two, and what follows. */
function inWords(plain: string): [number[], string] | undefined {
  const words = plain.split(/\s+/);
  for (const count of [2, 1]) {
    const value = numeral(words.slice(0, count).join(' ').toLowerCase());
    if (value !== undefined) return [[value], words.slice(count).join(' ')];
  }
  return undefined;
}

/** Superscript digits are powers after another digit, and parts of a unit after a letter. */
const RAISED = /(?<=\d)[⁻⁺⁰¹²³⁴-⁹]+/g;
const LEAD = /^(?:about|around|approximately|approx\.?|circa|ca\.?|roughly|exactly|etwa|ungefähr|rund|genau)\s+/i;
const SIGN = /^([-+]|(?:minus|plus|negative|negativ)\s)?\s*(.*)$/i;

/** Returns what is typed with one character for each meaning, and without what introduces the number. */
function simplified(typed: string): string {
  const plain = typed
    .replace(/(?<=\d)(?=[¼-¾⅐-⅞])/g, ' ')
    .replace(RAISED, (power) => `^${power}`)
    .normalize('NFKC')
    .replace(/[‐-―−]/g, '-')
    .replace(/[⁄÷]/g, '/');
  return (plain.split(/[=≈~]/).at(-1) ?? '')
    .trim()
    .replace(LEAD, '')
    .replace(/[.,;!]+$/, '');
}

/** Returns the number that a student has written, with the words after it; undefined if there is none at the beginning. */
export function quantityFrom(typed: string): Quantity | undefined {
  const [, sign = '', rest = ''] = SIGN.exec(simplified(typed)) ?? [];
  const [numbers = [], after = ''] = inDigits(rest) ?? inWords(rest) ?? [];
  if (numbers.length === 0) return undefined;
  const [first = '', ...others] = after.trim().split(/\s+/);
  const [, scale] = SCALES.find(([word]) => word.test(first.toLowerCase())) ?? [];
  const factor = (scale ?? 1) * (/^(-|minus|neg)/i.test(sign) ? -1 : 1);
  return { values: scaled(numbers, factor), words: (scale ? others : [first, ...others]).join(' ') };
}
