/** Colour map for values on the surface: diverging, blue below zero, red above, light at zero (ColorBrewer RdBu). */
import type { VertexQuantity } from '../engine/protocol';
import { text } from '../texts';

/** Quantities with a value at each vertex that can be shown as colours. */
export type ShownQuantity = VertexQuantity | 'distance' | 'deviation' | 'area distortion' | 'angle distortion';

type Rgb = readonly [number, number, number];

/** Colours of the colour map at −1, −½, 0, ½ and 1, sRGB 0..255. */
const STOPS: readonly Rgb[] = [
  [33, 102, 172],
  [103, 169, 207],
  [247, 247, 247],
  [239, 138, 98],
  [178, 24, 43],
];

/**
 * Quantile of the magnitudes of the values that bounds the range of the colour scale, so that a few extreme vertices do
 * not make all others pale.
 */
const WITHIN = 0.98;
/** Number of values sampled to find the range of the colour scale; up to twice as many if they do not divide evenly. */
const SAMPLES = 4096;
/** Number of steps of the table of colours from −1 to 1. */
const TABLE = 256;

/** Title, labels and smallest range of the legend for each quantity shown as colours. */
export const QUANTITIES: Record<ShownQuantity, QuantityText> = {
  speed: { title: text('view.speed'), below: text('view.inwards'), above: text('view.outwards'), least: 1e-4 },
  'mean curvature': {
    title: text('view.meanCurvature'),
    power: 1,
    below: text('view.concave'),
    above: text('view.convex'),
    least: 1e-6,
  },
  'gaussian curvature': {
    title: text('view.gaussianCurvature'),
    power: 2,
    below: text('view.hyperbolic'),
    above: text('view.elliptic'),
    least: 1e-9,
  },
  distance: {
    title: text('view.pointDistance'),
    power: -1,
    below: text('view.atPoint'),
    above: text('view.far'),
    least: 1e-9,
    positive: true,
  },
  deviation: {
    title: text('finish.deviation'),
    power: -1,
    below: text('finish.onReference'),
    above: text('view.far'),
    least: 1e-9,
    positive: true,
  },
  'area distortion': {
    title: text('view.areaDistortion'),
    below: text('view.stretched'),
    above: text('view.compressed'),
    least: 0.1,
  },
  'angle distortion': {
    title: text('view.angleDistortion'),
    below: text('view.conformal'),
    above: text('view.sheared'),
    least: 0.1,
    positive: true,
  },
};

interface QuantityText {
  title: string;
  /**
   * Unit of the quantity's values, as a power of inverse length: −1 for lengths, 2 for inverse areas; undefined if none
   * is shown.
   */
  power?: 1 | 2 | -1;
  below: string;
  above: string;
  /** Smallest magnitude that the ends of the colour scale can have. */
  least: number;
  /** Whether values are never negative, so that only the upper half of the colours is used. */
  positive?: boolean;
}

/** Returns whether a colouring of the surface represents values of a quantity, which need a legend. */
export function isQuantity(color: string): color is ShownQuantity {
  return color in QUANTITIES;
}

/** Returns the title of a quantity's legend with the unit of its values, where lengths have the unit `unit`. */
export function quantityTitle(quantity: ShownQuantity, unit: string): string {
  const { title, power } = QUANTITIES[quantity];
  if (!power) return title;
  if (power === -1) return unit ? text('view.titleUnit', { title, unit }) : title;
  return text(power === 2 ? 'view.perUnitSquared' : 'view.perUnit', { title, unit: unit || text('view.unknownUnit') });
}

/** Returns the colour of the diverging colour map for t, clamped to −1..1, as sRGB 0..255. */
export function diverging(t: number): [number, number, number] {
  const at = (Math.min(1, Math.max(-1, t)) + 1) * 2;
  const i = Math.min(STOPS.length - 2, Math.floor(at));
  const [low, high] = [STOPS[i] ?? [0, 0, 0], STOPS[i + 1] ?? [0, 0, 0]];
  return [0, 1, 2].map((c) => (low[c] ?? 0) + (at - i) * ((high[c] ?? 0) - (low[c] ?? 0))) as [number, number, number];
}

const LINEAR = Float32Array.from({ length: 3 * (TABLE + 1) }, (_, i) => {
  const t = (2 * Math.floor(i / 3)) / TABLE - 1;
  return ((diverging(t)[i % 3] ?? 0) / 255) ** 2.2;
});

/**
 * Returns the magnitude at the ends of the colour scale for values at vertices: it bounds nearly all of them and is at
 * least `least`, rounded up to 1, 2 or 5 times a power of ten.
 */
export function robustRange(values: Float32Array, least: number): number {
  const stride = Math.max(1, Math.floor(values.length / SAMPLES));
  const sizes: number[] = [];
  for (let i = 0; i < values.length; i += stride) {
    const size = Math.abs(values[i] ?? 0);
    if (Number.isFinite(size)) sizes.push(size);
  }
  sizes.sort((a, b) => a - b);
  return roundUp(Math.max(least, sizes[Math.floor(WITHIN * (sizes.length - 1))] ?? 0));
}

function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= value * (1 - 1e-9)) ?? 10;
  return Number((step * power).toPrecision(1));
}

/**
 * Writes the colour of each vertex's value into `out`, linear rgb, packed; ±`range` are the values at the ends of the
 * colour scale.
 */
export function shadeColors(values: Float32Array, range: number, out: Float32Array): void {
  for (let vertex = 0; vertex < values.length; vertex++) {
    // NaN is drawn as zero.
    const t = Math.min(1, Math.max(-1, (values[vertex] || 0) / range));
    const entry = 3 * Math.round(((t + 1) * TABLE) / 2);
    out[3 * vertex] = LINEAR[entry] ?? 1;
    out[3 * vertex + 1] = LINEAR[entry + 1] ?? 1;
    out[3 * vertex + 2] = LINEAR[entry + 2] ?? 1;
  }
}

/** Converts packed sRGB colours, 0..1, to linear rgb in `out`. */
export function linearColors(colors: Float32Array, out: Float32Array): void {
  for (let i = 0; i < colors.length; i++) out[i] = Math.max(0, colors[i] ?? 0) ** 2.2;
}
