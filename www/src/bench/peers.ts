/** Comparison of this library's measurements with those of other software. */
import { count } from '../ui/format';
import type { PeerRow, Report, Side } from './report';
import type { Section } from './sections';
import { type Bar, type Figure, withUnit } from './targets';

/** Short form of the notes at the head of bench/peers.py. */
const NOTES = [
  'Below 1× ours takes less time, above 1× more. No figure was asked for here.',
  'Theirs is native code; ours is WebAssembly, but for remeshing, which is native on both sides. All have one thread.',
  'Marching cubes of scikit-image make normals, too.',
  'The level set starts 5 mm around the object and ends at ITK’s own criterion, on the voxels; ours starts outside the head and ends as a mesh.',
  'SciPy solves exactly with a matrix of all pairs, ours iterates. With 50 neighbours it solves a small system for each place asked about instead of one for all.',
  'MeshLab and CGAL do three rounds and stop there; ours goes on until all edges are in bounds, and keeps the surface from crossing itself.',
];

export function peerSection({ rows, load = 0, cores }: NonNullable<Report['peers']>): Section {
  const busy = `The machine was busy: its load was ${load.toFixed(1)} on ${cores} cores when this was measured. Ratios waver.`;
  return {
    id: 'peers',
    title: 'Beside other software',
    measured:
      'Other people’s software at comparable work on the same data, in the same run; the bars are our time to theirs.',
    command: 'npm run bench -- peers',
    notes: load > 1 ? [...NOTES, busy] : NOTES,
    charts: [{ title: 'Our time to theirs (less is better)', unit: '×', kind: 'ratio', figures: figuresOf(rows) }],
  };
}

/** Returns a figure for each task, with a bar for each package. */
function figuresOf(rows: PeerRow[]): Figure[] {
  const tasks = new Map(rows.map(({ task, name }) => [task, name]));
  return [...tasks].map(([task, name]) => ({ name, bars: rows.filter((row) => row.task === task).map(barOf) }));
}

function barOf(row: PeerRow): Bar {
  const label = row.version ? `${row.package} ${shortVersion(row.version)}` : row.package;
  if (row.ratio === undefined || !row.theirs) return { label, skipped: row.skipped ?? 'skipped' };
  const ours = ['ours', figureOf(row, row.ours), ...outcomeOf(row.ours)];
  const theirs = ['theirs', figureOf(row, row.theirs), row.theirs.what, ...outcomeOf(row.theirs)];
  return { label, value: row.ratio, remark: [ours, theirs].map(said).join('; ') };
}

const said = ([whose, figure, ...rest]: string[]) => `${whose} ${figure}${rest.map((one) => `, ${one}`).join('')}`;

/** Removes the post-release suffix of a version. */
export const shortVersion = (version: string) => version.replace(/\.post\d+$/, '');

function figureOf({ unit }: PeerRow, { figure }: Side): string {
  if (unit === 'ms' && figure >= 1000) return withUnit(figure / 1000, 's');
  return withUnit(figure, unit);
}

/** Returns the results that show how far the two runs are comparable. */
function outcomeOf({ triangles, vertices, volume, minAngleDegrees, refused }: Side): string[] {
  if (refused) return ['not a closed surface'];
  const words = [];
  if (triangles) words.push(`${count(triangles)} triangles`);
  else if (vertices) words.push(`${count(vertices)} vertices`);
  if (volume) words.push(`${count(volume / 1000)} cm³`);
  if (minAngleDegrees !== undefined) words.push(`angles from ${count(minAngleDegrees)}°`);
  return words;
}
