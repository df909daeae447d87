import type { Vec3 } from '../../../engine/protocol';
import { h } from '../../../kit/dom';
import { labelFor } from '../../../kit/field';
import { text } from '../../../texts';
import type { CannySettings } from '../canny';
import {
  FigureImage,
  paintBetween,
  paintBoundary,
  paintCanny,
  paintTime,
  paintWindow,
  type Subject,
  voxelIn,
} from '../figure-images';
import type { BoundaryVotes, InterpolatedSlice } from '../protocol';
import type { TrackViewOptions } from '../view';

/**
 * Default settings of Canny's edge detector for greys of 0 to 255; for its image, the paper used a deviation of 1.5,
 * and thresholds of 10 and 20.
 */
const CANNY: CannySettings = { deviation: 1, low: 6, high: 14 };
const CANNY_FIELDS = [
  { name: 'deviation', label: 'σ', min: 0.1 },
  { name: 'low', label: text('trackPanels.cannyLow'), min: 0 },
  { name: 'high', label: text('trackPanels.cannyHigh'), min: 0 },
] as const;

/**
 * Data from which the Track lab draws images like the paper's figures; votes and interpolated slices are undefined
 * until the worker has sent them.
 */
export interface FigureData {
  subject: Subject;
  /** Half width k of the clustering windows, in voxels. */
  window: number;
  /** Edge threshold τ, in intensity units. */
  threshold: number;
  votes: BoundaryVotes | undefined;
  between: InterpolatedSlice | undefined;
  /**
   * The index, from 0, of the measured slice that is interpolated in `between`, and the number of slices of the image
   * before its preparation.
   */
  pair: [number, number];
  /**
   * Returns for each tracked frame the surface's outline in the slice at the crosshair, as segments in pixels; called
   * only while the image over time is shown.
   */
  outlines: () => readonly (Float32Array | undefined)[];
}

/** Row of images like one of the paper's figures, shown below the Track lab's 3D view in place of the slices. */
export class FigureRow {
  readonly element: HTMLElement;
  readonly #rows: Record<Exclude<TrackViewOptions['below'], 'slices'>, HTMLElement>;
  readonly #clusters = new FigureImage(text('trackPanels.clusteredLabel'));
  readonly #boundary = new FigureImage(text('trackPanels.votesLabel'));
  readonly #canny = new FigureImage(text('trackPanels.cannyLabel'));
  readonly #time = new FigureImage(text('trackPanels.timeLineLabel'));
  readonly #between = [
    text('trackPanels.sliceBefore'),
    text('trackPanels.sliceByFlow'),
    text('trackPanels.sliceMeasured'),
    text('trackPanels.sliceLinear'),
    text('trackPanels.sliceAfter'),
  ].map((label) => new FigureImage(label));
  readonly #settings = { ...CANNY };
  #below: TrackViewOptions['below'] = 'slices';
  #data: FigureData | undefined;

  /**
   * `onVoxel` is called with the voxel that was clicked in the image of the clustered window, `onFrame` with the frame
   * that was clicked in the image over time.
   */
  constructor(onVoxel: (voxel: Vec3) => void, onFrame: (frame: number) => void) {
    this.#rows = {
      boundary: h(
        'div',
        { class: 'stills' },
        this.#clusters.element,
        this.#boundary.element,
        this.#canny.element,
        this.#cannyFields(),
      ),
      time: h('div', { class: 'stills' }, this.#time.element),
      between: h('div', { class: 'stills five' }, ...this.#between.map(({ element }) => element)),
    };
    this.element = h('div', { hidden: true, 'data-stills': '' }, ...Object.values(this.#rows));
    this.#clusters.canvas.addEventListener('click', (event) => {
      const { volume, voxel } = this.#data?.subject ?? {};
      if (volume && voxel) onVoxel(voxelIn(volume, voxel, ...this.#clusters.fractionsAt(event)));
    });
    this.#time.canvas.addEventListener('click', (event) => {
      const frames = this.#data?.subject.volume.frames ?? 1;
      onFrame(Math.min(frames - 1, Math.floor(this.#time.fractionsAt(event)[0] * frames)));
    });
  }

  set below(below: TrackViewOptions['below']) {
    this.#below = below;
    this.element.hidden = below === 'slices';
    for (const [name, row] of Object.entries(this.#rows)) row.hidden = name !== below;
    this.draw();
  }

  show(data: FigureData): void {
    this.#data = data;
    this.draw();
  }

  draw(): void {
    if (!this.#data) return;
    if (this.#below === 'boundary') this.#drawBoundary(this.#data);
    else if (this.#below === 'time') this.#drawTime(this.#data);
    else if (this.#below === 'between') this.#drawBetween(this.#data);
  }

  #drawBoundary({ subject, window, threshold, votes }: FigureData): void {
    const split = paintWindow(this.#clusters, subject, window, threshold);
    this.#clusters.caption = split ? text('trackPanels.clusteredVotes') : text('trackPanels.clusteredNoVote');
    if (votes) paintBoundary(this.#boundary, subject, votes);
    this.#boundary.caption = votes
      ? text('trackPanels.votesCaption', { threshold: Number(threshold.toPrecision(3)) })
      : text('trackPanels.votesMissing');
    this.element.dataset.votes = String(votes?.weights.length ?? 0);
    this.#drawCanny();
  }

  #drawCanny(): void {
    if (!this.#data) return;
    paintCanny(this.#canny, this.#data.subject, this.#settings);
    this.#canny.caption = text('trackPanels.cannyCaption');
  }

  #drawTime({ subject, outlines }: FigureData): void {
    const points = paintTime(this.#time, subject, outlines());
    this.element.dataset.crossings = String(points);
    this.#time.caption = text('trackPanels.timeLineCaption', { frames: subject.volume.frames });
  }

  #drawBetween({ subject, between, pair: [slice, slices] }: FigureData): void {
    if (between) paintBetween(this.#between, subject.volume, between);
    const off = (method: 'linear' | 'flow') =>
      between ? text('trackPanels.sliceError', { error: between.rmsError[method].toFixed(1) }) : '';
    const captions = [
      text('trackPanels.sliceNumberOf', { number: slice, slices }),
      text('trackPanels.byFlowCaption', { error: off('flow') }),
      text('trackPanels.measuredCaption', { number: slice + 1 }),
      text('trackPanels.linearCaption', { error: off('linear') }),
      text('trackPanels.sliceNumber', { number: slice + 2 }),
    ];
    for (const [i, picture] of this.#between.entries()) picture.caption = captions[i] ?? '';
    this.element.dataset.between = between ? String(slice) : '';
  }

  #cannyFields(): HTMLElement {
    const fields = CANNY_FIELDS.map(({ name, label, min }) => {
      const input = h('input', { type: 'number', min, step: 'any', value: CANNY[name], 'data-canny': name });
      input.addEventListener('change', () => {
        if (!input.checkValidity() || input.value === '') input.valueAsNumber = this.#settings[name];
        this.#settings[name] = input.valueAsNumber;
        this.#drawCanny();
      });
      return h('span', { class: 'value' }, labelFor(input, label), input);
    });
    return h(
      'div',
      { class: 'canny', role: 'group', 'aria-label': text('trackPanels.cannyParameters') },
      h('span', {}, text('trackPanels.cannyName')),
      ...fields,
    );
  }
}
