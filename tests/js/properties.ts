// Limits and checks of the property tests. `PROPERTY_RUNS` is the number of runs of each property.
import { VesicleError, type VolumeInit } from '../../pkg/index.js';

export const RUNS = Number(process.env.PROPERTY_RUNS ?? 100);
/** Time for a test, and for what fast-check does after a failure. */
export const LIMITS = { timeout: 60_000 + 100 * RUNS };
export const REPORT = { numRuns: RUNS };

/** Longest time of an execution, milliseconds of this process, and most bytes of arrays that it makes. */
const [MOST_MS, MOST_BYTES] = [2000, 2 ** 28];

/** Runs `work` within the limits, and returns its result, or the refusal. */
export async function bounded<Result>(work: () => Promise<Result>): Promise<Result | VesicleError> {
  const [start, bytes] = [performance.now(), process.memoryUsage().arrayBuffers];
  const result = await work().catch((error: unknown) => refusal(error));
  holds(process.memoryUsage().arrayBuffers - bytes < MOST_BYTES, 'it took too much memory');
  // A busy machine is slow; the time of the process alone takes longer to ask for than most files to read.
  if (performance.now() - start > MOST_MS) holds((await processTime(work)) < MOST_MS, 'it took too long');
  return result;
}

async function processTime(work: () => Promise<unknown>): Promise<number> {
  const before = process.cpuUsage();
  await work().catch(() => {});
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1000;
}

/** Returns an error that is a refusal in words; throws any other. */
function refusal(error: unknown): VesicleError {
  if (!(error instanceof VesicleError))
    throw new Error(`no refusal: ${typeof error} ${String(error)}`, { cause: error });
  holds(/^(bad-file|too-large|invalid-argument)$/.test(error.code), error.code);
  holds(error.message.length > 0 && error.message.length < 2000, `${error.message.length} characters`);
  return error;
}

/** Throws unless something holds; `expect` would take most of the time of millions of executions. */
export function holds(condition: boolean, otherwise: string): void {
  if (!condition) throw new Error(otherwise);
}

const product = (numbers: readonly number[]) => numbers.reduce((total, one) => total * one, 1);

export const isSize = (value: number) => Number.isSafeInteger(value) && value > 0;

/** Tests what holds for any volume that was read. */
export function expectInit(init: VolumeInit): void {
  const { dims, data, affine, spacing, slope, intercept, frameSeconds, warnings } = init;
  if (!dims) throw new Error('no dims');
  const numbers = [
    ...Array.from(affine ?? []),
    ...Array.from(spacing ?? []),
    slope ?? 1,
    intercept ?? 0,
    frameSeconds ?? 1,
  ];
  holds(dims.every(isSize) && data.length === product([...dims]), `${data.length} voxels of ${dims}`);
  holds(numbers.every(Number.isFinite) && (frameSeconds ?? 1) > 0, `numbers ${numbers}`);
  expectTexts((warnings ?? []).map(({ text }) => text));
}

/** Tests the lengths of warnings and remarks. */
export function expectTexts(texts: readonly string[]): void {
  holds(texts.length < 1000, `${texts.length} texts`);
  for (const text of texts) holds(text.length > 0 && text.length <= 1000, `${text.length} characters`);
}

/** Whether a text has no half of a character. */
export const isWhole = (text: string) => !/\p{Surrogate}/u.test(text);

export const isName = (name: string) => name.length <= 200;
