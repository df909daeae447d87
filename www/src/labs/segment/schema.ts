/** The schema of sessions of the Segment lab. */

import {
  check,
  custom,
  type InferOutput,
  literal,
  number,
  object,
  optional,
  pipe,
  regex,
  safeInteger,
  strictTuple,
  string,
} from 'valibot';
import { type LabelArray, rangeOf } from '../../engine/labels';
import type { ContentOf } from '../../lab/session/check';
import { camera, session } from '../../lab/session/parts';
import { bytes, flag, list, name, oneOf, params, real, vec3, viewOptions } from '../../lab/session/values';
import { SEGMENT_VIEW } from './view';

const voxels = custom<LabelArray>(
  (value) => ArrayBuffer.isView(value) && 'BYTES_PER_ELEMENT' in value && !/Float|Big/.test(value.constructor.name),
);
const value = pipe(number(), safeInteger());
const label = object({ value, name, color: pipe(string(), regex(/^#[0-9a-f]{6}$/i)) });
const range = pipe(
  strictTuple([real, real]),
  check(([low, high]) => low <= high),
);
const tools = object({
  /** Effect of pressing a slice: the crosshair moves, or labels change. */
  tool: oneOf({ navigate: true, brush: true, threshold: true, eraser: true, fill: true }),
  /** Shape of the brush: a ball in the volume, or a disc in the slice. */
  shape: oneOf({ ball: true, disc: true }),
  /** Extent of a fill: the slice, or a box of the volume. */
  extent: oneOf({ slice: true, box: true }),
  /** Radius of the brush, in shortest sides of a voxel. */
  radius: real,
  /** Intensities that the threshold brush paints, and that a fill may be limited to, both included. */
  range,
  /** Largest distance of a fill in the volume along each axis, in voxels. */
  reach: real,
  /** Whether a fill in the volume is limited to the range of intensities. */
  inRange: flag,
  /** Whether only background is painted, and only the active label erased. */
  protect: flag,
});
/** The settings of the tools that change labels. */
export type ToolSettings = InferOutput<typeof tools>;
const view = object({ camera, crosshair: vec3, options: viewOptions(SEGMENT_VIEW) });
/** Files may have 4000, and a few may be added. */
const most = 4500;

/** The lab's own part of a session: its model, history, undo and view. */
export type SegmentContent = ContentOf<typeof schema>;

export const schema = object({
  ...{ lab: literal('segment'), ...session },
  ...{ voxels, state: bytes, labels: list(label, most), active: value, hidden: list(value, most), params },
  ...{ tools: optional(tools), view: optional(view) },
});

/** Returns the path of the first field of a session that does not fit the labels and the label map. */
export function mismatchOf({ voxels, labels, active, hidden }: InferOutput<typeof schema>): string | undefined {
  const [low, high] = rangeOf(voxels);
  const values = new Set(labels.map((label) => label.value));
  const wrong = [...values].some((value) => value === 0 || value < low || value > high);
  if (labels.length === 0 || values.size < labels.length || wrong) return 'labels';
  if (!values.has(active)) return 'active';
  return hidden.every((value) => values.has(value)) ? undefined : 'hidden';
}
