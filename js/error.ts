import type { DataOptions } from './data.js';

/** The kinds of failure that a {@link VesicleError} reports. */
export type ErrorCode =
  /**
   * A parameter out of range, NaN, of the wrong length, missing or misspelled, or a call that is not allowed at the
   * time; the message names it.
   */
  | 'invalid-argument'
  /** A truncated, inconsistent or unsupported file or saved state; the message names the format and the field. */
  | 'bad-file'
  /**
   * A mesh with a boundary, non-manifold edges or vertices, or inconsistently oriented triangles; a closed one is
   * needed.
   */
  | 'not-closed'
  /** A mesh with self-intersections, given as initial surface or base; an embedded one is needed. */
  | 'self-intersecting'
  /** A linear system of an implicit surface without a usable solution; the message names the likely cause. */
  | 'singular-system'
  /**
   * Data of a store, such as a chunk of `vesicle/zarr`, that could not be fetched: refused, not reached, or no answer
   * within the time limit, after retries where these can help. The same call may be made again.
   */
  | 'unavailable'
  /**
   * A step of a model that needs parts of a `LargeVolume` that have not been read; the error is a
   * {@link NeedsDataError}, which reads them.
   */
  | 'needs-data'
  /**
   * Positions so far from the origin, or edges so short, that the numbers of the result cannot hold them; the message
   * says what can.
   */
  | 'precision'
  /** Work that stopped because its last round changed nothing for the better; nothing has changed. */
  | 'no-progress'
  /** More memory needed than there is, or more vertices than are allowed; the message says how much. */
  | 'too-large'
  /**
   * Work that was ended by `terminate()` of `vesicle/worker`. A run that is aborted by its own signal rejects with
   * `signal.reason` instead.
   */
  | 'aborted'
  /** Use of an object after its `free()`, or after it was lost in a crash or with its worker. */
  | 'freed'
  /** A fault of the library itself; the error is a {@link VesicleCrash}. */
  | 'crash';

/**
 * An error of the library. But for a {@link VesicleCrash} it was foreseen: `message` says what was wrong and what is
 * accepted, `code` is the kind of failure.
 */
export class VesicleError extends Error {
  /** The kind of failure, by which programs can distinguish errors. */
  readonly code: ErrorCode;

  constructor(code: ErrorCode, message: string, options?: ErrorOptions) {
    super(message, options);
    this.name = 'VesicleError';
    this.code = code;
  }
}

/** A step that needs data which have not been read; the model has not changed. */
export class NeedsDataError extends VesicleError {
  /**
   * Reads the data, after which the step can be made.
   *
   * @throws `signal.reason` when aborted; the errors of the volume, such as `unavailable`. What was read stays.
   */
  readonly load: (options?: DataOptions) => Promise<void>;

  constructor(load: (options?: DataOptions) => Promise<void>) {
    super('needs-data', 'the step needs data which have not been read: await load() of this error, or use run()');
    this.load = load;
  }
}

/**
 * A fault inside the library itself (a bug, or memory that ran out half-way). The WebAssembly instance and all objects
 * created with it are lost. `await init()` starts a new instance, with which new objects can be created.
 */
export class VesicleCrash extends VesicleError {
  constructor(what: string, options?: ErrorOptions) {
    super(
      'crash',
      `${what}. This is a fault in vesicle: every volume, mesh and model made so far is lost. ` +
        'Call init() to create new ones, and please report the error.',
      options,
    );
    this.name = 'VesicleCrash';
  }
}
