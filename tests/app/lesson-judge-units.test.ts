/** Answers to questions about a number are judged as a teacher would. */
import fc from 'fast-check';
import { describe, expect, test } from 'vitest';
import { type Expected, judge } from '../../www/src/lessons/judge';
import { quantityFrom } from '../../www/src/lessons/numerals';
import { unitNamed } from '../../www/src/lessons/units';
import { type TextKey, text } from '../../www/src/texts';

describe('a number', () => {
  test.each<[string, ...number[]]>([
    ...(['1.5', '1,5', '1.5.', '= 1,5', 'E = 1.5', '≈1.5', 'about 1.5', 'etwa 1,5'] as const).map(
      (typed): [string, number] => [typed, 1.5],
    ),
    ['−4', -4],
    ['-4', -4],
    ['–4', -4],
    ['minus four', -4],
    ['minus vier', -4],
    ['1e3', 1000],
    ['2 · 10⁻²', 0.02],
    ['2x10^-2', 0.02],
    ['10⁻²', 0.01],
    ['3/100', 0.03],
    ['3 / 100', 0.03],
    ['3:100', 0.03],
    ['½', 0.5],
    ['5 1/5', 5.2],
    ['5½', 5.5],
    ['3√3', 3 * Math.sqrt(3)],
    ['3*sqrt(3)', 3 * Math.sqrt(3)],
    ['zero', 0],
    ['null', 0],
    ['Null', 0],
    ['none', 0],
    ['eighty-one', 81],
    ['eighty one', 81],
    ['einundachtzig', 81],
    ['zweiundzwanzig', 22],
    ['ninety', 90],
    ['three hundredths', 0.03],
    ['drei Hundertstel', 0.03],
    ['15.5 thousand', 15500],
    // The comma or point may begin decimals or group digits; not after a zero.
    ['15,540', 15.54, 15540],
    ['15.540', 15.54, 15540],
    ['0,034', 0.034],
    ['0.034', 0.034],
    ...(['15 540', '15’540', '15\u202f540', '15540'] as const).map((typed): [string, number] => [typed, 15540]),
    ['−1,234,567', -1234567],
    ['1.234.567,8', 1234567.8],
    ['1,234.5', 1234.5],
    ['1,23', 1.23],
    ['1,2345', 1.2345],
  ])('%s is read as %d', (typed, ...values) => {
    const found = quantityFrom(typed);
    expect(found?.words).toBe('');
    expect(found?.values).toHaveLength(values.length);
    for (const [at, value] of values.entries()) expect(found?.values[at]).toBeCloseTo(value, 12);
  });

  test.each(['', '-', 'ten fingers and', 'many', '1/0', '1.2.3,4,5', 'Infinity', '0x10x'])('%j is none', (typed) => {
    const { isRight } = judge(typed, { value: 10 });
    expect(isRight).toBe(false);
  });
});

test('units are known by symbol and name, in both languages', () => {
  const factors = [
    'ml',
    'mL',
    'cm³',
    'cm^3',
    'ccm',
    'millilitres',
    'Milliliter',
    'Kubikzentimeter',
    'cubic-centimetres',
  ];
  for (const name of factors) expect(unitNamed(name)).toEqual({ kind: 'metres 3', factor: expect.closeTo(1e-6, 12) });
  for (const name of ['mm', 'millimetre', 'Millimetern', 'millimeters'])
    expect(unitNamed(name)).toEqual({ kind: 'metres 1', factor: 1e-3 });
  for (const name of ['voxel', 'voxels', 'Voxeln']) expect(unitNamed(name)?.kind).toBe('voxels 1');
  for (const name of ['', 'handles', 'Henkel', 'mmm', 'edges', 'constructor']) expect(unitNamed(name)).toBeUndefined();
});

type Case = [typed: string, expected: Expected, says: TextKey];
const PERCENT = { value: 34, within: 0.6, unit: '%' };
const FORCE = { value: 0.03, within: 0.001 };
const DEPTH = { value: 0.088, within: 0.003, unit: 'voxels' };
const STROKE = { value: 14.4, within: 0.3, unit: 'ml' };
const HEIGHT = { value: 5, unit: 'mm' };

/** Answers that are right, and what is said. */
const RIGHT: Case[] = [
  ...(['34', '34 %', '34%', '34,3', '34 percent', '34 per cent', '34 Prozent', '34.3 % of it', '+34'] as const).map(
    (typed): Case => [typed, PERCENT, 'lessons.right'],
  ),
  ...(['0.03', '0,03', '.03', '3/100', '3e-2', 'three hundredths', '0.03 N'] as const).map(
    (typed): Case => [typed, FORCE, 'lessons.right'],
  ),
  ['3 %', FORCE, 'lessons.rightAs'],
  ['0,088', DEPTH, 'lessons.right'],
  ['0.09 voxels', DEPTH, 'lessons.right'],
  ['0.09 of a voxel', DEPTH, 'lessons.right'],
  ['14.4 ml', STROKE, 'lessons.right'],
  ['14,4 cm³', STROKE, 'lessons.right'],
  ['14400 mm³', STROKE, 'lessons.rightAs'],
  ['14,400 mm3', STROKE, 'lessons.rightAs'],
  ['0.0144 litres', STROKE, 'lessons.rightAs'],
  ['five', HEIGHT, 'lessons.right'],
  ['fünf Millimeter', HEIGHT, 'lessons.right'],
  ['0.5 cm', HEIGHT, 'lessons.rightAs'],
  ['81 handles', { value: 81 }, 'lessons.right'],
  ['two (one for the first)', { value: 2 }, 'lessons.right'],
  ['15,540', { value: 15540 }, 'lessons.right'],
  ['15.540', { value: 15540 }, 'lessons.rightAs'],
  ['0 %', { value: 0 }, 'lessons.rightAs'],
  ...(['0', 'zero', 'null', 'none', '-0', '0 N', '0 mm', '0/5'] as const).map(
    (typed): Case => [typed, { value: 0 }, 'lessons.right'],
  ),
];

