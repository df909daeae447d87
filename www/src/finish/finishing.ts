import { RequestError } from '../engine/failure';
import type { ExportRequest } from '../engine/protocol';
import { text } from '../texts';
import { connectFinish, type FinishClient } from './client';
import type { Edited, RequestKind, Requests } from './protocol';

/** Code of the error that cancelled requests are rejected with. */
const CANCELLED = 'cancelled';

/** Whether a request was rejected since the user cancelled it. */
export const isCancelled = (error: unknown): boolean => error instanceof RequestError && error.code === CANCELLED;

export interface FinishingEvents {
  /** Receives the edited surface, or undefined if there is none. */
  onChange: (edited: Edited | undefined) => void;
  /** Called after the worker broke, with the surfaces and the reference that it had. */
  onLost: () => void;
  /** Called after work was cancelled; the reference was lost with it. */
  onCancelled: () => void;
}

/**
 * A surface that is edited after a run. Its worker starts with the first request, which also passes the lab's surface
 * to it.
 */
export class Finishing {
  readonly #mesh: () => Promise<Uint8Array>;
  readonly #events: FinishingEvents;
  #client: FinishClient | undefined;
  #opening: Promise<void> | undefined;
  #edited: Edited | undefined;
  /** Whether a new worker makes edits again after the one before broke. */
  #isRepeating = false;
  /** Number of changes under way. */
  #changes = 0;
  /** Counts the lab's surfaces. */
  #surface = 0;
  /** The surface before the edits, as a PLY file. */
  initial: Uint8Array | undefined;

  /** `mesh` returns the lab's surface as a PLY file. */
  constructor(mesh: () => Promise<Uint8Array>, events: FinishingEvents) {
    this.#mesh = mesh;
    this.#events = events;
  }

  get edited(): Edited | undefined {
    return this.#edited;
  }

  /** Passes the lab's surface to the worker, unless that is done. */
  open(): Promise<void> {
    this.#opening ??= this.#open().catch((error) => {
      this.#opening = undefined;
      throw error;
    });
    return this.#opening;
  }

  async request<K extends RequestKind>(kind: K, body: Requests[K]['body']): Promise<Requests[K]['reply']> {
    await this.open();
    if (!this.#client) throw new RequestError({ code: 'page', message: text('finish.noSurface') });
    return this.#client.request(kind, body);
  }

  async change<K extends 'edit' | 'undo' | 'redo'>(kind: K, body: Requests[K]['body']): Promise<void> {
    const surface = this.#surface;
    this.#changes += 1;
    try {
      const edited = await this.request(kind, body);
      if (surface === this.#surface) this.#adopt(edited);
    } finally {
      this.#changes -= 1;
    }
  }

  /**
   * Stops what the worker is doing by replacing it. The new one makes the edits so far again, before anything else that
   * is asked of it: the same edits give the same bits.
   */
  cancel(): void {
    const client = this.#client;
    if (!client) return;
    client.restart({ code: CANCELLED, message: text('controls.cancelled') });
    // Requests fail only if they are cancelled in turn, or if the worker breaks, which its client reports.
    this.#repeat(client).catch(() => undefined);
    this.#events.onCancelled();
  }

  /** Has a new worker make the edits so far; does nothing if the surface was still being opened. */
  async #repeat(client: FinishClient): Promise<void> {
    if (!this.initial) return;
    const { log = [], undone = [] } = this.#edited ?? {};
    await Promise.all([
      client.request('open', this.initial),
      ...[...log, ...undone].map((edit) => client.request('edit', { edit })),
      ...undone.map(() => client.request('undo', undefined)),
    ]);
  }

  /** Returns the edited surface as a file; undefined if there are no edits, so that the lab's own is the result. */
  exported(request: ExportRequest): Promise<Uint8Array> | undefined {
    return this.#edited?.log.length ? this.#client?.request('export', request) : undefined;
  }

  /** Forgets the edits, as the lab's surface has changed. */
  reset(): void {
    const isChanging = this.#changes > 0;
    this.#surface += 1;
    this.#opening = undefined;
    this.initial = undefined;
    if (this.#edited) this.#adopt(undefined);
    if (isChanging) this.cancel();
  }

  close(): void {
    this.#client?.close();
  }

  async #open(): Promise<void> {
    const surface = this.#surface;
    const bytes = await this.#mesh();
    this.#client ??= connectFinish(() => this.#lose());
    const edited = await this.#client.request('open', bytes);
    // Forgotten while it was being opened.
    if (surface !== this.#surface) return;
    this.initial = bytes;
    this.#adopt(edited);
  }

  #adopt(edited: Edited | undefined): void {
    this.#edited = edited;
    this.#events.onChange(edited);
  }

  /**
   * After the worker broke, only what it was doing is lost: another one makes the edits before again. If that one breaks,
   * too, they are forgotten, and the next request starts afresh.
   */
  #lose(): void {
    this.#client?.close();
    this.#client = undefined;
    this.#events.onLost();
    if (!this.initial || !this.#edited || this.#isRepeating) this.reset();
    else this.#startAgain();
  }

  #startAgain(): void {
    this.#isRepeating = true;
    const client = connectFinish(() => this.#lose());
    this.#client = client;
    const done = () => {
      this.#isRepeating = false;
    };
    this.#repeat(client).then(done, done);
  }
}
