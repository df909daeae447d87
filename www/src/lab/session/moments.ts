/** Saved states of a lab, that of the present and those to undo and redo, as the content of a session. */
import type { HistoryMark } from '../../kit/history';
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

/** A saved state in a session, with the position of its page's mark in the lists of reports. */
interface PackedMoment<Model, Page> {
  state: Uint8Array;
  model: Model;
  page: Page & { history: PackedMark };
}

/** The content of a session with saved states. */
interface Packed<Model, Page> extends PackedMoment<Model, Page> {
  undo: (PackedMoment<Model, Page> & { label: string })[];
  redo: (PackedMoment<Model, Page> & { label: string })[];
  reports: ReportLists['lists'][number][];
}

interface Unpacked<Model, Page> {
  saved: Model & { state: Uint8Array };
  page: Page & { mark: () => HistoryMark };
}

/** Returns the saved states in the content of a session. */
export function unpackMoments<Model, Page>(packed: Packed<Model, Page>): Moments<Unpacked<Model, Page>> {
  const lists = new ReportLists(packed.reports);
  const unpack = ({ state, model, page }: PackedMoment<Model, Page>): Unpacked<Model, Page> => ({
    saved: { ...model, state },
    page: { ...page, mark: () => lists.unpack(page.history) },
  });
  const labelled = (list: Packed<Model, Page>['undo']) =>
    list.map(({ label, ...one }) => ({ label, bytes: one.state.length, state: unpack(one) }));
  return { now: unpack(packed), undo: labelled(packed.undo), redo: labelled(packed.redo) };
}
