import uPlot from 'uplot';
import { text } from '../texts';
import 'uplot/dist/uPlot.min.css';
import { type Beat, beatOf } from '../track/curve';
import { h, onSchemeChange, token } from './dom';
import { figure } from './format';

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

const EMPTY: VolumeCurves = { volumes: [], truth: undefined, other: undefined, frame: 0, frames: 2, unit: 'mm' };

/**
 * Plot of the enclosed volume over the frames, with end-diastole, end-systole and the ejection fraction. A click
 * selects the frame to show in the view.
 */
export class VolumeCurve {
  readonly element: HTMLElement;
  readonly #plot: uPlot;
  readonly #caption = h('figcaption', { 'data-beat': '{}' });
  readonly #legend = h('p', { class: 'legend' });
  readonly #title = h('h3');
  #curves = EMPTY;
  #pending = 0;

  constructor(onFrame: (frame: number) => void) {
    const holder = h('div', { class: 'plot beat', 'aria-hidden': 'true' });
    this.element = h('figure', {}, this.#title, holder, this.#legend, this.#caption);
    this.#plot = new uPlot(
      options((plot) => this.#mark(plot)),
      [[0], [null], [null], [null]],
      holder,
    );
    this.#plot.over.addEventListener('click', (event) => {
      const at = Math.round(this.#plot.posToVal(event.offsetX, 'x')) - 1;
      if (at >= 0 && at < this.#curves.frames) onFrame(at);
    });
    new ResizeObserver(() => {
      if (holder.clientWidth > 0) this.#plot.setSize({ width: holder.clientWidth, height: HEIGHT });
    }).observe(holder);
    onSchemeChange(() => this.#plot.redraw());
    this.show(EMPTY);
  }

  show(curves: VolumeCurves): void {
    this.#curves = curves;
    this.#pending ||= requestAnimationFrame(() => {
      this.#pending = 0;
      this.#draw();
    });
  }

  #draw(): void {
    const { volumes, truth, other, frames, unit } = this.#curves;
    const scale = unit === 'mm' ? 1e-3 : 1;
    const all = Math.max(frames, 2);
    const column = (values: readonly number[] | undefined) =>
      Array.from({ length: all }, (_, i) => (values?.[i] === undefined ? null : scale * (values[i] ?? 0)));
    const x = Array.from({ length: all }, (_, i) => i + 1);
    this.#plot.setData([x, column(volumes), column(truth), column(other?.volumes)] as uPlot.AlignedData);
    this.#title.textContent = text('trackPanels.volumeByFrame', {
      unit: unit === 'mm' ? 'ml' : `${unit || text('view.unknownUnit')}³`,
    });
    const key = (name: string, text: string) =>
      h('span', {}, h('span', { class: `mark ${name}`, 'aria-hidden': 'true' }), text);
    this.#legend.replaceChildren(
      key('tracked', text('trackPanels.curveTracked')),
      ...(truth ? [key('truth', text('trackPanels.curveTruth'))] : []),
      ...(other ? [key('annular', other.name)] : []),
    );
    const beat = beatOf(volumes);
    this.#caption.dataset.beat = JSON.stringify(beat ?? {});
    this.#caption.textContent =
      beat && volumes.length === frames ? describeBeat(beat, this.#curves) : text('trackPanels.curveUnfinished');
  }

  /** Draws vertical lines at the current frame and, once all frames are tracked, at the largest and smallest volume. */
  #mark(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const { volumes, frames, frame } = this.#curves;
    const beat = volumes.length === frames ? beatOf(volumes) : undefined;
    const marks = beat
      ? [
          [text('trackPanels.endDiastoleMark'), beat.diastole] as const,
          [text('trackPanels.endSystoleMark'), beat.systole] as const,
        ]
      : [];
    ctx.save();
    ctx.font = `${10 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.textAlign = 'center';
    ctx.lineWidth = devicePixelRatio;
    const line = (at: number, color: string) => {
      const x = Math.round(plot.valToPos(at + 1, 'x', true));
      ctx.strokeStyle = color;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      return x;
    };
    for (const [name, at] of marks) {
      const x = line(at, token('--line-strong'));
      ctx.fillStyle = token('--muted');
      ctx.fillText(name, x, bbox.top - 5 * devicePixelRatio);
    }
    line(frame, token('--outline'));
    ctx.restore();
  }
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

function options(mark: (plot: uPlot) => void): uPlot.Options {
  const axis: uPlot.Axis = {
    stroke: () => token('--muted'),
    grid: { stroke: () => token('--line'), width: 1 },
    ticks: { show: false },
    font: '11px system-ui, sans-serif',
  };
  const line = (color: string, dash?: number[]) => ({
    stroke: () => token(color),
    width: 1.75,
    points: { show: false },
    ...(dash && { dash }),
  });
  return {
    width: 280,
    height: HEIGHT,
    legend: { show: false },
    cursor: { y: false, drag: { x: false, y: false } },
    padding: [MARK_HEIGHT, 12, 0, 0],
    scales: {
      x: { time: false, range: (_, low, high) => [(low ?? 1) - 0.5, (high ?? 2) + 0.5] },
      y: { range: (_, low, high) => (low === null || high === null ? [0, 1] : spread(low, high)) },
    },
    axes: [
      { ...axis, size: 24, incrs: [1, 2, 5, 10, 20, 50, 100] },
      { ...axis, size: 40 },
    ],
    series: [{}, line('--curve'), line('--muted', [5, 4]), line('--cut', [2, 3])],
    hooks: { drawClear: [mark] },
  };
}

function spread(low: number, high: number): [number, number] {
  const margin = 0.1 * (high - low) || Math.max(1e-6, 0.1 * Math.abs(high));
  return [low - margin, high + margin];
}
