/** Labs in the browser's storage, where they outlive the page. */
import { type DBSchema, type IDBPDatabase, openDB } from 'idb';
import type { Captured } from '../lab/lab';
import { openPages } from './pages';

/** A lab that is kept. */
export interface Kept extends Captured {
  id: string;
  /** Id of the lab in addresses. */
  lab: string;
  /** Name of the page that keeps it. */
  page: string;
  /** Milliseconds since 1970 at which it was kept. */
  time: number;
}

/** Bounds of what the browser keeps. */
export const MOST = { labs: 8, bytes: 2 ** 30, days: 14 };
const DAY_MS = 86_400_000;

/** A lab that takes more than all kept labs may. */
export class TooLargeToKeep extends Error {}

interface Schema extends DBSchema {
  labs: { key: string; value: Omit<Kept, 'data'> };
  /** The files of the data, apart, since they stay the same while the lab changes. */
  data: { key: string; value: { id: string; files: readonly File[] } };
}

const sizeOf = (files: readonly File[]) => files.reduce((sum, { size }) => sum + size, 0);
const bytesOf = ({ session, data }: Kept) => sizeOf([session, ...data]);

/** Labs in the browser's storage, within the bounds of {@link MOST}; the oldest make room. */
export class KeptStore {
  readonly #opened: Promise<IDBPDatabase<Schema>>;
  /** The files of each lab that are stored. */
  readonly #stored = new Map<string, readonly File[]>();

  constructor() {
    this.#opened = openDB<Schema>('vesicle', 1, {
      upgrade: (database) => {
        for (const name of ['labs', 'data'] as const) database.createObjectStore(name, { keyPath: 'id' });
      },
    });
    this.#opened.catch(() => undefined);
  }

  /** Keeps a lab, in place of the one with the same id. Throws {@link TooLargeToKeep}, or an Error of the browser if it has no room. */
  async put(kept: Kept): Promise<void> {
    const { data: files, ...lab } = kept;
    const { id } = kept;
    if (bytesOf(kept) > MOST.bytes) throw new TooLargeToKeep();
    const database = await this.#opened;
    const writing = database.transaction(['labs', 'data'], 'readwrite');
    const isNew = this.#stored.get(id) !== files;
    await Promise.all([
      writing.objectStore('labs').put(lab),
      ...(isNew ? [writing.objectStore('data').put({ id, files })] : []),
      writing.done,
    ]);
    this.#stored.set(id, files);
    await this.#makeRoom(id);
  }

  async delete(id: string): Promise<void> {
    const writing = (await this.#opened).transaction(['labs', 'data'], 'readwrite');
    await Promise.all([writing.objectStore('labs').delete(id), writing.objectStore('data').delete(id), writing.done]);
    this.#stored.delete(id);
  }

  /** Returns what is kept, the newest first. */
  async all(): Promise<Kept[]> {
    const reading = (await this.#opened).transaction(['labs', 'data']);
    const [labs, data] = await Promise.all([
      reading.objectStore('labs').getAll(),
      reading.objectStore('data').getAll(),
    ]);
    const files = new Map(data.map(({ id, files }) => [id, files]));
    const all = labs.map((lab) => ({ ...lab, data: files.get(lab.id) ?? [] }));
    const since = Date.now() - MOST.days * DAY_MS;
    await Promise.all(all.filter(({ time }) => time < since).map(({ id }) => this.delete(id)));
    return all.filter(({ time }) => time >= since).sort((a, b) => b.time - a.time);
  }

  /** Deletes the oldest labs beyond the bounds, but for the one just kept, and those of pages that are open. */
  async #makeRoom(id: string): Promise<void> {
    const open = await openPages();
    const all = await this.all();
    let bytes = 0;
    for (const [index, kept] of all.entries()) {
      bytes += bytesOf(kept);
      const isBeyond = index >= MOST.labs || bytes > MOST.bytes;
      if (isBeyond && kept.id !== id && !open.has(kept.page)) await this.delete(kept.id);
    }
  }
}
