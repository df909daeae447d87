/** Worker of the Track lab: holds one 4D image and one tracker, and serves the page's requests. */
import type { StepReport, SurfaceTracker, Volume } from 'vesicle';
import { send as post, VesicleError, withTransfer } from 'vesicle/channel';
import { toCode } from '../../engine/code';
import { workerFailure } from '../../engine/failure';
import { inWorld } from '../../engine/placing';
import { logged, type RunLog, RunRecorder } from '../../engine/run-log';
import { type Handlers, serveLab, Work } from '../../engine/serving';
import { transferOf } from '../../engine/surface';
import { displayOf, intensitiesOf, viewOf } from '../../engine/volumes';
import type { Warning } from '../../engine/warnings';
import { text } from '../../texts';
import { type CineSpec, trueVolume } from './cine';
import { programOf } from './code';
import { trackForComparison } from './comparing';
import { trackedFrame } from './frames';
import { interpolateSlice } from './interpolate-slice';
import type {
  BoundaryVotes,
  ComparedTrack,
  NamedBytes,
  ObjectQuery,
  OpenedImage,
  ParamValues,
  Preparation,
  Proposal,
  Ready,
  Requests,
  SavedTrack,
  Setup,
  VolumeView,
  WorkerEvent,
} from './protocol';
import { buildTracker, checkSmall, inWords, openImage, prepare, proposeFor } from './source';

/**
 * Parameters that the boundary depends on. If only others change, the boundary found in all frames is kept, provided
 * that its state was saved, and only the surfaces are computed again.
 */
const BOUNDARY_PARAMS = ['threshold', 'window', 'windowFrames', 'cyclic'];

const send = post<WorkerEvent>;

/** A 4D image as opened, and as prepared for tracking. */
interface LoadedImage {
  name: string;
  /** Files of the image; none if it was computed. */
  files: Pick<NamedBytes, 'name' | 'notes'>[];
  original: Volume;
  spec: CineSpec | undefined;
  preparedVolume: Volume;
  preparation: Preparation;
  /** How notes on the files change the display. */
  display: ReturnType<typeof displayOf>;
  /** Whether the image is in small files, or in a small session. */
  isSmall: boolean;
}

class Session {
  #loaded: LoadedImage | undefined;
  #tracker: SurfaceTracker | undefined;
  #setup: Setup | undefined;
  #suggested = 0;
  #iteration = 0;
  #done = false;
  /** Number of frames whose surfaces have been sent to the page. */
  #sent = 0;
  /**
   * State of the tracker saved when the boundary of all frames was found, before the first surface, to return to after
   * a change of parameters; undefined until then.
   */
  #boundaryState: { state: Uint8Array; iteration: number; log: RunLog<Setup> | undefined } | undefined;
  readonly #log = new RunRecorder<Setup>();
  readonly #run = new Work();
  readonly #comparison = new Work();
  readonly #proposal = new Work();

  readonly handlers: Handlers<Requests> = {
    open: (body) => this.#open(body),
    rebuild: (setup) => this.#rebuild(setup),
    propose: (query) => this.#propose(query),
    cancelProposal: () => this.#proposal.stop(),
    play: () => this.#play(),
    pause: () => this.#pause(),
    step: ({ count }) => this.#step(count),
    setParams: (params) => this.#setParams(params),
    votes: ({ frame }) => this.#votes(frame),
    between: ({ frame, slice, window }) => interpolateSlice(this.#image().original, frame, slice, window),
    save: () => this.#save(),
    restore: (saved) => this.#restore(saved),
    view: () => this.#view(),
    sendState: () => this.#reportStopped(),
    export: (body) => this.#export(body),
    frameWarnings: () => this.#frameWarnings(),
    animation: (frame) => this.#current().toGlb(frame),
    compare: ({ setup }) => this.#compare(setup),
    cancelCompare: () => this.#comparison.stop(),
    code: (body) => this.#code(body),
    data: () => ({ extension: 'nii', bytes: this.#image().original.toNifti() }),
  };

  async #open({ name, source, setup, saved, isSmall }: Requests['open']['body']): Promise<OpenedImage> {
    await this.#pause();
    const tell = (what: string) => send({ event: 'preparing', what });
    const began = performance.now();
    const original = await openImage(source, isSmall);
    const spec = 'cine' in source ? source.cine : undefined;
    let made: Volume = original;
    try {
      if (isSmall) checkSmall(original, setup.preparation);
      made = prepare(original, setup.preparation, tell);
      const took = performance.now() - began;
      const ready = this.#adopt(made, setup, isSmall, saved);
      const { dims, spacing } = original;
      this.#freeImage();
      const files = 'files' in source ? source.files.map(({ name, notes }) => ({ name, notes })) : [];
      const [{ preparation }, display] = [setup, displayOf(source)];
      this.#loaded = { name, files, original, spec, preparedVolume: made, preparation, display, isSmall };
      const truth = spec && Array.from({ length: spec.frames }, (_, frame) => trueVolume(spec, frame));
      const volume = this.#view();
      return withTransfer({ ...ready, volume, dims, spacing, truth, openingMs: took }, [volume.voxels]);
    } catch (error) {
      if (made !== original) made.free();
      original.free();
      throw error;
    }
  }

  async #rebuild(setup: Setup): Promise<Ready> {
    await this.#pause();
    return this.#build(setup);
  }

  /** Builds a tracker of the present image; prepares the image again if the preparation has changed. */
  #build(setup: Setup): Ready {
    const loaded = this.#image();
    if (same(loaded.preparation, setup.preparation))
      return { ...this.#adopt(loaded.preparedVolume, setup, loaded.isSmall), volume: undefined };
    if (loaded.isSmall) checkSmall(loaded.original, setup.preparation);
    const made = prepare(loaded.original, setup.preparation, (what) => send({ event: 'preparing', what }));
    try {
      const ready = this.#adopt(made, setup, loaded.isSmall);
      if (loaded.preparedVolume !== loaded.original) loaded.preparedVolume.free();
      this.#loaded = { ...loaded, preparedVolume: made, preparation: setup.preparation };
      const volume = this.#view();
      return withTransfer({ ...ready, volume }, [volume.voxels]);
    } catch (error) {
      if (made !== loaded.original) made.free();
      throw error;
    }
  }

  #adopt(volume: Volume, setup: Setup, isSmall: boolean, saved?: SavedTrack): Omit<Ready, 'volume'> {
    const { tracker, suggested } = buildTracker(volume, setup, isSmall, saved?.state);
    this.#tracker?.free();
    this.#tracker = logged(tracker, this.#log, ['step', 'setParams']);
    this.#log.begin(setup);
    if (saved) this.#log.resume(saved.log);
    this.#setup = setup;
    this.#suggested = suggested;
    this.#boundaryState = undefined;
    this.#setProgress(saved?.iteration ?? 0, saved?.done ?? false);
    return this.#ready();
  }

