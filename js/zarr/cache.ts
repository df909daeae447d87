// Bricks that were used last, and those that are being fetched.
import type { Vec3, VoxelArray } from '../data.js';
import { untilAborted } from './requests.js';

/** The voxels of a box, x fastest. */
export interface Brick {
  /** Index of the first voxel. */
  min: Vec3;
  dims: Vec3;
  /** Undefined for a chunk that is not stored, whose voxels have the fill value of the array. */
  data: VoxelArray | undefined;
}

/** Number of bytes that are counted for a brick without voxels. */
const EMPTY = 256;

const bytesOf = ({ data }: Brick): number => data?.byteLength ?? EMPTY;

/** Reason of the abort of a fetch that nobody waits for any more. */
export class Abandoned extends Error {}

/** Keeps the bricks used last, up to a number of bytes, and fetches each at most once at a time. */
export class BrickCache {
  readonly #limit: number;
  // In the order of their last use.
  readonly #held = new Map<string, Brick>();
  readonly #pending = new Map<string, SharedFetch>();
  #bytes = 0;

  /** @param limit - Largest number of bytes to keep. */
  constructor(limit: number) {
    this.#limit = limit;
  }

  /** Returns the brick of a key; `fetch` is called if it is neither kept nor being fetched. */
  async get(key: string, fetch: (signal: AbortSignal) => Promise<Brick>, signal: AbortSignal): Promise<Brick> {
    signal.throwIfAborted();
    const held = this.#held.get(key);
    if (!held) return (this.#pending.get(key) ?? this.#begin(key, fetch)).wait(signal);
    this.#held.delete(key);
    this.#held.set(key, held);
    return held;
  }

  #begin(key: string, fetch: (signal: AbortSignal) => Promise<Brick>): SharedFetch {
    const end = () => {
      if (this.#pending.get(key) === shared) this.#pending.delete(key);
    };
    const work = async (signal: AbortSignal) => {
      const brick = await fetch(signal);
      this.#keep(key, brick);
      return brick;
    };
    const shared = new SharedFetch(work, end);
    this.#pending.set(key, shared);
    return shared;
  }

  #keep(key: string, brick: Brick): void {
    this.#held.set(key, brick);
    this.#bytes += bytesOf(brick);
    for (const [oldest, last] of this.#held) {
      if (this.#bytes <= this.#limit) break;
      this.#held.delete(oldest);
      this.#bytes -= bytesOf(last);
    }
  }

  /** Forgets all bricks, and aborts all fetches with `reason`. */
  clear(reason: unknown): void {
    for (const shared of this.#pending.values()) shared.abort(reason);
    this.#held.clear();
    this.#bytes = 0;
  }
}

/** A fetch that several callers wait for; it is aborted when none is left. */
class SharedFetch {
  readonly #stop = new AbortController();
  readonly #brick: Promise<Brick>;
  readonly #end: () => void;
  #waiting = 0;

  constructor(work: (signal: AbortSignal) => Promise<Brick>, end: () => void) {
    this.#end = end;
    this.#brick = work(this.#stop.signal).finally(end);
  }

  async wait(signal: AbortSignal): Promise<Brick> {
    this.#waiting += 1;
    try {
      return await untilAborted(this.#brick, signal);
    } finally {
      this.#waiting -= 1;
      if (this.#waiting === 0) this.abort(new Abandoned());
    }
  }

  abort(reason: unknown): void {
    this.#end();
    this.#stop.abort(reason);
  }
}
