/** Links and sessions from before the method chose parameters from the points, which rely on the paper's values. */

import { PAPER } from './examples';
import type { ParamValues } from './protocol';
import type { ReconstructContent } from './schema';

/** Returns all parameters of a setting; those that it does not state are the paper's. */
export function withPaper<Setting extends { params: ParamValues }>(setting: Setting): Setting {
  return { ...setting, params: { ...PAPER, ...setting.params } };
}

/** Returns a session with all parameters. Newer ones state them themselves. */
export function completed({ model, undo, redo, ...rest }: ReconstructContent): ReconstructContent {
  const { setup, log } = model;
  const entries = (list: typeof undo) => list.map((entry) => ({ ...entry, state: withPaper(entry.state) }));
  const whole = { ...model, setup: withPaper(setup), ...(log && { log: { ...log, setup: withPaper(log.setup) } }) };
  return { ...rest, model: whole, undo: entries(undo), redo: entries(redo) };
}
