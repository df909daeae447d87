/** Worker of the Reconstruct lab: holds points, cameras and one model of them, and serves the page's requests. */
import type { ImplicitSurface, StepReport } from 'vesicle';
import { send as post, VesicleError } from 'vesicle/channel';
import { toCode } from '../../engine/code';
import { workerFailure } from '../../engine/failure';
import type { Surface } from '../../engine/protocol';
import { logged, RunRecorder } from '../../engine/run-log';
import { buffersOf, type Handlers, serveLab, Work } from '../../engine/serving';
import { snapshotOf, transferOf } from '../../engine/surface';
import { fileOf } from '../../engine/volumes';
import { text } from '../../texts';
import { pointsFile, programOf } from './code';
import {
  applyEdits,
  buildModel,
  choiceIn,
  cloudFrom,
  cubicDims,
  fitOf,
  levelOf,
  toPointEdits,
  valuesFor,
} from './model';
import type {
  CameraView,
  Cloud,
  Edits,
  Loaded,
  ParamValues,
  PointArray,
  PointQuantity,
  Ready,
  Requests,
  Setup,
  WorkerEvent,
} from './protocol';
import { timeSolves } from './timing';

/** Least milliseconds between two previews of a surface during its extraction. */
const PREVIEW_EVERY = 100;
/** Least milliseconds between two progress events during a run. */
const REPORT_EVERY = 50;

const send = post<WorkerEvent>;

class Session {
  #cloud: Cloud | undefined;
  #cameras: CameraView[] = [];
  #setup: Setup | undefined;
  #model: ImplicitSurface | undefined;
  #quantity: PointQuantity | undefined;
  /** Reports of the latest steps, which have not been sent to the page yet. */
  #reports: StepReport[] = [];
  #reportedAt = 0;
  #previewedAt = 0;
  /** Whether the page has drawn the surface sent last; the next preview waits for it. */
  #shown = true;
  /**
   * Version of the complete mesh sent last, so that none is sent twice; empty if none was sent or it must be sent
   * again.
   */
  #sent = '';
  #constraintsSent = false;
  #last: StepReport | undefined;
  /** File of the points; undefined if they were computed. */
  #file: string | undefined;
  readonly #log = new RunRecorder<Setup>();
  readonly #run = new Work();
  readonly #timing = new Work();

