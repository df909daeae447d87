/** Saved states of a lab, that of the present and those to undo and redo, as the content of a session. */
import { text } from '../texts';
import type { HistoryMark } from '../ui/history';
import { isRecord } from './recognise';
import { type PackedMark, ReportLists } from './reports';

/** Most bytes of states to undo and redo in a session; the oldest are left out. */
const UNDO_BYTES = 64e6;

/** A saved state: of the worker's model, and of the page, which creates a mark in the history of the run. */
interface Moment {
  saved: { state: Uint8Array; iteration: number };
  page: { mark: (iteration: number) => HistoryMark };
}

interface Labelled<M> {
  label: string;
  bytes: number;
  state: M;
}

/** The present state of a lab and those to return to, oldest first. */
export interface Moments<M> {
  now: M;
  undo: Labelled<M>[];
  redo: Labelled<M>[];
}

/** Converts all states by a function. */
export function mapMoments<M, N>({ now, undo, redo }: Moments<M>, convert: (moment: M) => N): Moments<N> {
  const all = (list: Labelled<M>[]) => list.map((one) => ({ ...one, state: convert(one.state) }));
  return { now: convert(now), undo: all(undo), redo: all(redo) };
}

/** Returns saved states as plain data. */
export function packMoments<M extends Moment>({ now, undo, redo }: Moments<M>): Record<string, unknown> {
  const reports = new ReportLists();
  const pack = ({ saved: { state, ...model }, page: { mark, ...page } }: M) => {
    return { state, model, page: { ...page, history: reports.pack(mark(model.iteration)) } };
  };
  const labelled = (list: Labelled<M>[]) =>
    newest(list, UNDO_BYTES / 2).map(({ label, state }) => ({ label, ...pack(state) }));
  // The present first: its list of reports is the longest.
  return { ...pack(now), undo: labelled(undo), redo: labelled(redo), reports: reports.lists };
}

/** Returns the last entries of a list whose total size is at most `most` bytes. */
function newest<M>(list: Labelled<M>[], most: number): Labelled<M>[] {
  let [first, size] = [list.length, 0];
  while (first > 0 && size + (list[first - 1]?.bytes ?? 0) <= most) size += list[--first]?.bytes ?? 0;
  return list.slice(first);
}

/**
 * Returns the saved states in the content of a session. `isMoment` tests what the lab itself needs of a state; throws an
 * Error if one lacks something.
 */
export function unpackMoments<M extends Moment>(
  content: Record<string, unknown>,
  isMoment: (saved: Record<string, unknown>, page: Record<string, unknown>) => boolean,
): Moments<M> {
  const { undo, redo, reports } = content;
  if (!isList(undo) || !isList(redo) || !isList(reports) || !reports.every(isList)) throw damaged();
  const lists = new ReportLists(reports as ReportLists['lists'][number][]);
  const unpack = (value: unknown): M => {
    const { state, model, page } = isRecord(value) ? value : {};
    const isSound = state instanceof Uint8Array && isRecord(model) && isRecord(page) && isMoment(model, page);
    const mark = isSound && isRecord(page.history) && lists.unpack(page.history as unknown as PackedMark);
    if (!isSound || !mark || typeof model.iteration !== 'number') throw damaged();
    return { saved: { ...model, state }, page: { ...page, mark: () => mark } } as unknown as M;
  };
  const labelled = (list: unknown[]) =>
    list.map((value): Labelled<M> => {
      const state = unpack(value);
      return { label: String((value as { label: unknown }).label), bytes: state.saved.state.length, state };
    });
  return { now: unpack(content), undo: labelled(undo), redo: labelled(redo) };
}

const isList = (value: unknown): value is unknown[] => Array.isArray(value);
const damaged = () => new Error(text('sessions.badIndex'));
