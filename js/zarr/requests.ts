// Requests to a store: a bounded number at a time, with a time limit, repeated where that can help.
import type { AsyncReadable, GetOptions, RangeQuery, Readable } from '@zarrita/storage';
import { onAbort } from '../abort.js';
import { VesicleError } from '../error.js';
import { isSmall, SMALL } from '../small-files.js';
import { checkCodecs } from './codecs.js';
import { badZarr, RefusedError, tooLarge } from './error.js';

/** Duration of the pause before the first repetition, milliseconds; each later one is twice as long. */
const FIRST_PAUSE_MS = 250;

/** Statuses of HTTP that ask for a repetition, unlike all others from 400 to 499. */
const TEMPORARY = [408, 429];

/** How requests are made. */
export interface RequestOptions {
  /** Largest number of requests at the same time. */
  concurrency: number;
  /** Number of repetitions of a failed request. */
  retries: number;
  /** Milliseconds after which a request without an answer has failed. */
  timeoutMs: number;
}

/** An answer that a server gave instead of the data. */
export class HttpError extends Error {
  readonly status: number;

  constructor(status: number, message: string) {
    super(message);
    this.status = status;
  }
}

type Key = `/${string}`;

/**
 * Most bytes of all metadata that are read of an image: its group, and its arrays. A level has up to two thousand, a channel
 * 300, the wells of a plate of 1536, written with indentation, 230,000. The colours of labels are the longest, 50 to 150
 * bytes each: those of 28,000 labels fit in any case. Parsing this many bytes takes half a second, in which nothing else
 * happens.
 */
const MOST_METADATA = 2 ** 22;

/** Most brackets within brackets in metadata; images have a dozen. */
const MOST_NESTED = 200;

/**
 * Most bytes that a chunk of few stored bytes may decode to: a constant one of 256 × 256 × 256 floats. Decoders and what
 * comes after them take up to four times the bytes of a chunk.
 */
const MOST_OF_SMALL_CHUNK = 2 ** 26;

/** How a file is asked for. Stores get the same, and heed what they know. */
export interface FileOptions extends GetOptions {
  /** Most bytes of the file; that of metadata by default. */
  mostBytes?: number;
  /** Bytes that the file, or the part of it, decodes to if it is what the metadata say. */
  decodesTo?: number;
  /** Reject with {@link NotStored} if there is no such file. */
  mustExist?: boolean;
}

/** Reason of the rejection for a file that is not there and {@link FileOptions.mustExist | must}. */
export class NotStored extends Error {}

/** Throws `bad-file` for a file of more bytes than are read of it. */
export function checkLength(key: string, length: number, most: number): void {
  if (length > most) throw badZarr(key, `larger than the ${Math.floor(most)} bytes that it may have`);
}

/** Throws `too-large` for few bytes that decode to very many. */
function checkDecoded(key: string, stored: number, decoded: number): void {
  if (!isSmall(stored) || decoded <= MOST_OF_SMALL_CHUNK) return;
  throw tooLarge(
    key,
    `${stored} bytes would decode to ${decoded}; chunks that are stored in up to ${SMALL / 2 ** 10} KiB may ` +
      `decode to ${MOST_OF_SMALL_CHUNK / 2 ** 20} MiB: store the image in smaller chunks`,
  );
}

/** A store that makes its requests to another one. */
export class Requests implements AsyncReadable {
  /** Present if the other store has it: zarrita asks for it before it reads parts of files. */
  readonly getRange?: NonNullable<AsyncReadable['getRange']>;
  readonly #store: Readable;
  readonly #options: RequestOptions;
  readonly #slots: Slots;
  /** Bytes of metadata so far. */
  #metadata = 0;
  /** Bytes of chunks so far, as they are stored. */
  #chunks = 0;
  /** Files that had to exist and did not. */
  readonly #missing = new Set<Key>();

  constructor(store: Readable, options: RequestOptions) {
    this.#store = store;
    this.#options = options;
    this.#slots = new Slots(options.concurrency);
    if (store.getRange) this.getRange = (key, range, given) => this.#getRange(key, range, given);
  }

