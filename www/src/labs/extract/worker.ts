/** Worker of the Extract lab: holds one volume and one model, and serves the page's requests. */
import type { DeformableModel, Mesh, StepReport, Volume } from 'vesicle';
import { send as post, VesicleError, withTransfer } from 'vesicle/channel';
import { toCode } from '../../engine/code';
import { workerFailure } from '../../engine/failure';
import { labelsLike } from '../../engine/likeness';
import { release } from '../../engine/memory';
import type {
  Attractor,
  CodeRequest,
  ExportRequest,
  Failure,
  LevelView,
  Measures,
  ParamValues,
  Plane,
  RunCode,
  Surface,
  VertexQuantity,
  VolumeView,
} from '../../engine/protocol';
import { logged, RunRecorder } from '../../engine/run-log';
import { buffersOf, type Handlers, serveLab, Work } from '../../engine/serving';
import { sectionOf, snapshotOf, transferOf } from '../../engine/surface';
import { checkPlanes, displayOf, levelsOf, openFrame, viewOf } from '../../engine/volumes';
import { text } from '../../texts';
import { programOf, type RunData } from './code';
import { compare } from './compare';
import type { LargeVolume } from './large';
import { buildModel, fittingSetup, restoredModel, valuesFor } from './models';
import type {
  DataEvent,
  LargeSource,
  Loaded,
  MeasuredCoverage,
  Ready,
  Requests,
  ReturnMessage,
  SavedRun,
  Setup,
  WorkerEvent,
} from './protocol';

/**
 * Number of surfaces whose arrays go back and forth between worker and page: one on the screen, one in transit
 * or being filled. With more, surfaces would be made that are never drawn.
 */
const MOST_SURFACES = 2;
/**
 * Least milliseconds between two measurements of the surface during a run (area, volume and others); on small meshes
 * one costs as much as a step.
 */
const MEASURE_EVERY = 400;

/** Least milliseconds between two progress messages of a coverage measurement, or of reading. */
const TELL_EVERY = 100;

/**
 * Number of step reports in a progress message. With fewer, sending the messages costs more than making the reports.
 */
const MOST_REPORTS = 50;

/** The contents of a snapshot besides the surface: none, its measures, or measures and mesh checks. */
type Detail = 'plain' | 'measured' | 'checked';

/** An open volume; `isSmall` tells whether it is in small files, or in a small session. */
interface Image {
  volume?: Volume;
  large?: LargeVolume;
  isSmall: boolean;
}

const send = post<WorkerEvent>;

class Session {
  /** The open volume; of one larger than memory, `#large`, only parts are read. */
  #volume: Volume | undefined;
  #large: LargeVolume | undefined;
  /** Whether the volume is in small files, or in a small session. */
  #isSmall = false;
  /** Origin of the volume, for the code of a run. */
  #origin: RunData | undefined;
  #model: DeformableModel | undefined;
  /** Intensities of the volume that are displayed as black and as white. */
  #window: [number, number] = [0, 1];
  #inverted = false;
  #planes: Plane[] = [];
  #quantity: VertexQuantity | undefined;
  /** Surfaces that the page no longer draws; at first, as many as it may have. */
  #free: (Surface | undefined)[] = Array.from({ length: MOST_SURFACES }, () => undefined);
  #reports: StepReport[] = [];
  #done = false;
  #iteration = 0;
  readonly #log = new RunRecorder<Setup>(['setParams', 'setAttractors']);
  /** Number of coarser pyramid levels the model was built with, besides the volume itself. */
  #levels = 0;
  #measuredAt = 0;
  #receivedAt = 0;
  /** The last report on how much has been read of a volume larger than memory. */
  #data: Omit<DataEvent, 'event'> | undefined;
  /** Only that of a volume larger than memory can be aborted. */
  readonly #opening = new Work();
  readonly #run = new Work();
  readonly #comparison = new Work();
  readonly #coverageRun = new Work();

