/** Random sessions of all labs, as the app could have made them. */
import fc, { type Arbitrary } from 'fast-check';
import { shortName } from '../../www/src/engine/labels';
import type { LabId } from '../../www/src/lab/address';
import type { NewSession, SourceFile } from '../../www/src/lab/session/file';
import { optionsOf, VIEWS } from './made-views';

const { constantFrom, nat, record, tuple } = fc;
const flag = fc.boolean();
const real = fc.double({ noNaN: true, noDefaultInfinity: true });
const anyNumber = fc.double();
const coordinate = fc.double({ noNaN: true, min: -1e30, max: 1e30 });
const vec3 = tuple(coordinate, coordinate, coordinate);
const words = (maxLength: number) => fc.string({ unit: 'binary', maxLength });
const name = words(60).map(shortName);
const count = nat(1000);
const list = <T>(item: Arbitrary<T>, maxLength = 3) => fc.array(item, { maxLength });
/** A value that may be missing. */
const maybe = <T>(value: Arbitrary<T>) => fc.option(value, { nil: undefined });
const named = <T>(value: Arbitrary<T>) => fc.dictionary(fc.stringMatching(/^[a-z]{1,8}$/), value, { maxKeys: 4 });
const params = named(fc.oneof(real, flag, words(20))).map((values) => ({ ...values, iso: 1 }));
const bytes = fc.uint8Array({ maxLength: 20 });

const warning = record({
  code: constantFrom('reader', 'ends-in-frame', 'precision'),
  text: words(30),
  where: maybe(fc.oneof(record({ frame: count }), record({ label: count }), record({ point: vec3 }))),
});
const report = record({
  ...{ iteration: count, done: flag, phase: words(20), progress: anyNumber, residual: anyNumber, tolerance: real },
  ...{ vertices: count, triangles: count, components: count, euler: fc.integer(), times: named(real) },
  events: record({
    ...{ creations: count, deletions: count, inversions: count, axial: count, annular: count },
    ...{ vanished: count, seeds: count },
  }),
  warnings: list(warning, 2),
});
const reports = fc.array(list(report), { minLength: 1, maxLength: 2 });
const history = record({ list: fc.constant(0), iteration: count });
const camera = record({ position: vec3, target: vec3 });

const edit = fc.oneof(
  record({ op: fc.constant('remesh'), min: real, max: real }),
  record({ op: fc.constant('decimate'), targetTriangles: count }),
  record({ op: fc.constant('smooth'), iterations: count, keepVolume: flag }),
  record({ op: fc.constant('keepComponents'), indices: list(count) }),
  record({ op: fc.constant('removeCavities') }),
  record({ op: fc.constant('cut'), origin: vec3, normal: vec3 }),
);
const common = { edits: list(edit, 2), undone: list(edit, 2), warnings: list(warning, 2) };
const undoable = (entries: Record<string, Arbitrary<unknown>>) => list(record({ label: name, ...entries }), 2);
const logOf = (setup: Arbitrary<unknown>, ...calls: [string, Arbitrary<unknown>][]) => {
  const call = calls.map(([method, given]) => record({ call: fc.constant(method), given }));
  return maybe(record({ setup, calls: list(fc.oneof(record({ call: fc.constant('step'), given: count }), ...call)) }));
};

const attractors = list(record({ point: vec3, strength: real, radius: real }), 2);
const start = fc.oneof(
  record({ kind: constantFrom('contour', 'enclosing', 'isosurface') }),
  record({ kind: fc.constant('bubbles'), count }),
  record({ kind: fc.constant('sphere'), center: vec3, radius: real }),
);
const setup = record({ start, levels: count, edge: maybe(real), params, attractors });
const moment = {
  state: bytes,
  model: record({
    ...{ levels: count, iteration: count, done: flag },
    log: logOf(setup, ['setParams', params], ['setAttractors', attractors], ['seed', fc.constant(undefined)]),
  }),
  page: record({
    choice: record({ kind: constantFrom('contour', 'sphere'), bubbles: count, levels: count, edge: maybe(real) }),
    ...{ params, attractors, history },
  }),
};
const extract = record({
  ...{ ...common, ...moment, undo: undoable(moment), redo: undoable(moment), reports },
  view: record({ camera, crosshair: vec3, options: optionsOf(VIEWS.extract) }),
});

const edits = record({ added: list(vec3), removed: list(count), outside: list(vec3) });
const choice = { maxPoints: maybe(count), keepComponents: maybe(count) };
const cloud = record({ params, ...choice, edits });
const settings = { bytes: count, state: record({ choice: record(choice), params, edits }) };
const cloudLog = logOf(cloud, ['setParams', params], ['setEdits', edits]);
const reconstruct = record({
  ...{ ...common, state: bytes, undo: undoable(settings), redo: undoable(settings), reports },
  model: record({ setup: cloud, last: maybe(report), log: cloudLog }),
  view: record({ camera, options: optionsOf(VIEWS.reconstruct) }),
});