  /** Number of bytes of chunks that have been read, as they are stored. */
  get chunkBytes(): number {
    return this.#chunks;
  }

  async get(key: Key, given: FileOptions = {}): Promise<Uint8Array | undefined> {
    const { mostBytes = MOST_METADATA } = given;
    const options = (signal: AbortSignal): FileOptions => ({ signal, mostBytes });
    const bytes = await this.#existing(key, given, async (signal) => this.#store.get(key, options(signal)));
    checkLength(key, bytes?.length ?? 0, mostBytes);
    if (bytes && given.mostBytes === undefined) this.#checkMetadata(key, bytes);
    return bytes;
  }

  /** Throws `bad-file` for metadata that would take long to parse. */
  #checkMetadata(key: string, bytes: Uint8Array): void {
    this.#metadata += bytes.length;
    if (this.#metadata > MOST_METADATA)
      throw badZarr(key, `with it, the metadata of the image have more than ${MOST_METADATA} bytes, which is the most`);
    if (isNestedDeeply(bytes)) throw badZarr(key, `brackets are nested more than ${MOST_NESTED} deep`);
    checkCodecs(key, bytes);
  }

  async #getRange(key: Key, range: RangeQuery, given: FileOptions = {}): Promise<Uint8Array | undefined> {
    checkRange(key, range);
    const length = 'length' in range ? range.length : range.suffixLength;
    if (given.mostBytes !== undefined) checkLength(key, length, given.mostBytes);
    const send = async (signal: AbortSignal) => this.#store.getRange?.(key, range, { signal });
    // The index of a shard is counted from its end.
    const { decodesTo = 0 } = 'length' in range ? given : {};
    const bytes = await this.#existing(key, { ...given, decodesTo }, send);
    if (bytes === undefined || bytes.length === length) return bytes;
    throw badZarr(key, `truncated: ${bytes.length} of ${length} bytes`);
  }

  /** Makes a request for a file, unless it must exist and is known not to. */
  async #existing(
    key: Key,
    { mustExist, decodesTo = 0, signal }: FileOptions,
    send: (signal: AbortSignal) => Promise<Uint8Array | undefined>,
  ): Promise<Uint8Array | undefined> {
    const bytes = this.#missing.has(key) ? undefined : await this.#run(key, send, signal);
    if (bytes !== undefined && decodesTo > 0) {
      this.#chunks += bytes.length;
      checkDecoded(key, bytes.length, decodesTo);
    }
    if (bytes !== undefined || !mustExist) return bytes;
    this.#missing.add(key);
    throw new NotStored();
  }

  async #run<T>(key: Key, send: (signal: AbortSignal) => Promise<T>, signal?: AbortSignal): Promise<T> {
    await this.#slots.take(signal);
    try {
      return await this.#repeated(key, send, signal);
    } finally {
      this.#slots.release();
    }
  }

  async #repeated<T>(key: Key, send: (signal: AbortSignal) => Promise<T>, signal?: AbortSignal): Promise<T> {
    for (let attempt = 0; ; attempt++) {
      try {
        return await limited(send, this.#options.timeoutMs, signal);
      } catch (error) {
        signal?.throwIfAborted();
        if (error instanceof VesicleError) throw error;
        if (isPermanent(error)) throw new RefusedError('unavailable', `${key}: ${messageOf(error)}`);
        if (attempt >= this.#options.retries) {
          const attempts = attempt > 0 ? `; ${attempt + 1} attempts` : '';
          throw new VesicleError('unavailable', `${key}: ${messageOf(error)}${attempts}`);
        }
      }
      await pause(FIRST_PAUSE_MS * 2 ** attempt, signal);
    }
  }
}

