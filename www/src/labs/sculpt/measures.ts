import { count, figure, milliseconds } from '../../kit/format';
import type { History } from '../../kit/history';
import type { ExtraMeasure } from '../../kit/measures';
import type { PlotKind } from '../../kit/plots';
import { text } from '../../texts';
import type { StepReport } from './protocol';

/**
 * Rows on frames, detail and correspondence in the Sculpt lab's table of measures, listed after those on the surface.
 */
export const SCULPT_ROWS: ExtraMeasure[] = [
  { name: 'frameMs', label: text('sculpt.frameTime'), help: text('sculpt.frameTimeHelp'), text: milliseconds },
  {
    name: 'alongMs',
    label: text('sculpt.displayLatency'),
    help: text('sculpt.displayLatencyHelp'),
    text: milliseconds,
  },
  {
    name: 'answerMs',
    label: text('sculpt.modelLatency'),
    help: text('sculpt.modelLatencyHelp'),
    text: milliseconds,
  },
  {
    name: 'answerFrames',
    label: text('sculpt.latencyFrames'),
    help: text('sculpt.latencyFramesHelp'),
    text: count,
  },
  { name: 'bands', label: text('sculpt.bands'), help: text('sculpt.bandsHelp'), text: count, optional: true },
  {
    name: 'areaLow',
    label: text('sculpt.areaLow'),
    help: text('sculpt.areaLowHelp'),
    text: figure,
  },
  { name: 'areaHigh', label: text('sculpt.areaHigh'), help: text('sculpt.areaHighHelp'), text: figure },
  {
    name: 'angleHigh',
    label: text('sculpt.angleHigh'),
    help: text('sculpt.angleHighHelp'),
    text: figure,
  },
  { name: 'folded', label: text('sculpt.flipped'), help: text('sculpt.flippedHelp'), text: count, optional: true },
  { name: 'missed', label: text('sculpt.missed'), help: text('sculpt.missedHelp'), text: count, optional: true },
  {
    name: 'held',
    label: text('sculpt.limited'),
    help: text('sculpt.limitedHelp'),
    text: count,
  },
];

/**
 * Plots of the Sculpt lab over the frames that the model computes: residual, number of vertices, and time per frame.
 */
export const SCULPT_PLOTS: PlotKind[] = [
  {
    title: text('sculpt.residualPlot'),
    log: true,
    curves: [
      { label: text('sculpt.residualCurve'), color: '--curve', of: ({ residual }) => residual },
      { label: text('labs.toleranceCurve'), color: '--muted', dash: [4, 4], of: ({ tolerance }) => tolerance },
    ],
    describe: describeResidual,
  },
  {
    title: text('sculpt.verticesPlot'),
    log: false,
    curves: [{ label: text('sculpt.verticesCurve'), color: '--curve', of: ({ vertices }) => vertices }],
    describe: describeVertices,
  },
  {
    title: text('sculpt.frameTimePlot'),
    log: false,
    curves: [{ label: text('sculpt.timeCurve'), color: '--curve', of: timeOf }],
    describe: describeTime,
  },
];

/** Returns the duration of a step in milliseconds, the sum over its parts. */
function timeOf({ times }: StepReport): number {
  return Object.values(times).reduce((sum, time) => sum + time, 0);
}

function describeResidual({ reports }: History): string {
  const last = reports.at(-1);
  if (!last) return '';
  const key = last.residual <= last.tolerance ? 'sculpt.residualBelow' : 'sculpt.residualAbove';
  return text(key, {
    frames: count(last.iteration),
    residual: figure(last.residual),
    tolerance: figure(last.tolerance),
  });
}

function describeVertices({ reports }: History): string {
  const [first, last] = [reports[0], reports.at(-1)];
  return first && last ? text('sculpt.verticesTold', { first: count(first.vertices), last: count(last.vertices) }) : '';
}

function describeTime({ reports }: History): string {
  const sorted = reports.map(timeOf).sort((a, b) => a - b);
  const median = sorted[sorted.length >> 1] ?? 0;
  return text('sculpt.frameTimesTold', { median: milliseconds(median), longest: milliseconds(sorted.at(-1) ?? 0) });
}
