/**
 * The schema of sessions: all that a session holds is checked against it before anything is used, and what it does not
 * have is left out.
 */
import { type BaseIssue, type InferOutput, safeParse, variant } from 'valibot';
import { text } from '../../../texts';
import { LAB_IDS } from '../../address';
import { extract } from './extract';
import { reconstruct } from './reconstruct';
import { sculpt } from './sculpt';
import { mismatchOf, segment } from './segment';
import { track } from './track';

const schema = variant('lab', [extract, reconstruct, sculpt, segment, track]);

type Fields = InferOutput<typeof schema>;
type LabId = Fields['lab'];
type FieldsOf<Lab extends LabId> = Extract<Fields, { lab: Lab }>;
/** The lab's own part of a session of a lab: its model, history, undo and view. */
export type ContentOf<Lab extends LabId> = Omit<FieldsOf<Lab>, 'lab' | 'hash' | 'source'>;
/** The session of a lab. */
export type SessionOf<Lab extends LabId> = Pick<FieldsOf<Lab>, 'lab' | 'hash' | 'source'> & {
  content: ContentOf<Lab>;
  /** Whether its file is small, so that its edits may not give a large surface. */
  isSmall?: boolean;
};
/** A lab as the user left it. */
export type Session = { [Lab in LabId]: SessionOf<Lab> }[LabId];

/** Longest part of a file's words in a message. */
const MOST_SHOWN = 100;

/** Returns a session of which `fields` are all; throws an Error that names the first field that is wrong. */
export function checked(fields: Record<string, unknown>): Session {
  if (!LAB_IDS.some((id) => id === fields.lab))
    throw new Error(text('sessions.otherLab', { lab: shown(String(fields.lab ?? '–')) }));
  const result = safeParse(schema, fields, { abortEarly: true });
  if (!result.success) throw wrong(pathOf(result.issues[0]), reasonOf(result.issues[0]));
  const mismatch = firstMismatch(result.output);
  if (mismatch) throw wrong(mismatch, text('sessions.fieldMismatch'));
  const { lab, hash, source, ...content } = result.output;
  return { lab, hash, source, content } as Session;
}

const wrong = (path: string, reason: string) => new Error(text('sessions.badField', { path: shown(path), reason }));

/** Returns the beginning of a text of a file, for a message. */
export const shown = (words: string) => (words.length > MOST_SHOWN ? `${words.slice(0, MOST_SHOWN)}…` : words);

function pathOf({ path }: BaseIssue<unknown>): string {
  const keys = (path ?? []).map(({ key }) => (typeof key === 'number' ? `[${key}]` : `.${key}`));
  return keys.join('').replace(/^\./, '');
}

const TOO_LONG = ['max_length', 'max_entries'];
const UNKNOWN = ['picklist', 'literal', 'variant', 'regex'];
const NUMBERS = ['number', 'finite', 'safe_integer', 'min_value', 'max_value'];

/** Says in words what is wrong with a field. */
function reasonOf({ type, input }: BaseIssue<unknown>): string {
  if (input === undefined) return text('sessions.fieldMissing');
  if (TOO_LONG.includes(type)) return text('sessions.fieldTooLong');
  if (UNKNOWN.includes(type)) return text('sessions.fieldUnknown');
  return text(NUMBERS.includes(type) ? 'sessions.fieldNumber' : 'sessions.fieldWrong');
}

/** Returns the path of the first field that refers to something that the session does not have. */
function firstMismatch(session: Fields): string | undefined {
  if (session.lab === 'segment') return mismatchOf(session);
  if (session.lab === 'reconstruct') return undefined;
  const { page, undo, redo, reports } = session;
  const frames = session.lab === 'track' ? session.frames.length : Number.POSITIVE_INFINITY;
  const pages: [string, { history: { list: number }; frames?: number[] }][] = [['page', page]];
  for (const [list, states] of Object.entries({ undo, redo }))
    for (const [index, state] of states.entries()) pages.push([`${list}[${index}].page`, state.page]);
  for (const [path, { history, frames: used = [] }] of pages) {
    if (history.list >= reports.length) return `${path}.history.list`;
    if (used.some((frame) => frame >= frames)) return `${path}.frames`;
  }
  return undefined;
}
