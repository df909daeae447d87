/** Selects the measurements of the report that are drawn, with their units and targets. */
import { count, plural } from '../ui/format';
import { pageSection } from './page';
import { peerSection } from './peers';
import type { HeadFigures, Host, Report, SkinRow, StepRow } from './report';
import type { Kind } from './scale';
import { atLeast, atMost, type Bar, type Figure, shortHost, type Target } from './targets';

export interface Chart {
  title: string;
  unit: string;
  kind: Kind;
  figures: Figure[];
}

export interface Section {
  id: string;
  title: string;
  /** Description of the measurement in one sentence. */
  measured: string;
  command: string;
  /** Notes to read before the figures. */
  notes: string[];
  charts: Chart[];
}

/** Returns the sections that can be drawn from a report; missing parts are omitted. */
export function sectionsOf(report: Report): Section[] {
  const { head, phantom, steps, points, skin, track, remesh, page, peers } = report;
  const made = [
    head && headSection(HEAD, head),
    phantom && headSection(PHANTOM, phantom),
    steps && stepSection(steps),
    points && pointSection(points),
    skin && skinSection(skin),
    track && trackSection(track),
    remesh && remeshSection(remesh),
    page && pageSection(page),
    peers && peerSection(peers),
  ];
  return made.filter((section) => section !== undefined);
}

const SECOND = 1000;
const MEGABYTE = 1e6;

/** Returns a figure with a bar for each host. */
function figure<T extends Host>(name: string, hosts: T[], value: (host: T) => number, target?: Target): Figure {
  return { name, bars: hosts.map((host): Bar => ({ label: shortHost(host.host), value: value(host) })), target };
}

/** Returns a figure for each row that the hosts have in common, by index. */
function figuresOfRows<Row>(
  hosts: (Host & { rows: Row[] })[],
  name: (row: Row) => string,
  value: (row: Row) => number,
  target?: (row: Row) => Target | undefined,
): Figure[] {
  const rows = hosts[0]?.rows ?? [];
  return rows.map((row, k) => figure(name(row), hosts, ({ rows }) => value(rows[k] as Row), target?.(row)));
}

const chart = (title: string, unit: string, figures: Figure[], kind: Kind = 'linear'): Chart => ({
  ...{ title, unit, figures, kind },
});

const commandOf = (name: string) => `npm run bench -- ${name}`;

const HEAD = { id: 'head', title: 'Head CT', of: 'A CT of a head at the intensity of bone' };
const PHANTOM = {
  ...{ id: 'phantom', title: 'Head phantom' },
  of: 'Two nested shells with holes and noise, of the size of the paper’s tomography',
};

function headSection({ id, title, of }: typeof HEAD, hosts: (Host & HeadFigures)[]): Section {
  const parts = Object.keys(hosts[0]?.model.parts ?? {});
  return {
    ...{ id, title, command: commandOf(id) },
    measured: `${of}, ${hosts[0]?.dims.join(' × ')} voxels: marching cubes, and the deformable model from its start around the object until it rests, coarse to fine on three levels.`,
    notes: hosts.map(outcome),
    charts: [
      chart('Time', 's', [
        figure('Deformable model until it rests', hosts, ({ model }) => model.milliseconds / SECOND, atMost(2)),
        figure('Marching cubes', hosts, ({ cubes }) => cubes.milliseconds / SECOND),
      ]),
      chart('Against marching cubes in the same run', '×', [
        figure('Deformable model to marching cubes', hosts, ({ ratio }) => ratio, atMost(25)),
      ]),
      chart(
        'Where the time of the model goes',
        's',
        parts.map((part) => figure(part, hosts, ({ model }) => (model.parts[part] ?? 0) / SECOND)),
      ),
    ],
  };
}

function outcome({ host, model }: Host & HeadFigures): string {
  const rest = model.converged ? 'came to rest' : 'did not come to rest';
  return `${shortHost(host)}: ${rest} after ${plural(model.iterations, 'iteration')} with ${count(model.vertices)} vertices, ${model.closed ? 'closed' : 'not closed'}, ${plural(model.selfIntersections, 'crossing')}.`;
}

type Steps = Host & { rows: StepRow[] };

const verticesOf = ({ vertices }: StepRow) => `${count(vertices)} vertices`;

function stepSection(hosts: Steps[]): Section {
  return {
    id: 'steps',
    title: 'One step of the deformable model',
    measured:
      'A sphere closes in on a ball in 256³ voxels while all its vertices move, at three sizes: the best of six steps.',
    command: commandOf('steps'),
    notes: [],
    charts: [
      chart(
        'Time of a step for each vertex',
        'ns',
        figuresOfRows(hosts, verticesOf, ({ step }) => step),
      ),
      chart('Dearest size to cheapest', '×', [
        figure('Cost of a vertex over the three sizes', hosts, ({ rows }) => spread(rows), atMost(1.3)),
      ]),
      chart('Topology in one step', 'ms', topologyFigures(hosts), 'log'),
      ...overNative(hosts),
    ],
  };
}

function spread(rows: StepRow[]): number {
  const steps = rows.map(({ step }) => step);
  return Math.max(...steps) / Math.min(...steps);
}