  readonly handlers: Handlers<Requests> = {
    load: (body) => this.#load(body),
    rebuild: (setup) => this.#rebuild(setup),
    play: () => this.#play(),
    pause: () => this.#pause(),
    step: ({ count }) => this.#step(count),
    setParams: (params) => this.#setParams(params),
    setEdits: (edits) => this.#setEdits(edits),
    save: () => ({
      ...{ state: this.#current().save(), setup: this.#setup as Setup },
      ...{ last: this.#last, log: this.#log.log },
    }),
    code: ({ stem, edits }) => {
      const data = { file: this.#file, cameras: this.#cameras, choice: this.#model && choiceIn(this.#model) };
      return toCode(this.#log.log, (setup) => programOf(setup, data, stem), edits);
    },
    data: () => ({ extension: 'xyz', bytes: pointsFile(this.#file, this.#points().points) }),
    export: ({ format, ...options }) => this.#current().mesh.toBytes(format, options),
    volume: ({ size }) => this.#volume(size),
    quantity: (quantity) => this.#setQuantity(quantity),
    timing: (body) => this.#time(body),
    cancelTiming: () => this.#timing.stop(),
  };

  shown(): void {
    this.#shown = true;
  }

  async #load({ source, cameras, setup, saved }: Requests['load']['body']): Promise<Loaded> {
    await this.#pause();
    const cloud = await cloudFrom(source);
    const removed = setup.edits.removed.filter((index) => index < cloud.points.length / 3);
    const known = { ...setup, edits: { ...setup.edits, removed } };
    const model = buildModel(cloud, cameras, known, saved?.state);
    this.#cloud = cloud;
    this.#file = 'file' in source ? source.file.name : undefined;
    this.#cameras = cameras;
    const ready = this.#adopt(model, known);
    this.#last = saved?.last;
    if (saved) this.#log.resume(saved.log);
    return { ...ready, cloud };
  }

  async #rebuild(setup: Setup): Promise<Ready> {
    await this.#pause();
    return this.#adopt(buildModel(this.#points(), this.#cameras, setup), setup);
  }

  #adopt(model: ImplicitSurface, setup: Setup): Ready {
    this.#model?.free();
    this.#model = logged(model, this.#log, ['step', 'setParams']);
    this.#log.begin(setup);
    this.#setup = setup;
    this.#sent = '';
    this.#shown = true;
    this.#startOver();
    return { params: { ...model.params } };
  }

  /**
   * Discards the step reports and marks the constraints as not sent, because the points, their edits or the model have
   * changed.
   */
  #startOver(): void {
    this.#reports = [];
    this.#last = undefined;
    this.#constraintsSent = false;
  }

  #points(): Cloud {
    if (!this.#cloud) throw new VesicleError('invalid-argument', text('reconstruct.noPoints'));
    return this.#cloud;
  }

  #pointsInForce(): PointArray {
    const { points } = this.#points();
    return this.#setup ? applyEdits(points, this.#setup.edits) : points;
  }

  #current(): ImplicitSurface {
    if (!this.#model) throw new VesicleError('invalid-argument', text('reconstruct.noPoints'));
    return this.#model;
  }

  async #play(): Promise<undefined> {
    await this.#timing.stop();
    const model = this.#current();
    if (this.#run.isUnderWay) return;
    send({ event: 'state', state: 'running' });
    void this.#run.begin((signal) => this.#runToEnd(model, signal));
  }

  async #runToEnd(model: ImplicitSurface, signal: AbortSignal): Promise<void> {
    try {
      await model.run({ signal, onStep: (report) => this.#stepped(report) });
    } catch (error) {
      // After the state event, so that the page shows the failure on top of that state.
      if (!signal.aborted) queueMicrotask(() => send({ event: 'failure', failure: workerFailure(error) }));
    }
    this.#reportStopped();
  }

  #stepped(report: StepReport): void {
    this.#last = report;
    this.#reports.push(report);
    const now = performance.now();
    if (now - this.#reportedAt > REPORT_EVERY) this.#flushReports();
    this.#showConstraints();
    if (report.phase === 'extract' && now - this.#previewedAt > PREVIEW_EVERY) this.#preview();
  }

  #flushReports(): void {
    if (this.#reports.length > 0) send({ event: 'progress', reports: this.#reports });
    this.#reports = [];
    this.#reportedAt = performance.now();
  }

  #showConstraints(): void {
    if (this.#constraintsSent) return;
    const { surface, exterior } = this.#current().constraints();
    if (exterior.length === 0) return;
    this.#constraintsSent = true;
    send({ event: 'constraints', surface, exterior }, buffersOf([surface, exterior]));
    send({ event: 'measured', fit: fitOf(this.#current(), Number.NaN, false) });
  }

  async #pause(): Promise<undefined> {
    await this.#timing.stop();
    return this.#run.stop();
  }

  async #step(count: number): Promise<undefined> {
    await this.#pause();
    const model = this.#current();
    for (let i = 0; i < count && !this.#last?.done; i++) this.#stepped(model.step(1));
    this.#previewedAt = 0;
    if (this.#last?.phase === 'extract') this.#preview();
    // Those of a restored model have not been sent.
    this.#showConstraints();
    this.#reportStopped();
  }

  #reportStopped(): void {
    this.#flushReports();
    this.#showSurface();
    this.#measure();
    send({ event: 'state', state: this.#last?.done ? 'done' : 'paused' });
  }

  #setParams(params: ParamValues): ParamValues {
    const model = this.#current();
    model.setParams(params);
    if (this.#setup) this.#setup = { ...this.#setup, params: { ...model.params } };
    this.#last = undefined;
    return { ...model.params };
  }

  /** Replaces the point edits of the model; a run in progress continues with them. */
  #setEdits(edits: Edits): undefined {
    this.#current().setEdits(toPointEdits(edits));
    this.#log.add('setEdits', edits);
    if (this.#setup) this.#setup = { ...this.#setup, edits };
    this.#startOver();
  }

  #setQuantity(quantity: PointQuantity | undefined): undefined {
    this.#quantity = quantity;
    this.#sent = '';
    if (!this.#run.isUnderWay) this.#showSurface();
  }

  /**
   * Sends a preview of the surface extracted so far, if it has vertices, unless the page has not drawn the last one
   * yet.
   */
  #preview(): void {
    if (!this.#shown) return;
    const mesh = this.#current().preview();
    try {
      if (mesh.vertexCount > 0) this.#sendSurface(snapshotOf(mesh), true);
    } finally {
      mesh.free();
      this.#previewedAt = performance.now();
    }
  }

  /** Sends the complete surface to the page, if there is one that the page does not have already. */
  #showSurface(): void {
    const model = this.#model;
    if (!model || model.mesh.vertexCount === 0) return;
    const { mesh } = model;
    const version = `${mesh.topologyVersion} ${mesh.geometryVersion} ${this.#last?.done}`;
    if (version === this.#sent) return;
    this.#sent = version;
    const values = this.#quantity && valuesFor(model, this.#pointsInForce(), this.#quantity);
    this.#sendSurface({ ...snapshotOf(mesh), ...(values && { values }) }, false);
  }

  #sendSurface(surface: Surface, preview: boolean): void {
    this.#shown = false;
    send({ event: 'surface', surface, preview }, transferOf(surface));
  }

  #measure(): void {
    const model = this.#current();
    const whole = model.mesh.vertexCount > 0;
    const fit = fitOf(model, this.#last?.residual ?? Number.NaN, whole);
    const measures = whole ? { info: model.mesh.info(), report: model.mesh.check() } : undefined;
    send({ event: 'measured', fit, ...(measures && { measures }) });
  }

  #volume(size: number): Requests['volume']['reply'] {
    const model = this.#current();
    // Without outliers that are discarded, as the volume.
    const volume = model.toVolume(cubicDims(model.constraints().surface, size));
    try {
      return { ...fileOf(volume), level: levelOf(model) };
    } finally {
      volume.free();
    }
  }

  async #time(body: Requests['timing']['body']): Promise<Requests['timing']['reply']> {
    await this.#pause();
    const { params } = this.#current();
    const setup = { ...this.#setup, params } as Setup;
    return this.#timing.begin((signal) =>
      timeSolves(this.#points(), this.#cameras, setup, body, signal, (timing) => send({ event: 'timed', timing })),
    );
  }
}

const session = new Session();
serveLab('implicit', session.handlers, () => session.shown());
