import { invalid, knownOnly, positive, whole } from './check.js';
import type { Mesh } from './mesh.js';

/** What one step, or several together, did. */
export interface StepReport {
  /** Iterations since the start. */
  iteration: number;
  /** The method has reached its end. */
  done: boolean;
  /** What the method is doing now: 'level 2', 'solve', 'extract', 'frame 7' ... */
  phase: string;
  /** 0..1 where it can be known, else NaN. */
  progress: number;
  /** The method's own convergence figure. */
  residual: number;
  /** What the residual is compared with. */
  tolerance: number;
  vertices: number;
  triangles: number;
  components: number;
  /** Vertices - edges + triangles. */
  euler: number;
  /**
   * Counted since the last report. axial joins (or splits off) by contact, annular cuts a neck; seeds are parts added where
   * the image shows something that the surface left out.
   */
  events: {
    creations: number;
    deletions: number;
    inversions: number;
    axial: number;
    annular: number;
    vanished: number;
    seeds: number;
  };
  /** Milliseconds of the last step by part: forces, motion, normals, topology, and so on. */
  times: Record<string, number>;
}

/** How {@link Stepper.run} works. */
export interface RunOptions {
  /** Stops the run, which rejects with `signal.reason`; the model stays usable. */
  signal?: AbortSignal;
  /** Iterations of this run at most; it then resolves with a report that is not `done`. */
  maxIterations?: number;
  /** Milliseconds of work before the event loop gets its turn; default 12. One step is never cut in two. */
  budgetMs?: number;
  /** Called after every iteration. What it throws ends the run, which rejects with it. */
  onStep?: (report: StepReport) => void;
}

/** What every method can do. */
export interface Stepper {
  /** The surface: the same live object from start to end. */
  readonly mesh: Mesh;
  /** So many iterations at once, synchronous and deterministic; fewer where the end comes first. */
  step(iterations?: number): StepReport;
  /** To the end, yielding to the event loop between slices. */
  run(options?: RunOptions): Promise<StepReport>;
  /** Live parameters: any subset, validated as a whole before any of it is taken. */
  setParams(params: Record<string, unknown>): void;
  /** All parameters as they are now. */
  readonly params: Record<string, unknown>;
  /** The whole state. Bit-exact: restore(save()) then step() equals step(). */
  save(): Uint8Array;
  /** Back to a saved state. */
  restore(state: Uint8Array): void;
  /** Gives the memory back. */
  free(): void;
}

/** Milliseconds of work before the event loop gets its turn, by default. */
const SLICE = 12;

const OPTIONS = ['signal', 'maxIterations', 'budgetMs', 'onStep'];

/** Gives the event loop its turn: a message comes back sooner than any timer, which browsers hold back. */
class Pause {
  readonly #channel = new MessageChannel();

  wait(): Promise<void> {
    return new Promise((resolve) => {
      this.#channel.port1.onmessage = () => resolve();
      this.#channel.port2.postMessage(undefined);
    });
  }

  /** A channel left open keeps Node from ending. */
  close(): void {
    this.#channel.port1.close();
  }
}

/** Calls `work` until it returns something, and yields to the event loop between slices. Rejects with `signal.reason`. */
export async function inSlices<T extends object>(
  work: () => T | undefined,
  signal: AbortSignal | undefined,
  budgetMs = SLICE,
): Promise<T> {
  const pause = new Pause();
  try {
    let sliceEnd = performance.now() + budgetMs;
    for (;;) {
      const result = work();
      if (result) return result;
      if (performance.now() >= sliceEnd) {
        await pause.wait();
        sliceEnd = performance.now() + budgetMs;
      }
      signal?.throwIfAborted();
    }
  } finally {
    pause.close();
  }
}

/** Runs a model to its end in slices, one run at a time. */
export class Runner {
  #running = false;

  /** Throws while a run is under way: what it would do to the model has to wait. */
  refuseWhileRunning(what: string): void {
    if (this.#running) throw invalid(what, 'a run of this model is under way: abort it, or wait for it to end');
  }

  /** Steps until done, aborted, or `maxIterations`. See {@link RunOptions}. */
  async run(step: () => StepReport, given: RunOptions | undefined): Promise<StepReport> {
    const { signal, maxIterations = Number.MAX_SAFE_INTEGER, budgetMs, onStep } = checkedRun(given);
    signal?.throwIfAborted();
    this.refuseWhileRunning('run');
    this.#running = true;
    let left = maxIterations;
    const next = () => {
      const report = step();
      onStep?.(report);
      left -= 1;
      return report.done || left === 0 ? report : undefined;
    };
    try {
      return await inSlices(next, signal, budgetMs);
    } finally {
      this.#running = false;
    }
  }
}

/** The options of a run, or `invalid-argument`. */
export function checkedRun(given: RunOptions | undefined): RunOptions {
  const run = knownOnly<RunOptions>('options', given, OPTIONS);
  if (run.maxIterations !== undefined)
    whole('maxIterations', run.maxIterations, { min: 1, max: Number.MAX_SAFE_INTEGER });
  if (run.budgetMs !== undefined) positive('budgetMs', run.budgetMs);
  checkSignal(run.signal);
  checkListener('onStep', run.onStep);
  return run;
}

/** An AbortSignal, or nothing. */
export function checkSignal(signal: unknown): void {
  if (signal !== undefined && !(signal instanceof AbortSignal)) throw invalid('signal', 'an AbortSignal is needed');
}

/** A function, or nothing. */
export function checkListener(parameter: string, listener: unknown): void {
  if (listener !== undefined && typeof listener !== 'function') throw invalid(parameter, 'a function is needed');
}
