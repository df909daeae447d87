/** The log of a run: all that has made the present model, in order, with which the run can be repeated. */

/** A call of a model's method that changed it, and what it was given. */
export interface Call {
  call: string;
  given: unknown;
}

/** Log of a run as plain data; `setup` is what the model was built from, with every value that was chosen for it. */
export interface RunLog<Setup> {
  setup: Setup;
  calls: readonly Call[];
}

/** Largest number of calls in a log; code with more of them is of no use. */
const MOST_CALLS = 20_000;

/** Records the calls that change a model. Logs it has returned do not change. */
export class RunRecorder<Setup> {
  readonly #replaced: readonly string[];
  #setup: Setup | undefined;
  #calls: Call[] = [];

  /** Of consecutive calls of the methods `replaced`, the model depends on the last values only, and no others are kept. */
  constructor(replaced: readonly string[] = []) {
    this.#replaced = replaced;
  }

  /** The log of the present model; undefined if there is none, or if its beginning is not known. */
  get log(): RunLog<Setup> | undefined {
    return this.#setup && { setup: this.#setup, calls: [...this.#calls] };
  }

  /** Starts the log of a new model. */
  begin(setup: Setup): void {
    this.resume({ setup, calls: [] });
  }

  /** Continues the log of a run that was restored; undefined if it has none. */
  resume(log: RunLog<Setup> | undefined): void {
    this.#setup = log?.setup;
    this.#calls = [...(log?.calls ?? [])];
  }

  /** Adds a call that was made. Steps are counted. */
  add(call: string, given: unknown): void {
    if (this.#setup === undefined) return;
    const last = this.#calls.at(-1);
    const merged = last?.call === call ? this.#merged(last, given) : undefined;
    if (merged) this.#calls.pop();
    this.#calls.push(merged ?? { call, given });
    if (this.#calls.length > MOST_CALLS) this.resume(undefined);
  }

  /** Returns one call that does the same as two, undefined if there is none. */
  #merged({ call, given }: Call, next: unknown): Call | undefined {
    if (call === 'step') return { call, given: Number(given) + Number(next) };
    if (!this.#replaced.includes(call)) return undefined;
    return { call, given: Array.isArray(next) ? next : { ...(given as object), ...(next as object) } };
  }
}

/**
 * Returns a model that adds to a log its calls of `methods`, when they have succeeded, and the steps of its runs.
 */
export function logged<Model extends object>(
  model: Model,
  log: Pick<RunRecorder<unknown>, 'add'>,
  methods: readonly (keyof Model & string)[],
): Model {
  type Method = (...given: unknown[]) => unknown;
  const get = (_: Model, name: keyof Model) => {
    const value = model[name];
    if (typeof value !== 'function') return value;
    const method: Method = value.bind(model);
    if (name === 'run')
      return (options: { onStep?: (report: unknown) => void }) => {
        const onStep = (report: unknown) => {
          log.add('step', 1);
          options.onStep?.(report);
        };
        return method({ ...options, onStep });
      };
    if (!methods.includes(name as never)) return method;
    return (...given: unknown[]) => {
      const result = method(...given);
      log.add(String(name), given[0]);
      return result;
    };
  };
  return new Proxy(model, { get } as ProxyHandler<Model>);
}
