import { checkProperties, integer, invalid, positive } from './check.js';
import type { DataOptions } from './data.js';
import { NeedsDataError } from './error.js';
import type { Mesh } from './mesh.js';
import type { Handle } from './runtime.js';
import type { Warning } from './warning.js';

/** State of a model after one step, or several together, and the events during them. */
export interface StepReport {
  /** Number of iterations that the model has run since its start. */
  iteration: number;
  /** Whether the method has finished. */
  done: boolean;
  /** Current stage of the method: 'level 2', 'solve', 'extract', 'tracking surface, frame 7 of 20' ... */
  phase: string;
  /** Progress from 0 to 1 if it can be known, else NaN. */
  progress: number;
  /**
   * Convergence measure: mean kinetic energy (deformable model), relative residual of the linear system (implicit
   * surface), root mean square displacement in target edges (multiresolution model), or mean final correction of the
   * newest frame, world units (tracker). May be NaN before the first value.
   */
  residual: number;
  /** Value below which `residual` counts as converged. */
  tolerance: number;
  vertices: number;
  triangles: number;
  components: number;
  /** Euler characteristic: vertices - edges + triangles. */
  euler: number;
  /**
   * Numbers of mesh edits since the last report: edges split (`creations`), collapsed (`deletions`) and flipped
   * (`inversions`), contacts joined (`axial`), necks cut (`annular`), components removed (`vanished`), and components
   * added where the image shows something that the surface lacks (`seeds`).
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
  /** Durations of the parts of the last step by name (forces, motion, normals, topology, and so on), milliseconds. */
  times: Record<string, number>;
  /** Warnings: things to know about the result so far before relying on it; empty if there are none. */
  warnings: Warning[];
}

/** Options of {@link Stepper.run}. */
export interface RunOptions {
  /** Aborts the run, which then rejects with `signal.reason`; the model stays usable. */
  signal?: AbortSignal;
  /**
   * Largest number of iterations of this run; if the model needs more, the run resolves with a report that is not
   * `done`. Default no limit.
   */
  maxIterations?: number;
  /**
   * Duration of a slice of work before yielding to the event loop, milliseconds; default 12.
   */
  budgetMs?: number;
  /** Called with the report of every iteration. If it throws, the run ends and rejects with that error. */
  onStep?: (report: StepReport) => void;
}

/** Options of work in slices. */
export type SliceOptions = Pick<RunOptions, 'signal' | 'budgetMs'>;

/** Interface that the models of all four methods implement. */
export interface Stepper {
  /** The model's surface: the same live {@link Mesh} from start to end, which shows the current state. */
  readonly mesh: Mesh;
  /** Runs up to `iterations` iterations, synchronous and deterministic; fewer if the method finishes earlier. */
  step(iterations?: number): StepReport;
  /** Runs the model to its end, yielding to the event loop between slices of work. */
  run(options?: RunOptions): Promise<StepReport>;
  /** Changes any subset of the parameters of the live model. All values are validated before any is set. */
  setParams(params: Record<string, unknown>): void;
  /** Current values of all parameters. */
  readonly params: Record<string, unknown>;
  /** Saves the whole state. Bit-exact: restore(save()) then step() equals step(). */
  save(): Uint8Array;
  /** Restores a state from {@link Stepper.save}. */
  restore(state: Uint8Array): void;
  /** Frees the memory of the model, which cannot be used afterwards. */
  free(): void;
}

/** Default duration of a slice of work before yielding to the event loop, milliseconds. */
const DEFAULT_BUDGET_MS = 12;

const OPTIONS = ['signal', 'maxIterations', 'budgetMs', 'onStep'];

/** Function of Node that calls another once requests had their turn, and mostly timers. */
const { setImmediate: later } = globalThis as { setImmediate?: (resolve: () => void) => void };

/**
 * Yields to the event loop by posting a message to itself, which is faster than a timer, since browsers throttle
 * timers. Node handles a thousand messages before a timer, so that nothing else would happen for seconds.
 */
