// Seconds between the frames of a volume with time.
import { largest, smallest } from './geometry.js';
import type { Frame } from './types.js';

/** Largest relative difference of times between frames that count as equal. */
const EVEN = 0.1;

/** Clocks by attribute, and how many seconds one unit of them is; times of day are converted. */
const CLOCKS: readonly (readonly [mark: string, seconds: number])[] = [
  ['trigger time', 1e-3],
  ['frame reference time', 1e-3],
  ['acquisition time', 1],
  ['content time', 1],
];

/** Returns the seconds between frames, if the files tell, and what should be known of them. */
export function secondsOf(frames: readonly (readonly Frame[])[]): { seconds?: number; note?: string } {
  if (frames.length < 2) return {};
  for (const [mark, unit] of CLOCKS) {
    const times = frames
      .map((slices) => slices[0]?.marks[mark])
      .map((value) => (typeof value === 'string' ? ofDay(value) : (value ?? Number.NaN) * unit));
    const steps = times.slice(1).map((time, k) => time - (times[k] ?? 0));
    if (!steps.every((step) => step > 0 && step < Infinity)) continue;
    const seconds = Number((steps.reduce((sum, step) => sum + step, 0) / steps.length).toPrecision(9));
    const [least, most] = [smallest(steps), largest(steps)];
    if (most - least <= EVEN * seconds) return { seconds };
    const range = [least, most].map((step) => Number(step.toPrecision(3))).join(' to ');
    return { seconds, note: `Times between frames differ (${range} s); their mean is used.` };
  }
  const resolution = frames[0]?.[0]?.marks['temporal resolution'];
  return typeof resolution === 'number' && resolution > 0 ? { seconds: resolution / 1000 } : {};
}

/** Returns the seconds of a time, `HHMMSS.FFFFFF`, with or without a date before it. */
function ofDay(text: string): number {
  const [whole = '', fraction = ''] = text.replace(/[:\s]/g, '').split(/[+&-]/, 1)[0]?.split('.') ?? [];
  const [, year, month, day, hours, minutes = '0', seconds = '0'] =
    /^(?:(\d{4})(\d\d)(\d\d)(?=\d{4}))?(\d\d)(\d\d)?(\d\d)?$/.exec(whole) ?? [];
  const days = year ? Date.UTC(Number(year), Number(month) - 1, Number(day)) / 1000 : 0;
  return days + 3600 * Number(hours) + 60 * Number(minutes) + Number(`${seconds}.${fraction || 0}`);
}