const pose = list(record({ center: vec3, axes: tuple(vec3, vec3, vec3) }), 2);
const film = fc.oneof(
  record({
    keys: fc.array(pose, { minLength: 1, maxLength: 2 }),
    between: fc.integer({ min: 1, max: 99 }),
    loop: flag,
  }),
  record({ motion: fc.constant('lava'), loop: flag }),
);
const posed = {
  state: bytes,
  model: record({ start: pose, iteration: count, frame: count, log: maybe(words(10)) }),
  page: record({ names: list(name), posed: flag, film: maybe(film), history }),
};
const sculpt = record({
  ...{ ...common, ...posed, undo: undoable(posed), redo: undoable(posed), reports, params },
  log: logOf(record({ start: pose, params }), ['setParams', params], ['setEllipsoids', pose]),
  view: record({ camera, options: optionsOf(VIEWS.sculpt) }),
});

const preparation = record({
  ...{ binning: constantFrom(1, 2), enrichment: constantFrom('none', 'flow'), factor: nat(16) },
});
const tracking = record({
  ...{ preparation, box: maybe(record({ min: vec3, max: vec3 })), at: maybe(vec3), params },
  cavity: constantFrom('closed', 'open'),
});
const tracked = {
  state: bytes,
  model: record({ setup: tracking, iteration: count, done: flag, log: logOf(tracking, ['setParams', params]) }),
  page: record({ closing: maybe(anyNumber), frames: list(fc.constant(0)), history }),
};
const single = fc.float({ noNaN: true, noDefaultInfinity: true });
const nine = fc.array(single, { minLength: 9, maxLength: 9 }).map((values) => Float32Array.from(values));
const surface = record({
  ...{ origin: vec3, vertices: fc.constant(3), triangles: fc.constant(1), positions: nine, normals: nine },
  indices: fc.constant(Uint32Array.of(0, 1, 2)),
});
const info = record({
  ...{ vertices: count, triangles: count, components: count, euler: fc.integer(), genus: real, area: real },
  ...{ volume: real, centroid: vec3, inertia: list(real), minAngleDegrees: anyNumber },
  ...{ edge: record({ min: real, mean: real, max: real }), bounds: record({ min: vec3, max: vec3 }) },
});
const facts = record({
  ...{ volume: real, area: real, triangles: count, folded: count, rejected: count, heldMoves: count },
  ...{ withoutBoundary: count, steps: real, meanFinalCorrection: anyNumber },
});
const frame = record({ surface, facts, measures: record({ info }), error: maybe(record({ mean: real, p95: real })) });
const track = record({
  ...{ ...common, ...tracked, undo: undoable(tracked), redo: undoable(tracked), reports },
  frames: fc.array(frame, { minLength: 1, maxLength: 2 }),
  view: record({ camera, crosshair: vec3, frame: count, options: optionsOf(VIEWS.track) }),
});

const label = record({ value: fc.integer({ min: 1, max: 255 }), name, color: fc.stringMatching(/^#[0-9a-f]{6}$/) });
const ordered = tuple(real, real).map(([one, other]) => (one <= other ? [one, other] : [other, one]));
const segment = fc.uniqueArray(label, { minLength: 1, maxLength: 4, selector: ({ value }) => value }).chain((labels) =>
  record({
    ...{ ...common, voxels: fc.uint8Array({ maxLength: 20 }), state: bytes, labels: fc.constant(labels), params },
    active: constantFrom(...labels.map(({ value }) => value)),
    hidden: fc.subarray(labels.map(({ value }) => value)),
    tools: record({
      ...{ tool: constantFrom('brush', 'fill'), shape: constantFrom('ball', 'disc'), extent: fc.constant('box') },
      ...{ radius: real, range: ordered, reach: real, inRange: flag, protect: flag },
    }),
    view: record({ camera, crosshair: vec3, options: optionsOf(VIEWS.segment) }),
  }),
);

const file: Arbitrary<SourceFile> = record({
  ...{ name, size: count, sha256: fc.stringMatching(/^[0-9a-f]{64}$/), content: maybe(bytes) },
  notes: maybe(record({ warnings: list(warning, 2), remarks: maybe(list(words(20))) })),
});
const source: Arbitrary<NewSession['source']> = record({ name, example: maybe(words(20)), files: list(file, 2) });
const contents = { extract, reconstruct, sculpt, track, segment } satisfies Record<LabId, unknown>;

/** A session of any of the labs. */
export const anySession: Arbitrary<NewSession> = fc.oneof(
  ...Object.entries(contents).map(([lab, content]) =>
    record({ lab: fc.constant(lab as NewSession['lab']), hash: words(50), source, content }),
  ),
);