export class EventLoopYield {
  readonly #channel = later ? undefined : new MessageChannel();

  wait(): Promise<void> {
    return new Promise((resolve) => {
      // Twice, as the first may come before timers that are due: the caller may wait for one to abort.
      if (later) later(() => later(resolve));
      if (!this.#channel) return;
      this.#channel.port1.onmessage = () => resolve();
      this.#channel.port2.postMessage(undefined);
    });
  }

  /** Closes the message channel; an open one keeps workers from exiting. */
  close(): void {
    this.#channel?.port1.close();
  }
}

/**
 * Calls `work` until it returns a value, and resolves with that value, yielding to the event loop after each slice of
 * `budgetMs` milliseconds. Rejects with any error of `work`, and with `signal.reason` when the signal aborts.
 */
export async function runInSlices<T extends object>(
  work: () => T | undefined,
  signal: AbortSignal | undefined,
  budgetMs = DEFAULT_BUDGET_MS,
): Promise<T> {
  const pause = new EventLoopYield();
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

/** Does work that has begun by calls of `advance` in slices, until one returns the result; frees it, whatever happens. */
export async function finishInSlices<Work extends { free(): void }, T extends object>(
  work: Handle<Work>,
  advance: (work: Work) => T | undefined,
  { signal, budgetMs }: SliceOptions,
): Promise<T> {
  try {
    return await runInSlices(() => work.use(advance), signal, budgetMs);
  } finally {
    work.free();
  }
}

/** Calls `work`, and again after reading the data that it needs, until it does not reject with {@link NeedsDataError}. */
async function withData<T>(work: () => Promise<T>, options: DataOptions): Promise<T> {
  const pause = new EventLoopYield();
  try {
    for (;;) {
      try {
        return await work();
      } catch (error) {
        if (!(error instanceof NeedsDataError)) throw error;
        await error.load(options);
        // All of it may have been in memory.
        await pause.wait();
        options.signal?.throwIfAborted();
      }
    }
  } finally {
    pause.close();
  }
}

/** Runs a model to its end in slices of work, and allows one run of the model at a time. */
export class Runner {
  #running = false;
  /** Takes the report of a step of the run that is under way. */
  #take: ((report: StepReport) => void) | undefined;
  /** The error that ends the run at its next slice. */
  #failure: { error: unknown } | undefined;

  /**
   * Throws `invalid-argument` naming `what` during a run; called by methods of the model that would interfere with one.
   */
  refuseWhileRunning(what: string): void {
    if (this.#running) throw invalid(what, 'not allowed during a run of this model: abort it, or wait for its end');
  }

  /**
   * Has `ended` end a step of the run that is under way, and reports it, before anything else happens to the model; called by
   * all methods that look at or change it.
   */
  settle(ended: () => StepReport | undefined): void {
    if (!this.#take) return;
    try {
      const report = ended();
      if (report) this.#take(report);
    } catch (error) {
      this.#failure = { error };
    }
  }

  /**
   * Calls `step`, which returns undefined in the middle of a step, until the model is done, the run is aborted, or
   * `maxIterations` is reached; returns the last report. See {@link RunOptions}. When `step` throws a {@link NeedsDataError}, the data are read, with `onData`, and the run
   * goes on. When it is aborted, `discard` gives up the step that is under way, and returns the report of one that has ended.
   */
  async run(
    step: () => StepReport | undefined,
    given: RunOptions | undefined,
    onData?: DataOptions['onData'],
    discard?: () => StepReport | undefined,
  ): Promise<StepReport> {
    const { signal, maxIterations = Number.MAX_SAFE_INTEGER, budgetMs, onStep } = checkedRun(given);
    signal?.throwIfAborted();
    this.refuseWhileRunning('run');
    this.#running = true;
    let left = maxIterations;
    let last: StepReport | undefined;
    const take = (report: StepReport) => {
      left -= 1;
      if (report.done || left === 0) last = report;
      onStep?.(report);
    };
    [this.#take, this.#failure] = [take, undefined];
    const next = () => {
      if (this.#failure) throw this.#failure.error;
      const report = last ? undefined : step();
      if (report) take(report);
      return last;
    };
    try {
      return await withData(() => runInSlices(next, signal, budgetMs), {
        ...(signal && { signal }),
        ...(onData && { onData }),
      });
    } catch (error) {
      const ended = signal?.aborted ? discard?.() : undefined;
      if (ended) onStep?.(ended);
      throw error;
    } finally {
      this.#running = false;
      this.#take = undefined;
    }
  }
}

/** A raw model whose steps go in slices. */
interface SlicedSteps {
  advance(): unknown;
  settle(): unknown;
  discard(): unknown;
  free(): void;
}

/**
 * Runs of a model whose steps go in slices. Whatever is asked of the model meanwhile, by {@link use}, ends the step that is
 * under way first. `taken` makes a report of what the raw model returns at the end of a step.
 */
export class SlicedRunner<Raw extends SlicedSteps, Stepped> {
  readonly #runner = new Runner();
  readonly #handle: Handle<Raw>;
  readonly #taken: (report: Stepped) => StepReport;

  constructor(handle: Handle<Raw>, taken: (report: Stepped) => StepReport) {
    [this.#handle, this.#taken] = [handle, taken];
  }

  /** As {@link Runner.refuseWhileRunning}. */
  refuseWhileRunning(what: string): void {
    this.#runner.refuseWhileRunning(what);
  }

  /** Calls `work` with the raw model, once a step of a run that is under way has ended and is reported. */
  use<T>(work: (raw: Raw) => T): T {
    this.#runner.settle(() => this.#ended((raw) => raw.settle()));
    return this.#handle.use(work);
  }

  /** As {@link Runner.run}. */
  run(given: RunOptions | undefined, onData?: DataOptions['onData']): Promise<StepReport> {
    const advance = () => this.#ended((raw) => raw.advance());
    // Of a step that is given up, nothing stays.
    const discard = () => (this.#handle.isFreed ? undefined : this.#ended((raw) => raw.discard()));
    return this.#runner.run(advance, given, onData, discard);
  }

  /** Returns the report of a step that has ended, if one has. */
  #ended(work: (raw: Raw) => unknown): StepReport | undefined {
    const report = this.#handle.use(work) as Stepped | undefined;
    return report && this.#taken(report);
  }
}

/** Returns the options of a run once they are checked; throws `invalid-argument` for an unknown or wrong one. */
export function checkedRun(given: RunOptions | undefined): RunOptions {
  const run = checkProperties<RunOptions>('options', given, OPTIONS);
  if (run.maxIterations !== undefined)
    integer('maxIterations', run.maxIterations, { min: 1, max: Number.MAX_SAFE_INTEGER });
  if (run.budgetMs !== undefined) positive('budgetMs', run.budgetMs);
  checkSignal(run.signal);
  checkListener('onStep', run.onStep);
  return run;
}

/** Returns the options of work in slices once they are checked. */
export function checkedSlices(given: SliceOptions | undefined): SliceOptions {
  const options = checkProperties<SliceOptions>('options', given, ['signal', 'budgetMs']);
  if (options.budgetMs !== undefined) positive('budgetMs', options.budgetMs);
  checkSignal(options.signal);
  return options;
}

/** Throws `invalid-argument` unless `signal` is an AbortSignal or undefined. */
export function checkSignal(signal: unknown): void {
  if (signal !== undefined && !(signal instanceof AbortSignal)) throw invalid('signal', 'must be an AbortSignal');
}

/** Throws `invalid-argument` unless `listener` is a function or undefined. */
export function checkListener(parameter: string, listener: unknown): void {
  if (listener !== undefined && typeof listener !== 'function') throw invalid(parameter, 'must be a function');
}
