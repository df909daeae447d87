/** Sessions of the Reconstruct lab. */
import { literal, object, optional, variant } from 'valibot';
import type { SurfaceColor } from '../../../scene/surface';
import { call, camera, log, report, reports, session, steps, undoable } from './parts';
import { bytes, count, flag, list, maybe, oneOf, params, vec3 } from './values';

const points = list(vec3, 1e5);
const edits = object({ added: points, removed: list(count, 1e6), outside: points });
const choice = { maxPoints: maybe(count), keepComponents: maybe(count) };
const setup = object({ params, ...choice, edits });
const calls = variant('call', [steps, call('setParams', params), call('setEdits', edits)]);
const model = object({ setup, last: maybe(report), log: optional(log(setup, calls)) });
const settings = { bytes: count, state: object({ choice: object(choice), params, edits }) };
/** Colourings that the surfaces of the Reconstruct and Sculpt labs may have. */
export const color = oneOf<SurfaceColor>({
  ...{ plain: true, component: true, own: true, texture: true, speed: true, distance: true, deviation: true },
  ...{ 'mean curvature': true, 'gaussian curvature': true, 'area distortion': true, 'angle distortion': true },
});
const view = object({
  camera,
  options: object({ surface: flag, edges: flag, points: flag, constraints: flag, cameras: flag, color }),
});

export const reconstruct = object({
  ...{ lab: literal('reconstruct'), ...session },
  ...{ state: bytes, model, undo: undoable(settings), redo: undoable(settings), reports, view: optional(view) },
});
