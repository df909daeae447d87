/**
 * Evaluates the Reconstruct lab's radial basis functions, to plot them on the page; the solver has its own
 * implementation.
 */
import type { ParamValues } from '../../engine/protocol';

export interface KernelParams {
  kernel: string;
  delta: number;
  tau: number;
  sigma: number;
}

/**
 * Distance r, as a multiple of τ, below which the multi-order kernel is replaced by its value at 0: its closed form
 * loses its digits there.
 */
const SMALL_R = 1e-4;

/**
 * Reads the name and constants of the radial basis function from the method's parameters, with defaults for missing
 * ones.
 */
export function kernelParams(params: ParamValues): KernelParams {
  const number = (name: string, otherwise: number) => (typeof params[name] === 'number' ? params[name] : otherwise);
  return {
    kernel: String(params.kernel ?? 'multi-order'),
    delta: number('delta', 5),
    tau: number('tau', 0.025),
    sigma: number('sigma', 0.07),
  };
}

/**
 * Returns the value φ(r) of the chosen radial basis function at the distance `r`, in units of the normalised box, which
 * is 2 long.
 */
export function phi({ kernel, delta, tau, sigma }: KernelParams, r: number): number {
  switch (kernel) {
    case 'thin-plate':
      return r ** 3;
    case 'biharmonic':
      return -r;
    case 'gaussian':
      return Math.exp(-((r / sigma) ** 2) / 2);
    default:
      return multiOrder(delta, tau, r);
  }
}

/**
 * Returns the value φ(r) of the multi-order radial basis function at the distance `r`: equation 6 of the paper by Dinh,
 * Turk and Slabaugh in real form, with δ and τ squared in the energy.
 */
function multiOrder(delta: number, tau: number, r: number): number {
  if (r < SMALL_R * tau) return 1 / (4 * Math.PI * delta * Math.sqrt(1 + 2 * delta * tau));
  const a = Math.sqrt(1 + 2 * delta * tau) / (2 * tau);
  const [even, odd] = damped((1 - 2 * delta * tau) / (4 * tau * tau), a, r);
  return (1 - (even + (r * odd) / (4 * a * tau * tau))) / (4 * Math.PI * delta * delta * r);
}

/**
 * Returns the two decaying terms of the multi-order function: e^(−ar) times cosh(br) and sinh(br)/(br), or times
 * cos(br) and sin(br)/(br) if b² = `square` is negative.
 */
function damped(square: number, a: number, r: number): [number, number] {
  const b = Math.sqrt(Math.abs(square));
  const fall = Math.exp(-a * r);
  if (b * r < 1e-6) return [fall, fall];
  if (square < 0) return [fall * Math.cos(b * r), (fall * Math.sin(b * r)) / (b * r)];
  // Combine the exponentials first: cosh alone would overflow. a is larger than b.
  const [slow, fast] = [Math.exp((b - a) * r), Math.exp(-(a + b) * r)];
  return [(slow + fast) / 2, (slow - fast) / (2 * b * r)];
}
