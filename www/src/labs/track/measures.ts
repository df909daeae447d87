import type { Unit } from '../../engine/protocol';
import { cellOf, type Warning } from '../../engine/warnings';
import { csvOf } from '../../kit/csv';
import { count, figure } from '../../kit/format';
import type { ExtraMeasure } from '../../kit/measures';
import { text } from '../../texts';
import { beatOf } from './curve';
import type { TrackedFrame } from './protocol';

const percent = (share: number) => `${(100 * share).toFixed(1)} %`;
const round = (value: number) => figure(Number(value.toPrecision(3)));

/** Rows on the tracking in the Track lab's table of measures, listed after those on the displayed frame's surface. */
export const TRACK_ROWS: ExtraMeasure[] = [
  {
    name: 'ejection',
    label: text('track.ejection'),
    help: text('track.ejectionHelp'),
    text: percent,
  },
  {
    name: 'folded',
    label: text('track.folded'),
    help: text('track.foldedHelp'),
    text: count,
  },
  {
    name: 'closing',
    label: text('track.closing'),
    help: text('track.closingHelp'),
    optional: true,
    text: round,
  },
  {
    name: 'errorMean',
    label: text('track.errorMean'),
    help: text('track.errorMeanHelp'),
    optional: true,
    text: round,
  },
  {
    name: 'errorMost',
    label: text('track.errorHigh'),
    help: text('track.errorHighHelp'),
    optional: true,
    text: round,
  },
  { name: 'noise', label: text('track.noise'), help: text('track.noiseHelp'), text: round },
];

/** The tracking results so far, from which the Track lab's measures are computed. */
export interface Tracked {
  frames: readonly TrackedFrame[];
  /** Number of frames of the image. */
  count: number;
  frame: number;
  closing: number | undefined;
  noise: number;
}

/**
 * Returns the values of the tracking's measures by the names of the rows in {@link TRACK_ROWS}, and some that have no
 * row, for programs that read the page.
 */
export function moreOf({ frames, count, frame, closing, noise }: Tracked): Record<string, unknown> {
  const beat = frames.length === count ? beatOf(frames.map(({ facts }) => facts.volume)) : undefined;
  const shown = frames[frame];
  return {
    noise,
    frame: frame + 1,
    frames: count,
    tracked: frames.length,
    ...(shown && { folded: shown.facts.folded }),
    ...(shown?.error && { errorMean: shown.error.mean, errorMost: shown.error.p95 }),
    ...(beat && { ejection: beat.ejection, largest: beat.largest, smallest: beat.smallest }),
    ...(closing !== undefined && { closing }),
  };
}

const COLUMNS = [
  ...[
    'volume',
    'area',
    'triangles',
    'folded',
    'rejected',
    'heldMoves',
    'withoutBoundary',
    'steps',
    'meanFinalCorrection',
  ],
] as const;

/** Powers of the unit of length in columns. */
const POWERS: Partial<Record<string, string>> = {
  ...{ volume: '³', area: '²', meanFinalCorrection: '' },
  ...{ error: '', 'error (95 %)': '', 'true volume': '³' },
};

/** Returns the heading of a column, with its unit if it has one, and lengths have a known one. */
function headOf(column: string, unit: Unit): string {
  const power = POWERS[column];
  return unit !== '' && power !== undefined ? `${column} (${unit}${power})` : column;
}

/**
 * Returns the data of all tracked frames as CSV, one line per frame; lengths, areas and volumes in world units, which the
 * heads name if they are known. `truth` are the true volumes of the frames, if known, and `warnings` lists those of each
 * frame: if there are any, a last column has their codes.
 */
export function framesCsv(
  frames: readonly TrackedFrame[],
  truth: readonly number[] | undefined,
  warnings: readonly (readonly Warning[])[] = [],
  unit: Unit = '',
): string {
  const known = frames.some(({ error }) => error);
  const ofError = known ? ['error', 'error (95 %)', 'true volume'] : [];
  const isWarned = warnings.some((list) => list.length > 0);
  const names = ['frame', ...COLUMNS, 'self-intersections', ...ofError, ...(isWarned ? ['warnings'] : [])];
  const head = names.map((name) => headOf(name, unit));
  const lines = frames.map(({ facts, measures, error }, i) => [
    i + 1,
    ...COLUMNS.map((name) => facts[name as keyof typeof facts]),
    measures.report?.selfIntersections ?? '',
    ...(known ? [error?.mean ?? '', error?.p95 ?? '', truth?.[i] ?? ''] : []),
    ...(isWarned ? [cellOf(warnings[i] ?? [])] : []),
  ]);
  return csvOf([head, ...lines]);
}