/** Only the middle size has a target. */
function topologyFigures(hosts: Steps[]): Figure[] {
  return figuresOfRows(
    hosts,
    (row) => `Topology, ${verticesOf(row)}`,
    ({ topology }) => topology,
    ({ vertices }) => (near(vertices, 65_000) ? atMost(10) : undefined),
  );
}

/** Returns the chart of each host's time relative to native code, if that was measured. */
function overNative(hosts: Steps[]): Chart[] {
  const native = hosts.find(({ host }) => host === 'native');
  if (!native) return [];
  const name = (row: StepRow) => `WebAssembly to native, ${verticesOf(row)}`;
  const others = hosts.filter((host) => host !== native);
  const figures = native.rows.map((row, k) =>
    figure(name(row), others, ({ rows }) => (rows[k]?.step ?? Number.NaN) / row.step, atMost(1.3)),
  );
  return [chart('WebAssembly against native', '×', figures)];
}

const near = (value: number, other: number) => Math.abs(value / other - 1) < 0.15;

function pointSection(hosts: NonNullable<Report['points']>): Section {
  const [one] = hosts;
  const size = (which: 'few' | 'many') =>
    `${count((one?.[which].points ?? 0) + (one?.[which].exterior ?? 0))} constraints`;
  const of = (name: string, value: (host: NonNullable<typeof one>) => number, limit?: number) =>
    figure(name, hosts, (host) => value(host) / SECOND, limit === undefined ? undefined : atMost(limit));
  return {
    id: 'points',
    title: 'Points to a surface',
    measured:
      'Points of a torus, and one in ten more outside of it, to an implicit surface, taken from 128 cells along its box: the best of three, and the first, while code is still being compiled.',
    command: commandOf('points'),
    notes: [],
    charts: [
      chart('Solving', 's', [
        of(`Solving ${size('few')}`, ({ few }) => few.solve, 0.2),
        of(`Solving ${size('few')}, the first time`, ({ few }) => few.first.solve),
        of(`Solving ${size('many')}`, ({ many }) => many.solve, 3),
        of(`Solving ${size('many')}, the first time`, ({ many }) => many.first.solve),
        of(`Solving ${size('many')}, one point more by hand`, ({ many }) => many.solveAfterEdit),
      ]),
      chart('Taking the surface', 's', [
        of(`Surface of ${size('few')}`, ({ few }) => few.extract, 1),
        of(`Surface of ${size('many')}`, ({ many }) => many.extract, 1),
      ]),
      chart('Memory of the module at the end', 'MB', [
        figure(`Memory with ${size('many')}`, hosts, ({ bytes }) => bytes / MEGABYTE, atMost(250)),
      ]),
    ],
  };
}

/** Returns the target of a row; only sizes near 20,000 triangles have one. */
function asked({ name, triangles }: SkinRow): Target | undefined {
  return near(triangles, 20_000) ? atLeast(name === 'lava lamp' ? 30 : 10) : undefined;
}

function skinSection(hosts: NonNullable<Report['skin']>): Section {
  return {
    id: 'skin',
    title: 'Sculpting',
    measured:
      'Frames of the multiresolution model while its ellipsoids move: a lava lamp without detail, and a bust whose head is pulled about; one over the middle time of 60 frames.',
    command: commandOf('skin'),
    notes: [],
    charts: [
      chart(
        'Frames a second (more is better)',
        'frames/s',
        figuresOfRows(
          hosts,
          ({ name, triangles }) => `${name}, ${count(triangles)} triangles`,
          ({ milliseconds }) => 1000 / milliseconds,
          asked,
        ),
      ),
    ],
  };
}

function trackSection(hosts: NonNullable<Report['track']>): Section {
  const [one] = hosts;
  const of = (name: string, value: (run: NonNullable<typeof one>['run']) => number) =>
    figure(name, hosts, ({ run }) => value(run) / SECOND);
  return {
    id: 'track',
    title: 'Tracking',
    measured: `A beating ventricle as cine MR shows it, ${one?.dims.join(' × ')} voxels and ${one?.frames} frames: from thick slices to a closed surface in every frame.`,
    command: commandOf('track'),
    notes: [],
    charts: [
      chart('The whole', 's', [
        figure(`All ${one?.frames} frames`, hosts, ({ run }) => run.milliseconds / SECOND, atMost(10)),
        figure('Marching cubes on all frames', hosts, ({ cubes }) => cubes / SECOND),
      ]),
      chart('Where the time goes', 's', [
        of('in-between slices', ({ enrich }) => enrich),
        of('before the votes', ({ begin }) => begin),
        of('votes', ({ votes }) => votes),
        of('surfaces', ({ tracked }) => tracked),
        of('back to the first frame', ({ closingTime }) => closingTime),
      ]),
    ],
  };
}

function remeshSection(hosts: NonNullable<Report['remesh']>): Section {
  return {
    id: 'remesh',
    title: 'Remeshing',
    measured:
      'A torus of uneven triangles and a gyroid as marching cubes give it, to edges half as long as they were in the mean, as long, and three times as long.',
    command: commandOf('remesh'),
    notes: [],
    charts: [
      chart(
        'Time for each triangle that comes out',
        'µs',
        figuresOfRows(
          hosts,
          ({ name, factor }) => `${name}, edges × ${factor}`,
          ({ milliseconds, triangles }) => (1000 * milliseconds) / triangles,
          () => atMost(5, 'native'),
        ),
      ),
    ],
  };
}