  readonly handlers: Handlers<Requests> = {
    load: (body) => this.#opening.begin((signal) => this.#load(body, signal)),
    cancelLoad: () => {
      this.#opening.abort();
      return undefined;
    },
    rebuild: (setup) => this.#rebuild(setup),
    play: () => this.#play(),
    pause: () => this.#pause(),
    step: ({ count }) => this.#step(count),
    setParams: (params) => this.#setParams(params),
    planes: (planes) => this.#setPlanes(planes),
    export: (body) => this.#export(body),
    pyramid: ({ levels }) => this.#pyramid(levels),
    setAttractors: (attractors) => this.#setAttractors(attractors),
    quantity: (quantity) => this.#setQuantity(quantity),
    save: () => this.#save(),
    restore: (saved) => this.#restore(saved),
    compare: (setup) => this.#compare(setup),
    cancelCompare: () => this.#comparison.stop(),
    coverage: () => this.#coverage(),
    cancelCoverage: () => this.#coverageRun.stop(),
    seed: () => this.#seed(),
    code: (context) => this.#code(context),
    data: () => ({ extension: 'nii', bytes: this.#image().toNifti() }),
  };

  takeBack(drawn: Surface): void {
    if (this.#free.length < MOST_SURFACES) this.#free.push(drawn);
  }

  async #load(body: Requests['load']['body'], signal: AbortSignal): Promise<Loaded> {
    await this.#pause();
    const { name, source, setup, frame, saved, isSmall = false } = body;
    if ('zarr' in source) return this.#loadLarge(source, body, signal);
    const { volume, frames, unit, voxels } = await openFrame(source, frame, isSmall);
    try {
      const view: VolumeView = { ...viewOf(volume, name, voxels), ...displayOf(source), frames, ...(unit && { unit }) };
      const fitting = fittingSetup(setup, volume);
      const model = saved ? restoredModel(volume, saved, isSmall) : buildModel(volume, fitting, isSmall);
      // No checks of a new model: the page starts the run at once, and would not show their result.
      const ready = this.#replaceModel(model, fitting, saved ? 'checked' : 'measured');
      if (saved) this.#continue(saved);
      this.#keep({ volume, isSmall });
      const files = 'files' in source ? source.files.map(({ name, notes }) => ({ name, notes })) : [];
      this.#origin = { files, frame: frames > 1 ? frame : undefined, volume };
      this.#window = view.window;
      this.#inverted = view.inverted === true;
      const [file, second] = 'files' in source ? source.files : [];
      // Of images of other programs it is known what they are.
      const labels = file && !second && !file.notes ? labelsLike(view.voxels) : 0;
      if (body.isShown) {
        release(view.voxels);
        view.voxels = new Uint8Array();
      }
      return withTransfer({ ...ready, volume: view, levels: fitting.levels, labels }, [view.voxels]);
    } catch (error) {
      volume.free();
      throw error;
    }
  }

  async #loadLarge(
    source: LargeSource,
    { name, setup, isSmall = false }: Requests['load']['body'],
    signal: AbortSignal,
  ): Promise<Loaded> {
    const { LargeVolume } = await import('./large');
    const large = await LargeVolume.open(source, signal);
    try {
      const view = large.view(name);
      if (isSmall) checkPlanes(view);
      const fitting = { ...setup, levels: Math.min(setup.levels, large.coarserLevels) };
      const ready = this.#replaceModel(large.model(fitting, isSmall), fitting, 'measured');
      this.#keep({ large, isSmall });
      this.#origin = { source, name, coarserLevels: large.coarserLevels };
      return withTransfer({ ...ready, volume: view, levels: fitting.levels }, [view.voxels]);
    } catch (error) {
      large.free();
      throw error;
    }
  }

  /** Makes a volume the open one, and frees the one before. */
  #keep({ volume, large, isSmall }: Image): void {
    this.#volume?.free();
    this.#large?.free();
    this.#volume = volume;
    this.#large = large;
    this.#isSmall = isSmall;
    this.#data = undefined;
  }

