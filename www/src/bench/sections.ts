/** Selects the measurements of the report that the benchmark page draws, with their units and targets. */

import { count } from '../kit/format';
import { plural, text } from '../texts';
import { pageSection } from './page';
import { peerSection } from './peers';
import type { HeadFigures, Host, Report, SculptRow, StepRow } from './report';
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
  /** Description of what was measured, in one sentence. */
  measured: string;
  command: string;
  /** Notes displayed above the charts. */
  notes: string[];
  charts: Chart[];
}

/**
 * Returns the sections of the benchmark page that can be drawn from a report; those without measurements are omitted.
 */
export function sectionsOf(report: Report): Section[] {
  const { head, phantom, steps, points, skin, track, remesh, page, peers } = report;
  const made = [
    head && headSection(HEAD, head),
    phantom && headSection(PHANTOM, phantom),
    steps && stepSection(steps),
    points && pointSection(points),
    skin && sculptSection(skin),
    track && trackSection(track),
    remesh && remeshSection(remesh),
    page && pageSection(page),
    peers && peerSection(peers),
  ];
  return made.filter((section) => section !== undefined);
}

const SECOND = 1000;
const MEGABYTE = 1e6;

/**
 * Returns a figure, a group of bars of a chart, with a bar for each host; `value` takes the measurement from a host's
 * results.
 */
function figure<T extends Host>(name: string, hosts: T[], value: (host: T) => number, target?: Target): Figure {
  return { name, bars: hosts.map((host): Bar => ({ label: shortHost(host.host), value: value(host) })), target };
}

/**
 * Returns a figure, a group of bars of a chart, for each row of the first host's results, with a bar for each host's
 * row of the same index.
 */
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

const HEAD = { id: 'head', title: text('bench.headTitle'), of: text('bench.headOf') };
const PHANTOM = {
  ...{ id: 'phantom', title: text('bench.phantomTitle') },
  of: text('bench.phantomOf'),
};

function headSection({ id, title, of }: typeof HEAD, hosts: (Host & HeadFigures)[]): Section {
  const parts = Object.keys(hosts[0]?.model.parts ?? {});
  return {
    ...{ id, title, command: commandOf(id) },
    measured: text('bench.headMeasured', { of, dims: hosts[0]?.dims.join(' × ') ?? '' }),
    notes: hosts.map(outcome),
    charts: [
      chart(text('bench.time'), 's', [
        figure(text('bench.modelTime'), hosts, ({ model }) => model.milliseconds / SECOND, atMost(2)),
        figure(text('bench.marchingCubes'), hosts, ({ cubes }) => cubes.milliseconds / SECOND),
      ]),
      chart(text('bench.againstCubes'), '×', [
        figure(text('bench.modelToCubes'), hosts, ({ ratio }) => ratio, atMost(25)),
      ]),
      chart(
        text('bench.modelParts'),
        's',
        parts.map((part) => figure(part, hosts, ({ model }) => (model.parts[part] ?? 0) / SECOND)),
      ),
    ],
  };
}

function outcome({ host, model }: Host & HeadFigures): string {
  const result = model.converged ? text('bench.converged') : text('bench.notConverged');
  return text('bench.outcome', {
    host: shortHost(host),
    result,
    iterations: plural('bench.iterations', model.iterations),
    vertices: count(model.vertices),
    closed: model.closed ? text('bench.closed') : text('bench.notClosed'),
    selfIntersections: plural('bench.selfIntersections', model.selfIntersections),
  });
}

type Steps = Host & { rows: StepRow[] };

const verticesOf = ({ vertices }: StepRow) => text('bench.vertices', { count: count(vertices) });

function stepSection(hosts: Steps[]): Section {
  return {
    id: 'steps',
    title: text('bench.stepsTitle'),
    measured: text('bench.stepsMeasured'),
    command: commandOf('steps'),
    notes: [],
    charts: [
      chart(
        text('bench.stepsTime'),
        'ns',
        figuresOfRows(hosts, verticesOf, ({ step }) => step),
      ),
      chart(text('bench.stepsSpread'), '×', [
        figure(text('bench.stepsSpreadOf'), hosts, ({ rows }) => spread(rows), atMost(1.3)),
      ]),
      chart(text('bench.stepsTopology'), 'ms', topologyFigures(hosts), 'log'),
      ...overNative(hosts),
    ],
  };
}

function spread(rows: StepRow[]): number {
  const steps = rows.map(({ step }) => step);
  return Math.max(...steps) / Math.min(...steps);
}

/**
 * Returns the groups of bars for the duration of a topology update, one for each mesh size; only that near 65,000
 * vertices has a target.
 */
function topologyFigures(hosts: Steps[]): Figure[] {
  return figuresOfRows(
    hosts,
    (row) => text('bench.stepsTopologyOf', { vertices: verticesOf(row) }),
    ({ topology }) => topology,
    ({ vertices }) => (near(vertices, 65_000) ? atMost(10) : undefined),
  );
}

