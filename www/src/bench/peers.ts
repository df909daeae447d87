/** Comparison of this library's measurements with those of other software. */

import { count } from '../kit/format';
import { text } from '../texts';
import type { PeerRow, Report, Side } from './report';
import type { Section } from './sections';
import { type Bar, type Figure, withUnit } from './targets';

/**
 * Notes displayed above the comparison: the meaning of the ratio (there are no targets), then a short form of the notes
 * at the head of bench/peers.py.
 */
const NOTES = [
  text('bench.peersRatioNote'),
  text('bench.peersNativeNote'),
  text('bench.peersNormalsNote'),
  text('bench.peersLevelSetNote'),
  text('bench.peersSolverNote'),
  text('bench.peersRemeshingNote'),
];

export function peerSection({ rows, load = 0, cores }: NonNullable<Report['peers']>): Section {
  const busy = text('bench.peersBusy', { load: load.toFixed(1), cores: cores ?? '–' });
  return {
    id: 'peers',
    title: text('bench.peersTitle'),
    measured: text('bench.peersMeasured'),
    command: 'npm run bench -- peers',
    notes: load > 1 ? [...NOTES, busy] : NOTES,
    charts: [{ title: text('bench.peersRatio'), unit: '×', kind: 'ratio', figures: figuresOf(rows) }],
  };
}

/** Returns a group of bars for each task of the comparison, with a bar for each other package that does it. */
function figuresOf(rows: PeerRow[]): Figure[] {
  const tasks = new Map(rows.map(({ task, name }) => [task, name]));
  return [...tasks].map(([task, name]) => ({ name, bars: rows.filter((row) => row.task === task).map(barOf) }));
}

function barOf(row: PeerRow): Bar {
  const label = row.version ? `${row.package} ${shortVersion(row.version)}` : row.package;
  if (row.ratio === undefined || !row.theirs) return { label, skipped: row.skipped ?? text('bench.skippedShort') };
  const ours = [text('bench.ours'), figureOf(row, row.ours), ...outcomeOf(row.ours)];
  const theirs = [text('bench.theirs'), figureOf(row, row.theirs), row.theirs.what, ...outcomeOf(row.theirs)];
  return { label, value: row.ratio, remark: [ours, theirs].map(describeSide).join('; ') };
}

const describeSide = ([whose, figure, ...rest]: string[]) =>
  `${whose} ${figure}${rest.map((one) => `, ${one}`).join('')}`;

/** Removes the post-release suffix, such as `.post1`, of a package's version, for display. */
export const shortVersion = (version: string) => version.replace(/\.post\d+$/, '');

function figureOf({ unit }: PeerRow, { figure }: Side): string {
  if (unit === 'ms' && figure >= 1000) return withUnit(figure / 1000, 's');
  return withUnit(figure, unit);
}

/**
 * Describes the result of one side of a comparison, this library or another package, such as its number of triangles
 * and its volume, so that the reader can judge how comparable the two sides are.
 */
function outcomeOf({ triangles, vertices, volume, minAngleDegrees, refused }: Side): string[] {
  if (refused) return [text('bench.notClosedSurface')];
  const words = [];
  if (triangles) words.push(text('bench.triangles', { count: count(triangles) }));
  else if (vertices) words.push(text('bench.vertices', { count: count(vertices) }));
  if (volume) words.push(text('bench.cubicCentimetres', { value: count(volume / 1000) }));
  if (minAngleDegrees !== undefined) words.push(text('bench.anglesFrom', { value: count(minAngleDegrees) }));
  return words;
}
