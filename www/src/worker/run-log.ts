/** The log of a run: all that has made the present model, in order, with which the run can be repeated. */
import type { ParamValues } from '../protocol';

/** Calls of a model's methods that change it, and what they are given. */
interface Calls {
  /** Number of iterations, one after another. */
  step: number;
  setParams: ParamValues;
  setAttractors: readonly object[];
  seed: undefined;
}

type Call = { [K in keyof Calls]: { call: K; given: Calls[K] } }[keyof Calls];

/** Log of a run as plain data; `setup` is what the model was built from, with every value that was chosen for it. */
export interface RunLog<Setup> {
  setup: Setup;
  calls: readonly Call[];
}

/** Records the calls that change a model. Logs it has returned do not change. */
export class RunRecorder<Setup> {
  #log: RunLog<Setup> | undefined;

  /** The log of the present model; undefined if there is none. */
  get log(): RunLog<Setup> | undefined {
    return this.#log;
  }

  /** Starts the log of a new model. */
  begin(setup: Setup): void {
    this.#log = { setup, calls: [] };
  }

  /** Continues the log of a run that was restored. */
  resume(log: RunLog<Setup>): void {
    this.#log = log;
  }

  /**
   * Adds a call that was made. Steps are counted, and of settings changed again before the next step only the last values
   * are kept, since the model depends on no others.
   */
  add<K extends keyof Calls>(call: K, given: Calls[K]): void {
    if (!this.#log) return;
    const { setup, calls } = this.#log;
    const last = calls.at(-1);
    const added = { call, given } as Call;
    const merged = last && merge(last, added);
    this.#log = { setup, calls: merged ? [...calls.slice(0, -1), merged] : [...calls, added] };
  }
}

/** Returns one call that does the same as two, undefined if there is none. */
function merge(one: Call, next: Call): Call | undefined {
  if (one.call === 'step' && next.call === 'step') return { call: 'step', given: one.given + next.given };
  if (one.call === 'setParams' && next.call === 'setParams')
    return { call: 'setParams', given: { ...one.given, ...next.given } };
  return one.call === 'setAttractors' && next.call === 'setAttractors' ? next : undefined;
}
