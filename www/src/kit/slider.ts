import type { ParamSpec } from '../engine/protocol';

/**
 * Number of steps of a slider with a nonlinear scale, or with a linear one for a real number whose specification gives
 * no step.
 */
const LOG_STEPS = 200;
/** Upper bound of a parameter's range from which it counts as unbounded, so that there is no slider. */
const ENDLESS = 1e9;
/**
 * Fraction of a range's upper bound: if a real parameter's range begins at 0 and its default is below this fraction,
 * the slider is scaled by a power law with the exponent {@link SMALL_POWER}, so that most of it is for small values.
 */
const SMALL_SHARE = 0.01;
/** Exponent of the power law that scales the slider of a parameter whose usual values are small. */
const SMALL_POWER = 4;

/** The scale of a parameter's slider: its positions, and their values. */
interface SliderScale {
  range: { min: number; max: number; step: number };
  value: (position: number) => number;
  position: (value: number) => number;
}

/** Returns the slider of a parameter: linear, logarithmic, or one that favours small values; undefined without bounds. */
export function sliderFor(spec: ParamSpec): SliderScale | undefined {
  const { min, max } = spec;
  if (min === undefined || max === undefined || max >= ENDLESS) return undefined;
  const nonlinear = { min: 0, max: LOG_STEPS, step: 1 };
  switch (scaleOf(spec, min, max)) {
    case 'log':
      return {
        range: nonlinear,
        value: (position) => rounded(min * (max / min) ** (position / LOG_STEPS)),
        position: (value) => (LOG_STEPS * Math.log(value / min)) / Math.log(max / min),
      };
    case 'small':
      return {
        range: nonlinear,
        value: (position) => rounded(max * (position / LOG_STEPS) ** SMALL_POWER),
        position: (value) => LOG_STEPS * Math.max(0, value / max) ** (1 / SMALL_POWER),
      };
    default: {
      const step = spec.step ?? (spec.type === 'integer' ? 1 : (max - min) / LOG_STEPS);
      return { range: { min, max, step }, value: rounded, position: (value) => value };
    }
  }
}

const rounded = (value: number) => Number(value.toPrecision(4));

function scaleOf(spec: ParamSpec, min: number, max: number): 'linear' | 'log' | 'small' {
  if (spec.scale === 'log' && min > 0) return 'log';
  const { default: usual } = spec;
  const isSmall = typeof usual === 'number' ? usual > 0 && usual < SMALL_SHARE * max : usual === 'auto';
  const small = min === 0 && isSmall;
  return small && spec.type === 'number' ? 'small' : 'linear';
}