  #build(setup: Setup): DeformableModel {
    const isSmall = this.#isSmall;
    return this.#large ? this.#large.model(setup, isSmall) : buildModel(this.#image(), setup, isSmall);
  }

  async #rebuild(setup: Setup): Promise<Ready> {
    await this.#pause();
    return this.#replaceModel(this.#build(setup), setup);
  }

  #replaceModel(model: DeformableModel, setup: Setup, detail: Detail = 'checked'): Ready {
    this.#replaceBy(model);
    this.#levels = model.level;
    this.#iteration = 0;
    this.#reports = [];
    this.#done = false;
    this.#log.begin({ ...setup, params: { iso: model.params.iso, ...setup.params } });
    this.#snapshot(detail);
    return { params: { ...model.params }, delta: model.delta };
  }

  #current(): DeformableModel {
    if (!this.#model) throw new VesicleError('invalid-argument', text('extract.noVolume'));
    return this.#model;
  }

  /** Returns the open volume, for what needs all of it. */
  #image(): Volume {
    if (!this.#volume)
      throw new VesicleError('invalid-argument', text(this.#large ? 'extract.tooLargeForThis' : 'extract.noVolume'));
    return this.#volume;
  }

  async #play(): Promise<undefined> {
    await this.#comparison.stop();
    const model = this.#current();
    if (!this.#run.isUnderWay) void this.#begin(model);
  }

  #begin(model: DeformableModel, maxIterations = Number.MAX_SAFE_INTEGER): Promise<void> {
    send({ event: 'state', state: 'running' });
    return this.#run.begin((signal) => this.#runToEnd(model, signal, maxIterations));
  }

  async #runToEnd(model: DeformableModel, signal: AbortSignal, maxIterations: number): Promise<void> {
    let failure: Failure | undefined;
    try {
      await model.run({
        signal,
        maxIterations,
        onStep: (report) => this.#stepped(report),
        onData: (data) => this.#received(data),
      });
    } catch (error) {
      if (!signal.aborted) failure = workerFailure(error);
    }
    // Nothing is read any more, whatever was to come.
    if (this.#data) send({ event: 'data', ...this.#data, waiting: 0 });
    if (failure) this.#reportFailed(failure);
    else this.#reportStopped();
  }

  #received(data: Omit<DataEvent, 'event'>): void {
    this.#data = data;
    const now = performance.now();
    if (data.waiting > 0 && now - this.#receivedAt < TELL_EVERY) return;
    this.#receivedAt = now;
    send({ event: 'data', ...data });
  }

  #record(report: StepReport): void {
    this.#reports.push(report);
    this.#done = report.done;
    this.#iteration = report.iteration;
  }

  #stepped(report: StepReport): void {
    this.#record(report);
    if (this.#free.length === 0) {
      this.#flushReports();
      return;
    }
    const due = performance.now() - this.#measuredAt > MEASURE_EVERY;
    this.#snapshot(due ? 'measured' : 'plain');
  }

  /**
   * Sends the step reports not sent yet if they fill a batch; called after steps without a snapshot. A thousand reports
   * in one message cost the page a tenth of a second.
   */
  #flushReports(): void {
    if (this.#reports.length < MOST_REPORTS) return;
    send({ event: 'progress', reports: this.#reports });
    this.#reports = [];
  }

  async #pause(): Promise<undefined> {
    await this.#comparison.stop();
    return this.#run.stop();
  }

  async #step(count: number): Promise<undefined> {
    await this.#pause();
    const model = this.#current();
    if (this.#large) {
      // A step may have to wait for data.
      await this.#begin(model, count);
      return;
    }
    for (let i = 0; i < count && !this.#done; i++) this.#record(model.step(1));
    this.#reportStopped();
  }

  /** Sends the surface, and then its measures, since the check of a large one takes longer than all else. */
  #reportStopped(): void {
    this.#snapshot('plain');
    const measures = this.#measure(this.#current().mesh, true);
    send({ event: 'state', state: this.#done ? 'done' : 'paused', measures });
  }

  /** Reports a run that failed: first that it has stopped, since the page shows a failure on top of that, and checks last. */
  #reportFailed(failure: Failure): void {
    this.#snapshot('plain');
    send({ event: 'state', state: 'paused' });
    send({ event: 'failure', failure });
    this.#snapshot('checked');
  }

  #setParams(params: ParamValues): ParamValues {
    const model = this.#current();
    model.setParams(params);
    this.#done = false;
    return { ...model.params };
  }

  #setAttractors(attractors: Attractor[]): undefined {
    this.#current().setAttractors(attractors);
    this.#done = false;
  }

  #export({ format, ...options }: ExportRequest): Uint8Array {
    const bytes = this.#current().mesh.toBytes(format, options);
    return withTransfer(bytes, [bytes]);
  }

  #pyramid(levels: number): LevelView[] {
    const inverted = this.#inverted && { inverted: true };
    const views = levelsOf(this.#image(), levels, this.#window).map((view) => ({ ...view, ...inverted }));
    return withTransfer(
      views,
      views.map(({ voxels }) => voxels),
    );
  }

  #setQuantity(quantity: VertexQuantity | undefined): undefined {
    this.#quantity = quantity;
    if (this.#model && !this.#run.isUnderWay) this.#snapshot('checked');
  }

  #save(): SavedRun {
    // Without saved runs there is no undo.
    this.#image();
    const model = this.#current();
    const state = model.save();
    return withTransfer(
      { state, levels: this.#levels, iteration: this.#iteration, done: this.#done, log: this.#log.log },
      [state],
    );
  }

  /** Returns code that repeats the run with the package alone. */
  #code({ stem, edits }: CodeRequest): RunCode {
    return toCode(this.#log.log, (setup) => programOf(setup, this.#origin as RunData, stem), edits);
  }

  /**
   * Restores a saved run. Its state fits only a model with the same number of pyramid levels; if the present model has
   * another number, one that fits is built.
   */
  async #restore(saved: SavedRun): Promise<Ready> {
    await this.#pause();
    if (saved.levels === this.#levels) this.#current().restore(saved.state);
    else this.#replaceBy(restoredModel(this.#image(), saved, this.#isSmall));
    const model = this.#current();
    this.#continue(saved);
    this.#reportStopped();
    return { params: { ...model.params }, delta: model.delta };
  }

  /** Continues a saved run, whose state the model has. */
  #continue({ levels, iteration, done, log }: SavedRun): void {
    this.#levels = levels;
    this.#log.resume(log);
    this.#iteration = iteration;
    this.#reports = [];
    this.#done = done;
  }

  #replaceBy(model: DeformableModel): void {
    this.#coverageRun.abort();
    this.#model?.free();
    this.#model = logged(model, this.#log, ['step', 'setParams', 'setAttractors', 'seed']);
  }

  async #compare(setup: Setup): Promise<Requests['compare']['reply']> {
    await this.#pause();
    const image = this.#image();
    return this.#comparison.begin((signal) =>
      compare(image, setup, this.#isSmall, signal, (run, report) => send({ event: 'comparing', run, report })),
    );
  }

  async #coverage(): Promise<MeasuredCoverage | undefined> {
    this.#image();
    await this.#coverageRun.stop();
    const model = this.#current();
    const iteration = this.#iteration;
    let reportedAt = 0;
    const onProgress = (share: number) => {
      if (performance.now() - reportedAt < TELL_EVERY) return;
      reportedAt = performance.now();
      send({ event: 'covering', share });
    };
    return this.#coverageRun.begin(async (signal) => {
      try {
        return { ...(await model.coverage({ signal, onProgress })), iteration };
      } catch (error) {
        if (signal.aborted) return undefined;
        throw error;
      }
    });
  }

  async #seed(): Promise<number> {
    await this.#pause();
    const report = this.#current().seed();
    this.#record(report);
    this.#reportStopped();
    return report.events.seeds;
  }

  #setPlanes(planes: Plane[]): undefined {
    const mesh = this.#run.isUnderWay ? undefined : this.#model?.mesh;
    // Planes that cut no mesh are not kept, else all models after them would be refused.
    const sections = mesh && planes.map((plane) => sectionOf(mesh, plane));
    this.#planes = planes;
    if (sections) send({ event: 'sections', sections }, buffersOf(sections));
  }

  #snapshot(detail: Detail): void {
    const model = this.#current();
    const { mesh, level } = model;
    const surface = snapshotOf(mesh, this.#free.pop());
    const sections = this.#planes.map((plane) => sectionOf(mesh, plane));
    const measures = detail === 'plain' ? undefined : this.#measure(mesh, detail === 'checked');
    const reports = this.#reports;
    this.#reports = [];
    if (this.#quantity) surface.values = valuesFor(model, this.#quantity);
    send({ event: 'snapshot', surface, level, sections, reports, ...(measures && { measures }) }, [
      ...transferOf(surface),
      ...buffersOf(sections),
    ]);
  }

  #measure(mesh: Mesh, thorough: boolean): Measures {
    const measures: Measures = thorough ? { info: mesh.info(), report: mesh.check() } : { info: mesh.info() };
    this.#measuredAt = performance.now();
    return measures;
  }
}

const session = new Session();
serveLab('deformable', session.handlers, ({ drawn }: ReturnMessage) => session.takeBack(drawn));
