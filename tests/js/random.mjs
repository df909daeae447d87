/**
 * Returns a generator of reproducible pseudo-random numbers in [0, 1): a linear congruential one, whose upper bits are
 * good enough for noise and for choices.
 *
 * @param {number} seed Start of the sequence, an integer.
 * @returns {() => number}
 */
export function randomNumbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}
