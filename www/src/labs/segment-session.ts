/** The Segment lab's own part of a session. */
import { rangeOf } from '../segment/label-map';
import type { Label } from '../segment/labels';
import type { LabelArray, ParamValues } from '../segment/protocol';
import { isRecord } from '../session/recognise';
import { text } from '../texts';
import type { LabelList } from './segment-editing';

/** The label map, its labels, and the surfaces; undo is not part of it. */
export interface SegmentSession extends LabelList {
  voxels: LabelArray;
  /** State of the surfaces. */
  state: Uint8Array;
  params: ParamValues;
}

/** Returns label map and labels in the content of a session; throws an Error if they are damaged. */
export function sessionOf(content: Record<string, unknown>): SegmentSession {
  const { voxels, state, labels, active, hidden, params } = content;
  const isMap = ArrayBuffer.isView(voxels) && 'BYTES_PER_ELEMENT' in voxels && !isFloat(voxels);
  const isList = Array.isArray(labels) && labels.length > 0 && labels.every(isLabel);
  const [low, high] = isMap ? rangeOf(voxels as LabelArray) : [0, 0];
  const values = new Set(isList ? labels.map(({ value }) => value) : []);
  const isSound =
    isList &&
    values.size === labels.length &&
    [...values].every((value) => value !== 0 && value >= low && value <= high) &&
    values.has(active as number) &&
    Array.isArray(hidden) &&
    hidden.every((value) => values.has(value));
  if (!isSound || !(state instanceof Uint8Array) || !isRecord(params)) throw new Error(text('sessions.badIndex'));
  return content as unknown as SegmentSession;
}

const isFloat = (array: object) => array instanceof Float32Array || array instanceof Float64Array;

function isLabel(label: unknown): label is Label {
  if (!isRecord(label)) return false;
  const { value, name, color } = label;
  return Number.isInteger(value) && typeof name === 'string' && /^#[0-9a-f]{6}$/i.test(String(color));
}
