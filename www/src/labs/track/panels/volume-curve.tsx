import { type ReadonlySignal, useComputed } from '@preact/signals';
import { roomFor } from '../../../kit/curve-plot';
import { figure } from '../../../kit/format';
import { LinePlot, PlotLegend } from '../../../kit/line-plot';
import type { PlotMark } from '../../../kit/plot-svg';
import { plural, text } from '../../../texts';
import { type Beat, beatOf } from '../curve';

const HEIGHT = 190;
/** Space above the plot for the names of end-diastole and end-systole, CSS pixels. */
const MARK_HEIGHT = 18;

export interface VolumeCurves {
  volumes: number[];
  /** True volume of each frame, in cubic units of length, if the image is synthetic. */
  truth: number[] | undefined;
  /** Volume of each frame in the run tracked for comparison, and the name of that run. */
  other: { volumes: number[]; name: string } | undefined;
  /** Index, from 0, of the frame shown in the view. */
  frame: number;
  frames: number;
  unit: string;
}

export const NO_VOLUMES: VolumeCurves = {
  ...{ volumes: [], truth: undefined, other: undefined, frame: 0, frames: 2, unit: 'mm' },
};

interface CurveProps {
  curves: ReadonlySignal<VolumeCurves>;
  onFrame: (frame: number) => void;
}

/**
 * Plot of the enclosed volume over the frames, with end-diastole, end-systole and the ejection fraction. A click
 * selects the frame to show in the view.
 */
export function VolumeCurve({ curves, onFrame }: CurveProps) {
  const { truth, other, frames, unit, volumes } = curves.value;
  const columns = useComputed(() => columnsOf(curves.value)).value;
  const marks = useComputed(() => marksOf(curves.value)).value;
  const beat = beatOf(volumes);
  return (
    <LinePlot
      {...{ name: 'beat', height: HEIGHT, top: MARK_HEIGHT, columns, marks }}
      title={text('trackPanels.volumeByFrame', {
        unit: unit === 'mm' ? 'ml' : `${unit || text('view.unknownUnit')}³`,
      })}
      across={text('controls.frame')}
      lines={[
        { label: text('trackPanels.curveTracked'), color: '--curve' },
        { label: text('trackPanels.curveTruth'), color: '--muted', dash: [5, 4] },
        { label: other?.name ?? '', color: '--cut', dash: [2, 3] },
      ]}
      x={{ range: (_, low, high) => [(low ?? 1) - 0.5, (high ?? 2) + 0.5] }}
      y={{ range: (_, low, high) => (low === null || high === null ? [0, 1] : spread(low, high)) }}
      xAxis={{ incrs: [1, 2, 5, 10, 20, 50, 100] }}
      yAxis={{ size: (_, labels) => roomFor(labels) }}
      onPick={(x) => {
        const at = Math.round(x) - 1;
        if (at >= 0 && at < curves.peek().frames) onFrame(at);
      }}
    >
      <PlotLegend
        keys={[
          { name: 'tracked', label: text('trackPanels.curveTracked') },
          ...(truth ? [{ name: 'truth', label: text('trackPanels.curveTruth') }] : []),
          ...(other ? [{ name: 'annular', label: other.name }] : []),
        ]}
      />
      <figcaption data-beat={JSON.stringify(beat ?? {})}>
        {volumes.length < frames ? text('trackPanels.curveUnfinished') : told(beat, curves.value)}
      </figcaption>
    </LinePlot>
  );
}

/** Returns the numbers of the frames, and the volumes of each curve. */
function columnsOf({ volumes, truth, other, frames, unit }: VolumeCurves): (number | null)[][] {
  const scale = unit === 'mm' ? 1e-3 : 1;
  const all = Math.max(frames, 2);
  const column = (values: readonly number[] | undefined) =>
    Array.from({ length: all }, (_, i) => (values?.[i] === undefined ? null : scale * (values[i] ?? 0)));
  const x = Array.from({ length: all }, (_, i) => i + 1);
  return [x, column(volumes), column(truth), column(other?.volumes)];
}

/** Returns the marks of the current frame and, once all frames are tracked, of the largest and smallest volume. */
function marksOf({ volumes, frames, frame }: VolumeCurves): PlotMark[] {
  const beat = volumes.length === frames ? beatOf(volumes) : undefined;
  const extremes = beat && [
    { at: beat.diastole + 1, name: text('trackPanels.endDiastoleMark'), color: '--line-strong' },
    { at: beat.systole + 1, name: text('trackPanels.endSystoleMark'), color: '--line-strong' },
  ];
  const marks: PlotMark[] = [...(extremes ?? []), { at: frame + 1, color: '--outline' }];
  return marks.sort((a, b) => a.at - b.at);
}

/** Describes a finished curve in words; `beat` is undefined if some frames have no surface. */
function told(beat: Beat | undefined, curves: VolumeCurves): string {
  if (beat) return describeBeat(beat, curves);
  return plural('trackPanels.curveEmpty', curves.volumes.filter((volume) => !(volume > 0)).length, {});
}

/** Describes the volume curve in words, for screen readers. */
function describeBeat(beat: Beat, { truth, other, unit }: VolumeCurves): string {
  const size = (volume: number) =>
    unit === 'mm' ? text('controls.millilitres', { value: (volume / 1000).toFixed(1) }) : figure(volume);
  const percent = (share: number) => text('controls.percent', { value: (100 * share).toFixed(1) });
  const known = truth && beatOf(truth);
  const second = other && beatOf(other.volumes);
  return [
    text('trackPanels.beatTold', {
      diastoleFrame: beat.diastole + 1,
      largest: size(beat.largest),
      systoleFrame: beat.systole + 1,
      smallest: size(beat.smallest),
      ejection: percent(beat.ejection),
    }),
    ...(known
      ? [
          text('trackPanels.beatTruth', {
            largest: size(known.largest),
            smallest: size(known.smallest),
            ejection: percent(known.ejection),
          }),
        ]
      : []),
    ...(other && second
      ? [
          text('trackPanels.beatOther', {
            name: other.name,
            largest: size(second.largest),
            smallest: size(second.smallest),
            ejection: percent(second.ejection),
          }),
        ]
      : []),
  ].join(' ');
}

function spread(low: number, high: number): [number, number] {
  const margin = 0.1 * (high - low) || Math.max(1e-6, 0.1 * Math.abs(high));
  return [low - margin, high + margin];
}
