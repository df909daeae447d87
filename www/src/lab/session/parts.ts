/** Parts of sessions that several labs have. */
import {
  custom,
  type GenericSchema,
  is,
  literal,
  type ObjectEntries,
  object,
  optional,
  pipe,
  strictObject,
  transform,
  union,
  unknown,
  variant,
} from 'valibot';
import type { Warning } from '../../engine/warnings';
import { anyNumber, between, bytes, count, flag, list, name, named, real, text, vec3 } from './values';

const warning = object({
  // Later versions may have other kinds.
  code: custom<Warning['code']>((value) => typeof value === 'string' && /^[a-z-]{1,100}$/.test(value)),
  text: text(2000),
  where: optional(union([object({ frame: count }), object({ label: real }), object({ point: vec3 })])),
});
/** The package has up to 1000, of data and of a result. */
const warnings = list(warning, 2000);

const notes = object({
  warnings,
  remarks: optional(list(text(), 1000)),
  space: optional(literal('LPS')),
  inverted: optional(flag),
});

const sourceFile = object({
  // Not cut: its ending says what the file is.
  name: text(1000),
  size: count,
  sha256: text(64),
  content: optional(bytes),
  notes: optional(notes),
});

/** Report of a step; early files have none of its warnings. */
export const report = object({
  ...{ iteration: count, done: flag, phase: text(200), progress: anyNumber, residual: anyNumber, tolerance: anyNumber },
  ...{ vertices: count, triangles: count, components: count, euler: real, times: named(real, 100) },
  events: object({
    ...{ creations: count, deletions: count, inversions: count, axial: count, annular: count },
    ...{ vanished: count, seeds: count },
  }),
  warnings: optional(warnings, () => []),
});
/** Lists of reports of all steps. */
export const reports = list(list(report, 1e6), 1000);

const edit = variant('op', [
  object({ op: literal('remesh'), min: real, max: real }),
  object({ op: literal('decimate'), targetTriangles: real }),
  object({ op: literal('decimateWithin'), maxDistance: real }),
  object({ op: literal('smooth'), iterations: between(0, 1e6), keepVolume: flag }),
  object({ op: literal('keepComponents'), indices: list(count, 1e6) }),
  object({ op: literal('removeCavities') }),
  object({ op: literal('cut'), origin: vec3, normal: vec3 }),
]);
const edits = list(edit, 10_000);
/** Some early files have an empty object in place of no edits. */
const orEarly = transform((value: unknown) => (is(strictObject({}), value) ? [] : value));

/** Fields that the sessions of all labs have. */
export const session = {
  /** As a link has it, with the poses of a film. */
  hash: text(2 ** 20),
  source: object({ name, example: optional(text(200)), files: list(sourceFile) }),
  edits: optional(pipe(unknown(), orEarly, edits), () => []),
  undone: optional(edits, () => []),
  warnings: optional(warnings, () => []),
};

/** Log of a run: the set-up, and calls of the methods in `given`, each with the schema of what it was given. */
export function log<const Setup extends GenericSchema, const Calls extends GenericSchema>(setup: Setup, call: Calls) {
  return object({ setup, calls: list(call, 20_000) });
}

/** A call of a method in a log. */
export const call = <const Name extends string, const Given extends GenericSchema>(method: Name, given: Given) =>
  object({ call: literal(method), given });
export const steps = call('step', count);

/** A state to undo or to redo. */
export const undoable = <const Entries extends ObjectEntries>(entries: Entries) =>
  list(object({ label: name, ...entries }), 1000);

/** Fields of a session with saved states: that of the present, those to undo and to redo, and reports. */
export const states = <const Entries extends ObjectEntries>(moment: Entries) => ({
  ...moment,
  ...{ undo: undoable(moment), redo: undoable(moment), reports },
});

/** Position in the lists of reports. */
export const history = object({ list: count, iteration: count });

export const camera = object({ position: vec3, target: vec3 });

interface Page {
  history: { list: number };
  frames?: number[];
}

interface WithMarks {
  page: Page;
  undo: { page: Page }[];
  redo: { page: Page }[];
  reports: unknown[];
}

/** Returns the path of the first saved state of a session that refers to a list of reports, or a frame, which it does not have. */
export function markMismatch(
  { page, undo, redo, reports }: WithMarks,
  frames = Number.POSITIVE_INFINITY,
): string | undefined {
  const pages: [string, Page][] = [['page', page]];
  for (const [list, states] of Object.entries({ undo, redo }))
    for (const [index, state] of states.entries()) pages.push([`${list}[${index}].page`, state.page]);
  for (const [path, { history, frames: used = [] }] of pages) {
    if (history.list >= reports.length) return `${path}.history.list`;
    if (used.some((frame) => frame >= frames)) return `${path}.frames`;
  }
  return undefined;
}
