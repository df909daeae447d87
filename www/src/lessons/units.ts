/** Units that a student may write after a number, in English and German. */

/** A unit: what it measures, and how many of the base unit of this it is. */
export interface Unit {
  kind: string;
  factor: number;
}

/** Dimensionless: what a number without a unit is. */
export const PLAIN: Unit = { kind: 'number', factor: 1 };

const PREFIXES: Record<string, number> = {
  ...{ n: 1e-9, µ: 1e-6, μ: 1e-6, u: 1e-6, m: 1e-3, c: 1e-2, d: 1e-1, k: 1e3 },
  ...{ nano: 1e-9, micro: 1e-6, mikro: 1e-6, milli: 1e-3, centi: 1e-2, zenti: 1e-2, deci: 1e-1, dezi: 1e-1, kilo: 1e3 },
};
const POWERS: Record<string, number> = { square: 2, quadrat: 2, cubic: 3, kubik: 3 };

const PREFIX = '(nano|micro|mikro|milli|centi|zenti|deci|dezi|kilo|n|µ|μ|u|m|c|d|k)?';
const METRES = new RegExp(`^(square|cubic|quadrat|kubik)?[- ]?${PREFIX}(?:m|met(?:er|re)[sn]?)(?:\\^?([1-3]))?$`);
const LITRES = new RegExp(`^${PREFIX}(?:l|lit(?:er|re)[sn]?)$`);
const VOXELS = /^(cubic|kubik)?[- ]?voxel[sn]?(?:\^?([1-3]))?$/;
const RATIOS: Record<string, number> = { '%': 0.01, percent: 0.01, prozent: 0.01, '‰': 0.001, promille: 0.001 };

/** Returns the unit of a name; undefined if it is none. */
export function unitNamed(name: string): Unit | undefined {
  const plain = name
    .normalize('NFKC')
    .toLowerCase()
    .replace(/^cc$|^ccm$/, 'cm3');
  if (Object.hasOwn(RATIOS, plain)) return { kind: 'number', factor: RATIOS[plain] ?? 1 };
  const voxels = VOXELS.exec(plain);
  if (voxels) return { kind: `voxels ${powerOf(voxels[1], voxels[2])}`, factor: 1 };
  const litres = LITRES.exec(plain);
  if (litres) return { kind: 'metres 3', factor: prefix(litres[1]) * 1e-3 };
  const metres = METRES.exec(plain);
  if (!metres) return undefined;
  const power = powerOf(metres[1], metres[3]);
  return { kind: `metres ${power}`, factor: prefix(metres[2]) ** power };
}

const prefix = (name: string | undefined) => PREFIXES[name ?? ''] ?? 1;
const powerOf = (word: string | undefined, digit: string | undefined) => POWERS[word ?? ''] ?? Number(digit ?? 1);

/** Returns the unit among the words after a number, with those that are no unit; undefined if there is none. */
export function unitIn(words: string): { unit: Unit | undefined; others: string[] } {
  const joined = words
    .replace(/per cent/gi, 'percent')
    .replace(/\b(square|cubic) (?=\p{L})/giu, '$1-')
    .replace(/[()[\],;]/g, ' ');
  const all = joined.split(/\s+/).filter((word) => word !== '');
  const unit = all.map(unitNamed).find((one) => one !== undefined);
  return { unit, others: all.filter((word) => !unitNamed(word)) };
}