  #ready(): Omit<Ready, 'volume'> {
    const { params, noise } = this.#current();
    return { params: { ...params }, suggested: this.#suggested, noise };
  }

  #setProgress(iteration: number, done: boolean): void {
    this.#iteration = iteration;
    this.#done = done;
    this.#sent = this.#current().statistics.length;
  }

  #view(): VolumeView {
    const { name, preparedVolume, display } = this.#image();
    return { ...viewOf(preparedVolume, name, intensitiesOf(preparedVolume, preparedVolume.frames)), ...display };
  }

  #image(): LoadedImage {
    if (!this.#loaded) throw new VesicleError('invalid-argument', text('track.noImage'));
    return this.#loaded;
  }

  #current(): SurfaceTracker {
    if (!this.#tracker) throw new VesicleError('invalid-argument', text('track.noImage'));
    return this.#tracker;
  }

  #freeImage(): void {
    const loaded = this.#loaded;
    if (!loaded) return;
    if (loaded.preparedVolume !== loaded.original) loaded.preparedVolume.free();
    loaded.original.free();
  }

  async #propose(query: ObjectQuery): Promise<Proposal | undefined> {
    await this.#pause();
    const { preparedVolume } = this.#image();
    return this.#proposal.begin(async (signal) => {
      try {
        return await proposeFor(preparedVolume, query, signal);
      } catch (error) {
        if (signal.aborted) return undefined;
        throw error;
      }
    });
  }

  async #play(): Promise<undefined> {
    await this.#stopOthers();
    const tracker = this.#current();
    if (this.#run.isUnderWay || this.#done) return;
    // Before the run starts, since its first step may already end it.
    send({ event: 'state', state: 'running' });
    void this.#run.begin((signal) => this.#runToEnd(tracker, signal));
  }

  async #runToEnd(tracker: SurfaceTracker, signal: AbortSignal): Promise<void> {
    try {
      await tracker.run({ signal, onStep: (report) => this.#stepped(report) });
    } catch (error) {
      // After the state event, so that the page shows the failure on top of that state.
      if (!signal.aborted) queueMicrotask(() => send({ event: 'failure', failure: workerFailure(inWords(error)) }));
    }
    this.#reportStopped();
  }

  #stepped(report: StepReport): void {
    const tracker = this.#current();
    this.#iteration = report.iteration;
    this.#done = report.done;
    const { length } = tracker.statistics;
    if (length === 0 && report.iteration === tracker.frames)
      this.#boundaryState = { state: tracker.save(), iteration: report.iteration, log: this.#log.log };
    const index = length > this.#sent ? length - 1 : undefined;
    this.#sent = length;
    const frame = index === undefined ? undefined : trackedFrame(tracker, index, this.#image().spec);
    const transfer = frame ? transferOf(frame.surface) : [];
    send({ event: 'step', report, index, frame, closing: tracker.cycleClosureError }, transfer);
  }

  async #pause(): Promise<undefined> {
    await this.#stopOthers();
    return this.#run.stop();
  }

  /** Ends what uses the image besides the run. */
  async #stopOthers(): Promise<undefined> {
    await this.#proposal.stop();
    return this.#comparison.stop();
  }

  /** Does a number of steps, which can be paused as a run can: one may take minutes in a large image. */
  async #step(count: number): Promise<undefined> {
    await this.#pause();
    const tracker = this.#current();
    if (count === 0 || this.#done) return this.#reportStopped();
    send({ event: 'state', state: 'running' });
    await this.#run.begin((signal) => this.#runSteps(tracker, count, signal));
  }

  async #runSteps(tracker: SurfaceTracker, maxIterations: number, signal: AbortSignal): Promise<void> {
    try {
      await tracker.run({ signal, maxIterations, onStep: (report) => this.#stepped(report) });
    } catch (error) {
      if (!signal.aborted) throw inWords(error);
    } finally {
      this.#reportStopped();
    }
  }

  #reportStopped(): undefined {
    send({ event: 'state', state: this.#done ? 'done' : 'paused' });
  }

  /**
   * Changes parameters of the tracker; results that depend on them are discarded, for all frames, and computed again by
   * later steps.
   */
  async #setParams(values: ParamValues): Promise<Requests['setParams']['reply']> {
    await this.#pause();
    const tracker = this.#current();
    const before: ParamValues = { ...tracker.params };
    tracker.setParams(values);
    const params: ParamValues = { ...tracker.params };
    const changed = Object.keys(params).filter((name) => !Object.is(params[name], before[name]));
    const setup = { ...(this.#setup as Setup) };
    this.#setup = { ...setup, params: { ...setup.params, ...values } };
    if (changed.some((name) => BOUNDARY_PARAMS.includes(name))) {
      this.#boundaryState = undefined;
      this.#setProgress(0, false);
    } else if (changed.length > 0 && this.#sent > 0) this.#backToBoundary(params);
    return { params, iteration: this.#iteration };
  }

  #backToBoundary(params: ParamValues): void {
    if (!this.#boundaryState) {
      const { preparedVolume, isSmall } = this.#image();
      this.#adopt(preparedVolume, this.#setup as Setup, isSmall);
      return;
    }
    const tracker = this.#current();
    tracker.restore(this.#boundaryState.state);
    this.#log.resume(this.#boundaryState.log);
    tracker.setParams(Object.fromEntries(Object.entries(params).filter(([name]) => !BOUNDARY_PARAMS.includes(name))));
    this.#setProgress(this.#boundaryState.iteration, false);
  }

  #votes(frame: number): BoundaryVotes {
    const tracker = this.#current();
    const all = tracker.boundary(frame);
    const count = all.length / 5;
    const [points, weights] = [new Float32Array(3 * count), new Float32Array(count)];
    for (let i = 0; i < count; i++) {
      points.set(all.subarray(5 * i, 5 * i + 3), 3 * i);
      weights[i] = all[5 * i + 4] ?? 0;
    }
    return { frame, points: inWorld(points, tracker.origin), weights };
  }

  #save(): SavedTrack {
    const setup = this.#setup as Setup;
    const log = this.#log.log;
    return { state: this.#current().save(), setup, iteration: this.#iteration, done: this.#done, log };
  }

  async #restore({ state, setup, iteration, done, log }: SavedTrack): Promise<Ready> {
    await this.#pause();
    const places = ({ preparation, box, at, cavity = 'open' }: Setup) => ({ preparation, box, at, cavity });
    const fits = this.#setup && same(places(this.#setup), places(setup));
    if (!fits) this.#build(setup);
    this.#current().restore(state);
    this.#log.resume(log);
    this.#setup = setup;
    this.#boundaryState = undefined;
    this.#setProgress(iteration, done);
    return { ...this.#ready(), volume: undefined };
  }

  /** Returns code that repeats the run, for the surface of a frame, or the newest one if that has none yet. */
  #code({ stem, edits, frame = 0 }: Requests['code']['body']): Requests['code']['reply'] {
    const isTracked = frame < this.#current().statistics.length;
    const program = (setup: Setup) => programOf(setup, this.#image(), isTracked ? frame : undefined, stem);
    return toCode(this.#log.log, program, edits);
  }

  #frameWarnings(): Warning[][] {
    const tracker = this.#current();
    return tracker.statistics.map((_, frame) => {
      const mesh = tracker.meshAt(frame);
      try {
        return [...mesh.warnings];
      } finally {
        mesh.free();
      }
    });
  }

  #export({ frame, format, ...options }: Requests['export']['body']): Uint8Array {
    const mesh = this.#current().meshAt(frame);
    try {
      return mesh.toBytes(format, options);
    } finally {
      mesh.free();
    }
  }

  async #compare(setup: Setup): Promise<ComparedTrack | undefined> {
    await this.#pause();
    const { original, spec, isSmall } = this.#image();
    const tell = (part: number, phase: string) => send({ event: 'comparing', part, phase });
    return this.#comparison.begin((signal) => trackForComparison(original, spec, setup, isSmall, signal, tell));
  }
}

function same(one: unknown, other: unknown): boolean {
  return JSON.stringify(one) === JSON.stringify(other);
}

serveLab('tracking', new Session().handlers);
