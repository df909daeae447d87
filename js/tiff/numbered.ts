// Checks the numbers in names of files that are the slices of one stack.

/**
 * Returns a warning if the names of files, in their order, tell that slices are missing, or that the files are not the slices
 * of one channel at one time.
 */
export function warningOfNames(names: readonly string[]): string | undefined {
  const [first, ...others] = names.map((name) => (name.split(/[\\/]/).pop() as string).split(/(\d+)/));
  // Names of other words are in an order that only people know.
  if (!first || others.some((parts) => parts.length !== first.length || hasOtherWords(first, parts))) return;
  const numbers = first.map((_, k) => [first, ...others].map((parts) => Number(parts[k])));
  const varying = numbers.filter((values, k) => k % 2 === 1 && new Set(values).size > 1);
  if (varying.length > 1)
    return `the names of the files differ in ${varying.length} numbers, of which one may count channels or times: all are slices along z, in the order of their names`;
  return varying[0] && warningOfGaps(varying[0]);
}

function hasOtherWords(first: string[], parts: string[]): boolean {
  return parts.some((part, k) => k % 2 === 0 && part !== first[k]);
}

/** Returns a warning if the distance of some numbers is not that of the others. */
function warningOfGaps(unordered: number[]): string | undefined {
  const numbers = unordered.toSorted((a, b) => a - b);
  const steps = numbers.slice(1).map((number, k) => number - (numbers[k] as number));
  const step = steps.reduce((least, step) => (step > 0 ? Math.min(least, step) : least), Infinity);
  const gap = steps.findIndex((other) => other > step);
  if (gap < 0) return;
  const count = steps.filter((other) => other > step).length;
  const between = `between the files numbered ${numbers[gap]} and ${numbers[gap + 1]}`;
  return `slices seem to be missing ${between}${count > 1 ? `, and elsewhere (${count} places)` : ''}: those that are there are read as evenly spaced`;
}
