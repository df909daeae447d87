import type { StepReport } from '../sculpt/protocol';
import { count, figure, milliseconds } from '../ui/format';
import type { History } from '../ui/history';
import type { MoreMeasure } from '../ui/measures';
import type { PlotKind } from '../ui/plots';

/** Measures of frames, detail and correspondence, shown besides those of the surface. */
export const SCULPT_ROWS: MoreMeasure[] = [
  { name: 'frameMs', label: 'Time of a frame', help: 'Work of the last frame in the worker', text: milliseconds },
  {
    name: 'alongMs',
    label: 'Answer to the hand',
    help: 'From the last move by hand to the surface on the screen that goes along, until the model has followed',
    text: milliseconds,
  },
  {
    name: 'answerMs',
    label: 'Answer of the model',
    help: 'From the last move of an ellipsoid to the frame of the model on the screen that follows it',
    text: milliseconds,
  },
  {
    name: 'answerFrames',
    label: 'The same, in frames',
    help: 'Frames of the model drawn until the move was followed; 1 is at once, 2 where one was under way',
    text: count,
  },
  { name: 'bands', label: 'Bands', help: 'Surfaces from the base to the detail, both among them', text: count },
  {
    name: 'areaLow',
    label: 'Area under T, 5 %',
    help: 'Area on the base over area here: 5 % of the vertices lie below',
    text: figure,
  },
  { name: 'areaHigh', label: 'Area under T, 95 %', help: 'The same: 95 % of the vertices lie below', text: figure },
  {
    name: 'angleHigh',
    label: 'Stretch of T, 95 %',
    help: 'Longest over shortest stretch of directions; 1 where angles are kept. 95 % lie below',
    text: figure,
  },
  { name: 'folded', label: 'Folded', help: 'Triangles that T turns over', text: count },
  { name: 'missed', label: 'Missed', help: 'Vertices whose normal on the base met no detail', text: count },
  {
    name: 'held',
    label: 'Held back',
    help: 'Vertices whose detail was held back, so that nothing crosses',
    text: count,
  },
];

/** Plots of the Sculpt lab, over the frames. */
export const SCULPT_PLOTS: PlotKind[] = [
  {
    title: 'Unrest of the skin',
    log: true,
    curves: [
      { label: 'unrest', color: '--curve', of: ({ residual }) => residual },
      { label: 'tolerance', color: '--muted', dash: [4, 4], of: ({ tolerance }) => tolerance },
    ],
    tell: tellUnrest,
  },
  {
    title: 'Vertices',
    log: false,
    curves: [{ label: 'vertices', color: '--curve', of: ({ vertices }) => vertices }],
    tell: ({ reports }) => tellLast(reports, 'vertices', ({ vertices }) => count(vertices)),
  },
  {
    title: 'Time of a frame, ms',
    log: false,
    curves: [{ label: 'time', color: '--curve', of: timeOf }],
    tell: tellTime,
  },
];

/** Returns the duration of a step in milliseconds, the sum over its parts. */
function timeOf({ times }: StepReport): number {
  return Object.values(times).reduce((sum, time) => sum + time, 0);
}

function tellUnrest({ reports }: History): string {
  const last = reports.at(-1);
  if (!last) return '';
  const relation = last.residual <= last.tolerance ? 'below' : 'above';
  return `After ${count(last.iteration)} frames one more iteration would move the skin by ${figure(last.residual)} edges, ${relation} the tolerance of ${figure(last.tolerance)}.`;
}

function tellLast(reports: readonly StepReport[], what: string, text: (report: StepReport) => string): string {
  const [first, last] = [reports[0], reports.at(-1)];
  return first && last ? `From ${text(first)} to ${text(last)} ${what}.` : '';
}

function tellTime({ reports }: History): string {
  const sorted = reports.map(timeOf).sort((a, b) => a - b);
  const median = sorted[sorted.length >> 1] ?? 0;
  return `Half of the frames took less than ${milliseconds(median)}, the longest ${milliseconds(sorted.at(-1) ?? 0)}.`;
}
