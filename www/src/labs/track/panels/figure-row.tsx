import { signal } from '@preact/signals';
import type { Vec3 } from '../../../engine/protocol';
import { NumberInput } from '../../../kit/ui/field';
import { useId } from '../../../kit/ui/id';
import { Made } from '../../../kit/ui/mount';
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

type Row = Exclude<TrackViewOptions['below'], 'slices'>;

/** Images like those of the paper's figures; one row of them is shown in place of the slices. */
export class Stills {
  readonly below = signal<TrackViewOptions['below']>('slices');
  /** Only for other programs: what the images show, as attributes `data-…`. */
  readonly facts = signal<Record<`data-${string}`, string>>({});
  readonly canny: CannySettings = { ...CANNY };
  readonly images = {
    clusters: new FigureImage(text('trackPanels.clusteredLabel')),
    boundary: new FigureImage(text('trackPanels.votesLabel')),
    canny: new FigureImage(text('trackPanels.cannyLabel')),
    time: new FigureImage(text('trackPanels.timeLineLabel')),
    between: [
      text('trackPanels.sliceBefore'),
      text('trackPanels.sliceByFlow'),
      text('trackPanels.sliceMeasured'),
      text('trackPanels.sliceLinear'),
      text('trackPanels.sliceAfter'),
    ].map((label) => new FigureImage(label)),
  };
  #data: FigureData | undefined;

  /**
   * `onVoxel` is called with the voxel that was clicked in the image of the clustered window, `onFrame` with the frame
   * that was clicked in the image over time.
   */
  constructor(onVoxel: (voxel: Vec3) => void, onFrame: (frame: number) => void) {
    const { clusters, time } = this.images;
    clusters.canvas.addEventListener('click', (event) => {
      const { volume, voxel } = this.#data?.subject ?? {};
      if (volume && voxel) onVoxel(voxelIn(volume, voxel, ...clusters.fractionsAt(event)));
    });
    time.canvas.addEventListener('click', (event) => {
      const frames = this.#data?.subject.volume.frames ?? 1;
      onFrame(Math.min(frames - 1, Math.floor(time.fractionsAt(event)[0] * frames)));
    });
  }

  choose(below: TrackViewOptions['below']): void {
    this.below.value = below;
    this.#draw();
  }

  show(data: FigureData): void {
    this.#data = data;
    this.#draw();
  }

  drawCanny(): void {
    if (!this.#data) return;
    const { canny } = this.images;
    paintCanny(canny, this.#data.subject, this.canny);
    canny.caption.value = text('trackPanels.cannyCaption');
  }

  #draw(): void {
    const below = this.below.peek();
    if (!this.#data || below === 'slices') return;
    const draw: Record<Row, (data: FigureData) => void> = {
      boundary: (data) => this.#drawBoundary(data),
      time: (data) => this.#drawTime(data),
      between: (data) => this.#drawBetween(data),
    };
    draw[below](this.#data);
  }

  #drawBoundary({ subject, window, threshold, votes }: FigureData): void {
    const { clusters, boundary } = this.images;
    const split = paintWindow(clusters, subject, window, threshold);
    clusters.caption.value = split ? text('trackPanels.clusteredVotes') : text('trackPanels.clusteredNoVote');
    if (votes) paintBoundary(boundary, subject, votes);
    boundary.caption.value = votes
      ? text('trackPanels.votesCaption', { threshold: Number(threshold.toPrecision(3)) })
      : text('trackPanels.votesMissing');
    this.#tell('data-votes', String(votes?.weights.length ?? 0));
    this.drawCanny();
  }

  #drawTime({ subject, outlines }: FigureData): void {
    const { time } = this.images;
    this.#tell('data-crossings', String(paintTime(time, subject, outlines())));
    time.caption.value = text('trackPanels.timeLineCaption', { frames: subject.volume.frames });
  }

  #drawBetween({ subject, between, pair: [slice, slices] }: FigureData): void {
    const pictures = this.images.between;
    if (between) paintBetween(pictures, subject.volume, between);
    const off = (method: 'linear' | 'flow') =>
      between ? text('trackPanels.sliceError', { error: between.rmsError[method].toFixed(1) }) : '';
    const captions = [
      text('trackPanels.sliceNumberOf', { number: slice, slices }),
      text('trackPanels.byFlowCaption', { error: off('flow') }),
      text('trackPanels.measuredCaption', { number: slice + 1 }),
      text('trackPanels.linearCaption', { error: off('linear') }),
      text('trackPanels.sliceNumber', { number: slice + 2 }),
    ];
    for (const [i, picture] of pictures.entries()) picture.caption.value = captions[i] ?? '';
    this.#tell('data-between', between ? String(slice) : '');
  }

  #tell(name: `data-${string}`, value: string): void {
    this.facts.value = { ...this.facts.peek(), [name]: value };
  }
}

/** Rows of images, shown below the Track lab's 3D view in place of the slices. */
export function FigureRow({ of }: { of: Stills }) {
  const below = of.below.value;
  const { clusters, boundary, canny, time, between } = of.images;
  return (
    <div hidden={below === 'slices'} data-stills="" {...of.facts.value}>
      <div class="stills" hidden={below !== 'boundary'}>
        <Still image={clusters} />
        <Still image={boundary} />
        <Still image={canny} />
        <CannyFields of={of} />
      </div>
      <div class="stills" hidden={below !== 'time'}>
        <Still image={time} />
      </div>
      <div class="stills five" hidden={below !== 'between'}>
        {between.map((image, i) => (
          <Still key={i} image={image} />
        ))}
      </div>
    </div>
  );
}

function Still({ image }: { image: FigureImage }) {
  return (
    <figure class="still">
      <Made of={image.canvas} />
      <figcaption>{image.caption}</figcaption>
    </figure>
  );
}

function CannyFields({ of }: { of: Stills }) {
  return (
    <fieldset class="canny" aria-label={text('trackPanels.cannyParameters')}>
      <span>{text('trackPanels.cannyName')}</span>
      {CANNY_FIELDS.map((field) => (
        <CannyField key={field.name} of={of} {...field} />
      ))}
    </fieldset>
  );
}

function CannyField({ of, name, label, min }: { of: Stills } & (typeof CANNY_FIELDS)[number]) {
  const id = useId();
  const enter = (input: HTMLInputElement) => {
    if (!input.checkValidity() || input.value === '') input.valueAsNumber = of.canny[name];
    of.canny[name] = input.valueAsNumber;
    of.drawCanny();
  };
  return (
    <span class="value">
      <label for={id}>{label}</label>
      <NumberInput
        {...{ id, min, 'data-canny': name, shown: String(of.canny[name]) }}
        onEnter={(_, input) => enter(input)}
      />
    </span>
  );
}