/** Answers that are not right, and what is said. */
const WRONG: Case[] = [
  ['0.34', PERCENT, 'lessons.percentWrong'],
  ['0,34', PERCENT, 'lessons.percentWrong'],
  ['0.34 %', PERCENT, 'lessons.percentWrong'],
  ['3400', PERCENT, 'lessons.percentWrong'],
  ['−34', PERCENT, 'lessons.signWrong'],
  ['0.034', PERCENT, 'lessons.factorWrong'],
  ['34 mm', PERCENT, 'lessons.unitWrong'],
  ['37', PERCENT, 'lessons.wrong'],
  ['zero', PERCENT, 'lessons.wrong'],
  ['0.03 %', FORCE, 'lessons.percentWrong'],
  ['3', FORCE, 'lessons.percentWrong'],
  ['-0.03', FORCE, 'lessons.signWrong'],
  ['0.3', FORCE, 'lessons.factorWrong'],
  ['0.03 mm', FORCE, 'lessons.noUnit'],
  ['100/3', FORCE, 'lessons.wrong'],
  ['0.088 mm', DEPTH, 'lessons.unitWrong'],
  ['0.088 cubic voxels', DEPTH, 'lessons.unitWrong'],
  ['0.088 ells', DEPTH, 'lessons.unitWrong'],
  ['8.8', DEPTH, 'lessons.percentWrong'],
  ['14.4 mm³', STROKE, 'lessons.factorWrong'],
  ['14400', STROKE, 'lessons.factorWrong'],
  ['14.4 mm', STROKE, 'lessons.unitWrong'],
  ['5 cm', HEIGHT, 'lessons.factorWrong'],
  ['two', { value: -2 }, 'lessons.signWrong'],
  ['8100', { value: 81 }, 'lessons.percentWrong'],
  ['81 %', { value: 81 }, 'lessons.percentWrong'],
  ['1', { value: 0 }, 'lessons.wrong'],
  ['one', { value: 0 }, 'lessons.wrong'],
  ...(['2 or 3', '2-3', '2 to 3', '2 3', 'not 2', '2 per ring', '1+1', 'many', '-'] as const).map(
    (typed): Case => [typed, { value: 2 }, 'lessons.notUnderstood'],
  ),
  ['34', { ...PERCENT, value: undefined }, 'lessons.notMeasured'],
];

describe('an answer', () => {
  const begin = (key: TextKey) => text(key, { unit: '…', value: '…' } as never).split('…')[0] ?? '';

  test.each(RIGHT)('%j is right for %j', (typed, expected, key) => {
    const { isRight, says } = judge(typed, expected);
    expect(says).toContain(begin(key));
    expect(isRight).toBe(true);
  });

  test.each(WRONG)('%j is not right for %j', (typed, expected, key) => {
    const { isRight, says } = judge(typed, expected);
    expect(says).toContain(begin(key));
    expect(isRight).toBe(false);
  });

  const sizes = fc.double({ min: 0.01, max: 1e5, noNaN: true });
  const signed = fc.tuple(sizes, fc.boolean()).map(([size, isNegative]) => (isNegative ? -size : size));
  const written = (value: number, comma: boolean) => {
    const digits = value.toFixed(6);
    return comma ? digits.replace('.', ',') : digits;
  };

  test('any number is right as it is; not a hundred times it, a hundredth of it, or with the other sign', () => {
    fc.assert(
      fc.property(signed, fc.boolean(), fc.constantFrom('%', 'mm', undefined), (number, comma, unit) => {
        const expected = { value: number, within: Math.abs(number) * 0.02 + 1e-6, unit };
        expect(judge(written(number, comma), expected).isRight).toBe(true);
        for (const factor of [100, 0.01, -1]) {
          const { isRight, says } = judge(written(number * factor, comma), expected);
          expect(isRight).toBe(false);
          expect(says).toBe(text(factor < 0 ? 'lessons.signWrong' : 'lessons.percentWrong'));
        }
      }),
      { numRuns: Number(process.env.PROPERTY_RUNS ?? 300) },
    );
  });

  test('whatever is typed, there is a verdict in words', () => {
    const piece = fc.constantFrom(...'0123456789.,-−/%√^ e()=½³'.split(''), 'ten', 'mm', 'und', 'hundert', ' ');
    const typed = fc.oneof(
      fc.string(),
      fc.array(piece, { maxLength: 12 }).map((pieces) => pieces.join('')),
    );
    fc.assert(
      fc.property(typed, (typed) => {
        expect(judge(typed, PERCENT).says).not.toBe('');
      }),
      { numRuns: Number(process.env.PROPERTY_RUNS ?? 1000) },
    );
  });
});
