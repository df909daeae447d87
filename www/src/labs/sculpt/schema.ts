/** The schema of sessions of the Sculpt lab. */

import { type InferOutput, literal, minLength, object, optional, pipe, strictTuple, union, variant } from 'valibot';
import type { ContentOf } from '../../lab/session/check';
import { call, camera, history, log, markMismatch, session, states, steps } from '../../lab/session/parts';
import {
  between,
  bytes,
  count,
  flag,
  list,
  maybe,
  name,
  oneOf,
  params,
  text,
  vec3,
  viewOptions,
} from '../../lab/session/values';
import { SCULPT_VIEW } from './view';

const pose = list(object({ center: vec3, axes: strictTuple([vec3, vec3, vec3]) }), 1000);
const keys = pipe(list(pose, 1000), minLength(1));
const film = union([
  object({ keys, between: between(1, 10_000), loop: flag }),
  object({ motion: literal('lava'), loop: flag }),
]);
const calls = variant('call', [steps, call('setParams', params), call('setEllipsoids', pose)]);
const support = optional(oneOf({ surface: true, membrane: true }));
const moment = {
  state: bytes,
  model: object({ start: pose, support, iteration: count, frame: count, log: optional(text(100)) }),
  page: object({ names: list(name, 1000), posed: flag, film: maybe(film), history }),
};
const view = object({ camera, options: viewOptions(SCULPT_VIEW) });

/** The lab's own part of a session: its model, history, undo and view. */
export type SculptContent = ContentOf<typeof schema>;

export const schema = object({
  ...{ lab: literal('sculpt'), ...session },
  ...{ ...states(moment), view: optional(view) },
  ...{ params: optional(params, () => ({})), log: optional(log(object({ start: pose, params, support }), calls)) },
});

/** Returns the path of the first field of a session that refers to something that it does not have. */
export const mismatchOf = (session: InferOutput<typeof schema>): string | undefined => markMismatch(session);
