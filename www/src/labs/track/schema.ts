/** The schema of sessions of the Track lab. */

import {
  check,
  custom,
  type InferOutput,
  literal,
  object,
  optional,
  picklist,
  pipe,
  strictTuple,
  variant,
} from 'valibot';
import type { Surface } from '../../engine/protocol';
import type { ContentOf } from '../../lab/session/check';
import { call, camera, history, log, markMismatch, session, states, steps } from '../../lab/session/parts';
import {
  anyNumber,
  between,
  bytes,
  count,
  flag,
  list,
  maybe,
  oneOf,
  params,
  real,
  vec3,
  viewOptions,
} from '../../lab/session/values';
import { TRACK_VIEW } from './view';

const enrichment = oneOf({ none: true, linear: true, flow: true });
const setup = object({
  preparation: object({ binning: picklist([1, 2]), enrichment, factor: between(0, 1000) }),
  ...{ box: maybe(object({ min: vec3, max: vec3 })), at: maybe(vec3), params },
  cavity: optional(oneOf({ closed: true, open: true })),
});
const calls = variant('call', [steps, call('setParams', params)]);
const moment = {
  state: bytes,
  model: object({ setup, iteration: count, done: flag, log: optional(log(setup, calls)) }),
  page: object({ closing: maybe(anyNumber), frames: list(count, 10_000), history }),
};

const floats = custom<Float32Array>((value) => value instanceof Float32Array);
const corners = custom<Uint32Array>((value) => value instanceof Uint32Array);
const surface = pipe(
  object({
    ...{ origin: optional(vec3, () => [0, 0, 0]), vertices: count, triangles: count },
    ...{ positions: floats, normals: floats, indices: corners },
  }),
  check((value) => isWhole(value)),
);
/** Tests whether a surface has the vertices and triangles that it says, and these have positions and corners. */
function isWhole({ vertices, triangles, positions, normals, indices }: Surface): boolean {
  const [coordinates, corners] = [3 * vertices, indices.subarray(0, 3 * triangles)];
  const isLong = Math.min(positions.length, normals.length) >= coordinates && corners.length === 3 * triangles;
  return (
    isLong && corners.every((corner) => corner < vertices) && positions.subarray(0, coordinates).every(Number.isFinite)
  );
}

const triple = strictTuple([anyNumber, anyNumber, anyNumber]);
const info = object({
  ...{ vertices: count, triangles: count, components: count, euler: real, genus: real, area: anyNumber },
  ...{ volume: anyNumber, centroid: triple, inertia: list(anyNumber, 9), minAngleDegrees: anyNumber },
  edge: object({ min: anyNumber, mean: anyNumber, max: anyNumber }),
  bounds: object({ min: triple, max: triple }),
});
const validity = object({
  ...{ closed: flag, oriented: flag, nonManifoldEdges: count, nonManifoldVertices: count },
  ...{ degenerateTriangles: count, selfIntersections: count },
});
const facts = object({
  ...{ volume: real, area: real, triangles: count, folded: count, rejected: count, heldMoves: count },
  ...{ withoutBoundary: count, steps: anyNumber, meanFinalCorrection: anyNumber },
});
const error = object({ mean: anyNumber, p95: anyNumber });
const measures = object({ info, report: optional(validity) });
const frame = object({ surface, facts, measures, error: maybe(error) });

const view = object({ camera, crosshair: vec3, frame: optional(count), options: viewOptions(TRACK_VIEW) });

/** The lab's own part of a session: its model, history, undo and view. */
export type TrackContent = ContentOf<typeof schema>;

export const schema = object({
  ...{ lab: literal('track'), ...session },
  ...{ ...states(moment), view: optional(view) },
  frames: list(frame, 10_000),
});

/** Returns the path of the first field of a session that refers to something that it does not have. */
export const mismatchOf = (session: InferOutput<typeof schema>): string | undefined =>
  markMismatch(session, session.frames.length);
