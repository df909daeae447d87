import { RequestError } from '../channel';
import type { MeshFormat } from '../protocol';
import { text } from '../texts';
import type { Warning } from '../warnings';
import { FinishClient } from './client';
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
    const edited = await this.request(kind, body);
    if (surface === this.#surface) this.#adopt(edited);
  }

  /**
   * Stops what the worker is doing by replacing it. The new one makes the edits so far again, before anything else that
   * is asked of it: the same edits give the same bits.
   */
  cancel(): void {
    const client = this.#client;
    if (!client) return;
    const { log = [], undone = [] } = this.#edited ?? {};
    client.restart({ code: CANCELLED, message: text('controls.cancelled') });
    // Without it, the surface was still being opened.
    if (this.initial) {
      const requests = [
        client.request('open', this.initial),
        ...[...log, ...undone].map((edit) => client.request('edit', edit)),
        ...undone.map(() => client.request('undo', undefined)),
      ];
      // They fail only if they are cancelled in turn, or if the worker breaks, which its client reports.
      Promise.all(requests).catch(() => undefined);
    }
    this.#events.onCancelled();
  }

  /** Returns the edited surface as a file; undefined if there are no edits, so that the lab's own is the result. */
  exported(format: MeshFormat, warnings: readonly Warning[]): Promise<Uint8Array> | undefined {
    return this.#edited?.log.length ? this.#client?.request('export', { format, warnings }) : undefined;
  }

  /** Forgets the edits, as the lab's surface has changed. */
  reset(): void {
    this.#surface += 1;
    this.#opening = undefined;
    this.initial = undefined;
    if (this.#edited) this.#adopt(undefined);
  }

  close(): void {
    this.#client?.close();
  }

  async #open(): Promise<void> {
    const surface = this.#surface;
    const bytes = await this.#mesh();
    this.#client ??= new FinishClient(() => this.#lose());
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

  /** After the worker broke, the next request starts another one. */
  #lose(): void {
    this.#client?.close();
    this.#client = undefined;
    this.reset();
    this.#events.onLost();
  }
}
