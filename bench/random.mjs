// Random numbers for the synthetic data of benchmarks and tests.

/**
 * Returns a generator of reproducible random numbers in (0, 1) (Mulberry32).
 * @param {number} seed
 */
export function randomNumbers(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32 + 2 ** -33;
  };
}

/**
 * Returns a number of the standard normal distribution (Box and Muller).
 * @param {() => number} random
 */
export const normalNumber = (random) => Math.sqrt(-2 * Math.log(random())) * Math.cos(2 * Math.PI * random());

/**
 * Returns an intensity with Rician noise, as in MR magnitude images, as a byte.
 * @param {number} value
 * @param {number} noise
 * @param {() => number} random
 */
export function ricianByte(value, noise, random) {
  const [length, angle] = [noise * Math.sqrt(-2 * Math.log(random())), 2 * Math.PI * random()];
  const magnitude = Math.hypot(value + length * Math.cos(angle), length * Math.sin(angle));
  return Math.min(Math.max(Math.round(magnitude), 0), 255);
}
