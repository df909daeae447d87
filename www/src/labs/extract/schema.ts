/** The schema of sessions of the Extract lab. */

import { type InferOutput, literal, object, optional, picklist, undefined_, variant } from 'valibot';
import { MOST_ATTRACTORS } from '../../lab/attractors';
import type { ContentOf } from '../../lab/session/check';
import { call, camera, history, log, markMismatch, session, states, steps } from '../../lab/session/parts';
import { bytes, count, flag, list, maybe, oneOf, params, real, vec3, viewOptions } from '../../lab/session/values';
import { EXTRACT_VIEW } from './view';

const start = variant('kind', [
  object({ kind: picklist(['contour', 'enclosing', 'isosurface']) }),
  object({ kind: literal('bubbles'), count: real }),
  object({ kind: literal('sphere'), center: vec3, radius: real }),
]);
const attractors = list(object({ point: vec3, strength: real, radius: real }), MOST_ATTRACTORS);
const setup = object({
  ...{ start, levels: count, edge: maybe(real), params, attractors },
  box: optional(object({ min: vec3, max: vec3 })),
});
const calls = variant('call', [
  steps,
  call('setParams', params),
  call('setAttractors', attractors),
  call('seed', maybe(undefined_())),
]);
const kind = oneOf({
  contour: true,
  enclosing: true,
  bubbles: true,
  sphere: true,
  isosurface: true,
});
const moment = {
  state: bytes,
  model: object({ levels: count, iteration: count, done: flag, log: maybe(log(setup, calls)) }),
  page: object({
    choice: object({ kind, bubbles: real, levels: count, edge: maybe(real), box: optional(real) }),
    ...{ params, attractors, history },
  }),
};
const view = object({ camera, crosshair: vec3, options: viewOptions(EXTRACT_VIEW) });

/** The lab's own part of a session: its model, history, undo and view. */
export type ExtractContent = ContentOf<typeof schema>;

export const schema = object({
  ...{ lab: literal('extract'), ...session },
  ...{ ...states(moment), view: optional(view) },
});

/** Returns the path of the first field of a session that refers to something that it does not have. */
export const mismatchOf = (session: InferOutput<typeof schema>): string | undefined => markMismatch(session);
