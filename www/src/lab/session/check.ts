/** Checks all that a session holds before anything of it is used; what its schema does not have is left out. */
import { type BaseIssue, type GenericSchema, type InferOutput, type ObjectSchema, safeParse } from 'valibot';
import { text } from '../../texts';
import type { LabId } from '../address';
import type { session } from './parts';

/** Fields that the sessions of all labs have. */
type Shared = InferOutput<ObjectSchema<typeof session, undefined>>;

/** A lab as the user left it. */
export interface Session extends Pick<Shared, 'hash' | 'source'> {
  /** Id of the lab. */
  lab: LabId;
  /** The lab's own part: its model, history, undo and view. */
  content: Pick<Shared, 'edits' | 'undone' | 'warnings'>;
  /** Whether its file is small, so that its edits may not give a large surface. */
  isSmall?: boolean;
}

/** The schema of a lab's sessions, with what it cannot say. */
export interface SessionSchema {
  schema: GenericSchema<unknown, Shared & { lab: LabId }>;
  /** Returns the path of the first field that does not fit to others; without it, all do. */
  mismatchOf?: (session: never) => string | undefined;
}

/** The content of sessions with this schema. */
export type ContentOf<Schema extends GenericSchema> = Omit<InferOutput<Schema>, 'lab' | 'hash' | 'source'>;

/** Longest part of a file's words in a message. */
const MOST_SHOWN = 100;

/**
 * Returns a session of which `fields` are all, checked by the schema of its lab; throws an Error that names the first field
 * that is wrong.
 */
export function checked(fields: Record<string, unknown>, schemas: ReadonlyMap<unknown, SessionSchema>): Session {
  const known = schemas.get(fields.lab);
  if (!known) throw new Error(text('sessions.otherLab', { lab: shown(String(fields.lab ?? '–')) }));
  const result = safeParse(known.schema, fields, { abortEarly: true });
  if (!result.success) throw wrong(pathOf(result.issues[0]), reasonOf(result.issues[0]));
  const mismatch = known.mismatchOf?.(result.output as never);
  if (mismatch) throw wrong(mismatch, text('sessions.fieldMismatch'));
  const { lab, hash, source, ...content } = result.output;
  return { lab, hash, source, content };
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
