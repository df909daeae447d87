import type { History, HistoryMark } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import type { TrackClient } from './client';
import { beatOf } from './curve';
import { moreOf } from './measures';
import type { TrackParts } from './parts';
import type { BoundaryVotes, InterpolatedSlice, StepEvent, TrackedFrame, VolumeView } from './protocol';

/** Immutable snapshot of the tracking results so far, for undo. */
export interface TrackRecord {
  frames: readonly TrackedFrame[];
  closing: number | undefined;
  mark: (iteration: number) => HistoryMark;
}

/** Facts about the open image that the display of results needs. */
interface ShownImage {
  volume: VolumeView;
  /** Number of slices of the image before its preparation, which may insert some. */
  slices: number;
  truth: number[] | undefined;
}

/** Displays the Track lab's results: one frame at a time, and the volume curve of all frames. */
export class TrackResults {
  readonly #client: TrackClient;
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #history: History;
  #image: ShownImage | undefined;
  #frames: readonly TrackedFrame[] = [];
  #closing: number | undefined;
  #frame = 0;
  /** Whether the user has chosen the displayed frame, so that newly tracked frames do not replace it. */
  #frameChosen = false;
  /** The frame that is displayed at the next animation frame, if one is pending. */
  #next = 0;
  #framePending = 0;
  #votes: BoundaryVotes | undefined;
  #between: { key: string; between: InterpolatedSlice } | undefined;
  /** Kinds of data requests ('votes', 'between') that the worker has not answered yet. */
  #pendingRequests = new Set<string>();
  /** Counts how often the results were reset, so that replies to data requests made before are discarded. */
  #run = 0;
  #comparedVolumes: { volumes: number[]; name: string } | undefined;
  /** Half width k, in voxels, of the tracker's windows, with the parameters in force. */
  window = 2;
  /** Edge threshold τ of the tracker, in intensity units, with the parameters in force. */
  threshold = 1;
  /** Standard deviation of the image's noise, in intensity units. */
  noise = 0;