/**
 * Returns a chart of the step time of the deformable model on each other host relative to native code; an empty array
 * if native code was not measured.
 */
function overNative(hosts: Steps[]): Chart[] {
  const native = hosts.find(({ host }) => host === 'native');
  if (!native) return [];
  const name = (row: StepRow) => text('bench.stepsNativeOf', { vertices: verticesOf(row) });
  const others = hosts.filter((host) => host !== native);
  const figures = native.rows.map((row, k) =>
    figure(name(row), others, ({ rows }) => (rows[k]?.step ?? Number.NaN) / row.step, atMost(1.3)),
  );
  return [chart(text('bench.stepsNative'), '×', figures)];
}

const near = (value: number, other: number) => Math.abs(value / other - 1) < 0.15;

function pointSection(hosts: NonNullable<Report['points']>): Section {
  const [one] = hosts;
  const size = (which: 'few' | 'many') =>
    text('bench.constraints', { count: count((one?.[which].points ?? 0) + (one?.[which].exterior ?? 0)) });
  const of = (name: string, value: (host: NonNullable<typeof one>) => number, limit?: number) =>
    figure(name, hosts, (host) => value(host) / SECOND, limit === undefined ? undefined : atMost(limit));
  return {
    id: 'points',
    title: text('bench.pointsTitle'),
    measured: text('bench.pointsMeasured'),
    command: commandOf('points'),
    notes: [],
    charts: [
      chart(text('bench.solving'), 's', [
        of(text('bench.solvingOf', { size: size('few') }), ({ few }) => few.solve, 0.2),
        of(text('bench.solvingFirst', { size: size('few') }), ({ few }) => few.first.solve),
        of(text('bench.solvingOf', { size: size('many') }), ({ many }) => many.solve, 3),
        of(text('bench.solvingFirst', { size: size('many') }), ({ many }) => many.first.solve),
        of(text('bench.solvingEdit', { size: size('many') }), ({ many }) => many.solveAfterEdit),
      ]),
      chart(text('bench.extraction'), 's', [
        of(text('bench.extractionOf', { size: size('few') }), ({ few }) => few.extract, 1),
        of(text('bench.extractionOf', { size: size('many') }), ({ many }) => many.extract, 1),
      ]),
      chart(text('bench.memoryEnd'), 'MB', [
        figure(text('bench.memoryOf', { size: size('many') }), hosts, ({ bytes }) => bytes / MEGABYTE, atMost(250)),
      ]),
    ],
  };
}

/**
 * Returns the target frame rate of a row of the Sculpt benchmark; undefined unless its mesh has about 20,000 triangles.
 */
function targetOf({ name, triangles }: SculptRow): Target | undefined {
  return near(triangles, 20_000) ? atLeast(name === 'lava lamp' ? 30 : 10) : undefined;
}

function sculptSection(hosts: NonNullable<Report['skin']>): Section {
  return {
    id: 'skin',
    title: text('bench.sculptTitle'),
    measured: text('bench.sculptMeasured'),
    command: commandOf('skin'),
    notes: [],
    charts: [
      chart(
        text('bench.sculptFrames'),
        'frames/s',
        figuresOfRows(
          hosts,
          ({ name, triangles }) => text('bench.pageTriangles', { name, triangles: count(triangles) }),
          ({ milliseconds }) => 1000 / milliseconds,
          targetOf,
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
    title: text('bench.trackTitle'),
    measured: text('bench.trackMeasured', { dims: one?.dims.join(' × ') ?? '', frames: one?.frames ?? 0 }),
    command: commandOf('track'),
    notes: [],
    charts: [
      chart(text('bench.trackTotal'), 's', [
        figure(
          text('bench.trackAll', { frames: one?.frames ?? 0 }),
          hosts,
          ({ run }) => run.milliseconds / SECOND,
          atMost(10),
        ),
        figure(text('bench.trackCubes'), hosts, ({ cubes }) => cubes / SECOND),
      ]),
      chart(text('bench.trackParts'), 's', [
        of(text('bench.trackBetween'), ({ enrich }) => enrich),
        of(text('bench.trackBefore'), ({ begin }) => begin),
        of(text('bench.trackVotes'), ({ votes }) => votes),
        of(text('bench.trackSurfaces'), ({ tracked }) => tracked),
        of(text('bench.trackBack'), ({ closingTime }) => closingTime),
      ]),
    ],
  };
}

function remeshSection(hosts: NonNullable<Report['remesh']>): Section {
  return {
    id: 'remesh',
    title: text('bench.remeshTitle'),
    measured: text('bench.remeshMeasured'),
    command: commandOf('remesh'),
    notes: [],
    charts: [
      chart(
        text('bench.remeshTime'),
        'µs',
        figuresOfRows(
          hosts,
          ({ name, factor }) => text('bench.remeshOf', { name, factor }),
          ({ milliseconds, triangles }) => (1000 * milliseconds) / triangles,
          () => atMost(5, 'native'),
        ),
      ),
    ],
  };
}
