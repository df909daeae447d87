/** The schema of sessions of the Reconstruct lab. */

import { literal, object, optional, variant } from 'valibot';
import type { ContentOf } from '../../lab/session/check';
import { call, camera, log, report, reports, session, steps, undoable } from '../../lab/session/parts';
import { bytes, count, list, maybe, params, vec3, viewOptions } from '../../lab/session/values';
import { CLOUD_VIEW } from './view';

const points = list(vec3, 1e5);
const edits = object({ added: points, removed: list(count, 1e6), outside: points });
const choice = { maxPoints: maybe(count), keepComponents: maybe(count) };
const setup = object({ params, ...choice, edits });
const calls = variant('call', [steps, call('setParams', params), call('setEdits', edits)]);
const model = object({ setup, last: maybe(report), log: optional(log(setup, calls)) });
const settings = { bytes: count, state: object({ choice: object(choice), params, edits }) };
const view = object({ camera, options: viewOptions(CLOUD_VIEW) });

/** The lab's own part of a session: its model, history, undo and view. */
export type ReconstructContent = ContentOf<typeof schema>;

export const schema = object({
  ...{ lab: literal('reconstruct'), ...session },
  ...{ state: bytes, model, undo: undoable(settings), redo: undoable(settings), reports, view: optional(view) },
});