  constructor(client: TrackClient, ui: TrackParts, states: LabStates, history: History) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#history = history;
  }

  get frames(): readonly TrackedFrame[] {
    return this.#frames;
  }

  /** Whether the tracker has not done any step yet. */
  get isNew(): boolean {
    return this.#history.reports.length === 0;
  }

  get closing(): number | undefined {
    return this.#closing;
  }

  get frame(): number {
    return this.#frame;
  }

  get truth(): number[] | undefined {
    return this.#image?.truth;
  }

  /**
   * Sets the image to display: another one or, with `keep`, the same after another preparation. `slices` is the number
   * of slices before preparation; `truth` are the true volumes of the frames if the image is synthetic.
   */
  setImage(volume: VolumeView, slices: number, truth: number[] | undefined, keep: boolean): void {
    this.#image = { volume, slices, truth };
    this.#between = undefined;
    this.#ui.view.setVolume(volume, keep);
  }

  /** Clears all results, for a new run of the tracker. */
  startOver(): void {
    this.#history.clear();
    this.#reset([], undefined);
  }

  /** Sets the results back to an iteration of the tracker at which it had found no surface yet. */
  rewind(iteration: number): void {
    this.#history.rewind(this.#history.marker()(iteration));
    this.#reset([], undefined);
  }

  /** Returns the tracking results so far, for undo. */
  record(): TrackRecord {
    return { frames: this.#frames, closing: this.#closing, mark: this.#history.marker() };
  }

  /**
   * Restores the results in a snapshot, as far as they existed at the given iteration of the tracker; `done`: whether
   * the run was finished then.
   */
  restore({ frames, closing, mark }: TrackRecord, iteration: number, done: boolean): void {
    this.#history.rewind(mark(iteration));
    const count = this.#image?.volume.frames ?? 0;
    this.#reset(frames.slice(0, Math.max(0, iteration - count)), done ? closing : undefined);
  }

  #reset(frames: readonly TrackedFrame[], closing: number | undefined): void {
    this.#run += 1;
    this.#frames = frames;
    this.#closing = closing;
    this.#votes = undefined;
    this.#pendingRequests.clear();
    this.#frameChosen = false;
    this.#comparedVolumes = undefined;
    this.#ui.compare.clear();
    this.#ui.frames.stop();
    this.show(frames.length > 0 ? Math.min(this.#frame, frames.length - 1) : 0);
  }

  /** Displays the newest tracked frame from now on, as the run continues. */
  follow(): void {
    this.#frameChosen = false;
  }

  /** Records the result of a step of the tracker; displays the newest frame, unless the user has chosen another. */
  take({ report, index, frame, closing }: StepEvent): void {
    this.#history.add([report]);
    this.#closing = closing;
    if (frame && index !== undefined) this.#frames = [...this.#frames.slice(0, index), frame];
    const count = this.#image?.volume.frames ?? 1;
    const newest = index ?? Math.min(report.iteration, count) - 1;
    const isSame = this.#frameChosen || (index === undefined && this.#frames.length > 0);
    this.#next = isSame ? this.#frame : newest;
    // Small frames are tracked faster than drawn: of those that have arrived, only the newest is.
    this.#framePending ||= requestAnimationFrame(() => this.showPending());
  }

  close(): void {
    cancelAnimationFrame(this.#framePending);
  }

  /** Displays the frame that is pending, if one is. */
  showPending(): void {
    if (this.#framePending) this.show(this.#next);
  }

  /** Displays a frame chosen by the user, and stays at it while others are tracked. */
  choose(frame: number): void {
    this.#frameChosen = true;
    this.show(frame);
  }

  /** Displays a frame with its surface and measures, and updates all that depends on the displayed frame. */
  show(frame: number): void {
    cancelAnimationFrame(this.#framePending);
    this.#framePending = 0;
    const { view, frames: bar, measures } = this.#ui;
    const count = this.#image?.volume.frames ?? 1;
    const shown = Math.min(frame, count - 1);
    // The edits are of the frame that was displayed.
    if (shown !== this.#frame) this.#ui.run.finish?.reset();
    this.#frame = shown;
    const tracked = this.#frames[this.#frame];
    view.showFrame(this.#frame, tracked?.surface);
    bar.show(this.#frame, count, this.#frames.length);
    if (tracked) measures.showMeasures(tracked.measures);
    else measures.clear();
    const { noise } = this;
    measures.extra.value = moreOf({ frames: this.#frames, count, frame: this.#frame, closing: this.#closing, noise });
    this.showCurve();
    this.showFigures();
    const last = this.#history.reports.at(-1);
    this.#ui.run.transport.showReport(last);
    this.#ui.page.warnings.showReport(last);
    const { value, modelState, ready } = this.#states;
    this.#ui.showState(value, modelState, ready, this.#frames.length, tracked !== undefined);
  }

  /** Shows the curve of the volume enclosed in each frame, and the table of frames. */
  showCurve(): void {
    const frames = this.#image?.volume.frames ?? 1;
    const facts = this.#frames.map((one) => one.facts);
    const volumes = facts.map(({ volume }) => volume);
    this.#ui.showCurves({
      volumes,
      truth: this.truth,
      other: this.#comparedVolumes,
      frame: this.#frame,
      frames,
      unit: this.#unit,
    });
    const errors = this.#frames.map(({ error }) => error);
    this.#ui.table.value = { facts, errors, frame: this.#frame };
  }

  /** Unit of lengths of the image, for the volume curve. */
  #unit = 'mm';
  set unit(unit: string) {
    this.#unit = unit;
  }

  /**
   * Sets the enclosed volume in each frame of another run, shown beside the present run's for comparison; undefined for
   * none.
   */
  set other(other: { volumes: number[]; name: string } | undefined) {
    this.#comparedVolumes = other;
    this.showCurve();
  }

  /**
   * Shows the boundary votes and the figures below the view, as selected in the view options; requests the data that is
   * missing.
   */
  showFigures(): void {
    const image = this.#image;
    if (!image) return;
    const { below, votes } = this.#ui.options.value;
    if (votes !== 'none' || below === 'boundary') this.#requestVotes();
    if (below === 'between') this.#requestBetween(image);
    const present = this.#votes?.frame === this.#frame ? this.#votes : undefined;
    this.#ui.view.showVotes(votes === 'none' ? undefined : present);
    if (below === 'slices') return;
    const { voxel } = this.#ui.view.crosshair;
    this.#ui.stills.show({
      subject: { volume: image.volume, frame: this.#frame, voxel },
      window: this.window,
      threshold: this.threshold,
      votes: present,
      between: this.#between?.key === this.#betweenKey(image) ? this.#between.between : undefined,
      pair: [this.#pair(image), image.slices],
      outlines: () => this.#frames.map(({ surface }) => this.#ui.view.outlineIn(surface, 2)),
    });
  }

  /** Returns the text for the status line in a state of the lab. */
  describe(state: LabState): string {
    const count = this.#image?.volume.frames ?? 0;
    const steps = this.#history.reports.length;
    if (state === 'running') return this.#frames.length > 0 ? text('track.tracking') : text('track.findingBoundary');
    if (steps === 0) return text('labs.ready');
    if (state !== 'done') return text('track.paused', { tracked: this.#frames.length, frames: count });
    const beat = beatOf(this.#frames.map(({ facts }) => facts.volume));
    if (!beat) return text('track.done', { frames: count });
    return text('track.doneCycle', { frames: count, ejection: (100 * beat.ejection).toFixed(1) });
  }

  /** Returns the index of the slice of the unprepared image that is nearest to the crosshair and has two neighbours. */
  #pair({ volume, slices }: ShownImage): number {
    const { voxel } = this.#ui.view.crosshair;
    const factor = slices > 1 ? (volume.dims[2] - 1) / (slices - 1) : 1;
    return Math.max(1, Math.min(slices - 2, Math.round(voxel[2] / factor)));
  }

  #betweenKey(image: ShownImage): string {
    return `${this.#frame} ${this.#pair(image)}`;
  }

  #requestVotes(): void {
    const { length } = this.#history.reports;
    if (this.#votes?.frame === this.#frame || length <= this.#frame) return;
    this.#request(
      'votes',
      () => this.#client.request('votes', { frame: this.#frame }),
      (votes) => {
        this.#votes = votes;
      },
    );
  }

  #requestBetween(image: ShownImage): void {
    const key = this.#betweenKey(image);
    if (this.#between?.key === key || image.slices < 3) return;
    const body = { frame: this.#frame, slice: this.#pair(image), window: image.volume.window };
    this.#request(
      'between',
      () => this.#client.request('between', body),
      (between) => {
        this.#between = { key, between };
      },
    );
  }

  /**
   * Sends a request for data unless one of the same kind is pending; after the reply, requests what the display needs
   * by then.
   */
  #request<Reply>(kind: string, request: () => Promise<Reply>, take: (reply: Reply) => void): void {
    if (this.#pendingRequests.has(kind)) return;
    this.#pendingRequests.add(kind);
    const run = this.#run;
    request().then(
      (reply) => {
        if (run !== this.#run) return;
        this.#pendingRequests.delete(kind);
        take(reply);
        this.showFigures();
      },
      (error) => {
        if (run !== this.#run) return;
        this.#pendingRequests.delete(kind);
        this.#states.fail(text('track.displayFailed'), error);
      },
    );
  }
}
