/**
 * Returns the intensity that best splits a histogram in two (Otsu 1979), as a first guess of the iso value.
 * `range` holds the intensities at the two ends of the histogram.
 */
export function otsu(histogram: ArrayLike<number>, range: [number, number]): number {
  const bins = histogram.length;
  const { count, sum } = totals(histogram);
  let below = 0;
  let belowSum = 0;
  let best = 0;
  // All splits in an empty gap between two peaks are equally good: take the middle one.
  let first = 0;
  let last = 0;
  for (let bin = 0; bin < bins - 1; bin++) {
    below += histogram[bin] ?? 0;
    belowSum += bin * (histogram[bin] ?? 0);
    const between = variance(below, belowSum, count, sum);
    if (between > best) {
      best = between;
      first = bin;
      last = bin;
    } else if (between === best) {
      last = bin;
    }
  }
  const split = (first + last) / 2 + 1;
  return range[0] + ((range[1] - range[0]) * split) / bins;
}

function totals(histogram: ArrayLike<number>): { count: number; sum: number } {
  let count = 0;
  let sum = 0;
  for (let bin = 0; bin < histogram.length; bin++) {
    count += histogram[bin] ?? 0;
    sum += bin * (histogram[bin] ?? 0);
  }
  return { count, sum };
}

/**
 * Returns Otsu's between-class variance, up to a constant factor, of a split of `count` values with the sum `sum` into
 * `below` values with the sum `belowSum` and the rest; 0 if a class is empty.
 */
function variance(below: number, belowSum: number, count: number, sum: number): number {
  const above = count - below;
  if (below === 0 || above === 0) return 0;
  const difference = belowSum / below - (sum - belowSum) / above;
  return below * above * difference * difference;
}

/**
 * Returns the quantiles of intensities at the given fractions (0 to 1), accurate to half a bin, from their histogram
 * over `range`; used to choose the intensities displayed as black and as white.
 */
export function quantiles(histogram: ArrayLike<number>, range: [number, number], fractions: number[]): number[] {
  const { count } = totals(histogram);
  return fractions.map((fraction) => {
    let below = 0;
    let bin = 0;
    while (bin < histogram.length - 1 && below + (histogram[bin] ?? 0) < fraction * count)
      below += histogram[bin++] ?? 0;
    return range[0] + ((range[1] - range[0]) * (bin + 0.5)) / histogram.length;
  });
}