/** Returns whether brackets of JSON are nested too deeply to be parsed in little time. */
function isNestedDeeply(json: Uint8Array): boolean {
  const [quote, backslash] = [0x22, 0x5c];
  let [depth, isText] = [0, false];
  for (let at = 0; at < json.length; at++) {
    const byte = json[at] as number;
    if (isText) {
      if (byte === backslash) at += 1;
      else if (byte === quote) isText = false;
    } else if (byte === quote) isText = true;
    // { and [, which differ in one bit, as } and ] do.
    else if ((byte | 0x20) === 0x7b) depth += 1;
    else if ((byte | 0x20) === 0x7d) depth -= 1;
    if (depth > MOST_NESTED) return true;
  }
  return false;
}

/** Throws `bad-file` for a range from a damaged index of a shard. */
function checkRange(key: Key, range: RangeQuery): void {
  const numbers = Object.values(range);
  if (numbers.every((value) => Number.isSafeInteger(value) && value >= 0)) return;
  throw badZarr(key, 'the index of the shard is damaged, or not encoded as the metadata says');
}

function messageOf(error: unknown): string {
  if (!(error instanceof Error)) return String(error);
  // `fetch` of Node says only that it failed.
  return error.cause instanceof Error ? `${error.message} (${error.cause.message})` : error.message;
}

/** Returns whether a repetition of the request would fail, too. */
function isPermanent(error: unknown): boolean {
  const { status, name, message } = Object(error) as { status?: unknown; name?: unknown; message?: unknown };
  if (name === 'NotAllowedError' || name === 'SecurityError') return true;
  // Stores of zarrita tell the status in their message only.
  const code = Number(status ?? /\bstatus:? (\d{3})\b/.exec(String(message))?.[1]);
  return code >= 400 && code < 500 && !TEMPORARY.includes(code);
}

/** Calls `send` with a signal that aborts after `timeoutMs` milliseconds, or with the given one. */
async function limited<T>(
  send: (signal: AbortSignal) => Promise<T>,
  timeoutMs: number,
  signal: AbortSignal | undefined,
): Promise<T> {
  const stop = new AbortController();
  const stalled = () => stop.abort(new Error(`no answer within ${timeoutMs / 1000} s`));
  const forget = onAbort(signal, () => stop.abort(signal?.reason));
  const timer = Number.isFinite(timeoutMs) ? setTimeout(stalled, timeoutMs) : undefined;
  try {
    signal?.throwIfAborted();
    // Not all stores heed signals.
    return await untilAborted(send(stop.signal), stop.signal);
  } finally {
    clearTimeout(timer);
    forget();
  }
}

/** Returns a promise that also rejects when the signal aborts, with its reason. */
export function untilAborted<T>(promise: Promise<T>, signal: AbortSignal | undefined): Promise<T> {
  if (!signal) return promise;
  return new Promise((resolve, reject) => {
    const abort = () => reject(signal.reason);
    if (signal.aborted) abort();
    promise.then(resolve, reject).finally(onAbort(signal, abort));
  });
}

async function pause(duration: number, signal: AbortSignal | undefined): Promise<void> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  const over = new Promise<void>((resolve) => {
    timer = setTimeout(resolve, duration);
  });
  await untilAborted(over, signal).finally(() => clearTimeout(timer));
}

/** A number of slots, given to those who ask in their order. */
export class Slots {
  #free: number;
  readonly #waiting = new Set<() => void>();

  constructor(count: number) {
    this.#free = count;
  }

  async take(signal: AbortSignal | undefined): Promise<void> {
    signal?.throwIfAborted();
    if (this.#free > 0) {
      this.#free -= 1;
      return;
    }
    let enter = () => {};
    const turn = new Promise<void>((resolve) => {
      enter = resolve;
      this.#waiting.add(enter);
    });
    await untilAborted(turn, signal).catch((reason: unknown) => {
      // The slot may have been given in the same moment.
      if (!this.#waiting.delete(enter)) this.release();
      throw reason;
    });
  }

  release(): void {
    const [next] = this.#waiting;
    if (next === undefined) {
      this.#free += 1;
      return;
    }
    this.#waiting.delete(next);
    next();
  }
}
