/** Worker of the Sculpt lab: holds the meshes and one model of them, and serves the page's requests. */
import type { StepReport } from 'vesicle';
import { send as post, VesicleError } from 'vesicle/channel';
import { toCode } from '../../engine/code';
import { workerFailure } from '../../engine/failure';
import { logged, RunRecorder } from '../../engine/run-log';
import { type Handlers, serveLab, Work } from '../../engine/serving';
import { transferOf } from '../../engine/surface';
import { text } from '../../texts';
import { meshFile, type Origins, originsOf, programOf } from './code';
import {
  buildModel,
  factsOf,
  firstModel,
  freeScene,
  restoredModel,
  type Scene,
  sceneFrom,
  surfaceOf,
  texturedSurfaceOf,
  valuesFor,
} from './model';
import { Preview } from './preview';
import type {
  FrameContents,
  FrameEvent,
  OpenedScene,
  ParamValues,
  Pose,
  PoseLog,
  PoseMessage,
  Ready,
  Requests,
  SavedPose,
  Setup,
  ShownMessage,
  Support,
  WorkerEvent,
} from './protocol';
import { recorded } from './recording';
import { levelsOf, stagesOf } from './stages';
import { TargetPath } from './target-path';

/** Number of logs that are kept: more than undo has states. */
const MOST_LOGS = 200;

type Model = ReturnType<typeof buildModel>;
const send = post<WorkerEvent>;

class Session {
  #scene: Scene = { detail: undefined, base: undefined };
  #origins: Origins = {};
  #model: Model | undefined;
  readonly #log = new RunRecorder<PoseLog['setup']>();
  /** Logs of saved states. */
  readonly #logs = new Map<string, PoseLog | undefined>();
  #preview = new Preview();
  #start: Pose = [];
  #support: Support = 'membrane';
  #view: FrameContents = { layout: 'result', quantity: undefined, textured: false };
  readonly #path = new TargetPath((model, pose) => this.#preview.aim(model, pose));
  #dragging = false;
  #poseId = 0;
  /** Reports of the latest steps, which have not been sent to the page yet. */
  #reports: StepReport[] = [];
  #last: StepReport | undefined;
  #iteration = 0;
  #durationMs = 0;
  /** Serial number of the last frame sent to the page. */
  #sentSerial = 0;
  /** Serial number of the last frame that the page has drawn; the next step waits until it is that of the last sent. */
  #shownSerial = 0;
  readonly #run = new Work();
  readonly #recording = new Work();
  /** Resumes a run that waits until the page has drawn a frame or sends a new pose. */
  #wake: () => void = () => undefined;

  readonly handlers: Handlers<Requests> = {
    open: (body) => this.#open(body),
    rebuild: (setup) => this.#rebuild(setup),
    film: ({ film, frame }) => {
      this.#path.setFilm(film, frame);
      return undefined;
    },
    play: () => this.#play(),
    settle: () => this.#settle(),
    pause: () => this.#run.stop(),
    step: ({ count }) => this.#steps(count),
    setParams: (params) => this.#setParams(params),
    show: (view) => this.#show(view),
    originals: () => this.#originals(),
    save: () => this.#save(),
    log: () => this.#log.log,
    code: ({ stem, edits }) => toCode(this.#log.log, (setup) => programOf(setup, this.#origins, stem), edits),
    data: () => ({ extension: 'obj', bytes: meshFile(this.#origins) }),
    restore: (saved) => this.#restore(saved),
    stages: (kind) => stagesOf(kind),
    record: (body) => this.#record(body.frameSeconds),
    cancelRecord: () => this.#recording.stop(),
    export: ({ format, recentre = false, warnings = [] }) =>
      this.#current().mesh.toBytes(format, { recentre, warnings }),
  };

  shown({ serial }: ShownMessage): void {
    this.#shownSerial = serial;
    this.#wake();
  }

  /** Accepts a target pose at once, so that the next step uses the newest one; starts a run if none is in progress. */
  pose({ pose, poseId, dragging }: PoseMessage): void {
    if (!this.#model) return;
    try {
      if (dragging) this.#path.jumpTo(this.#model, pose);
      else this.#path.glideTo(this.#model, pose);
    } catch (error) {
      send({ event: 'refused', failure: workerFailure(error), pose: this.#path.finalTarget(this.#model) });
    }
    this.#poseId = poseId;
    this.#dragging = dragging;
    this.#last = undefined;
    if (this.#run.isUnderWay) this.#wake();
    else this.#begin();
  }

  async #open({ source, setup, saved, log }: Requests['open']['body']): Promise<OpenedScene> {
    await this.#run.stop();
    await this.#recording.stop();
    const scene = await sceneFrom(source);
    const began = performance.now();
    try {
      const { model, start } = saved ? restoredModel(scene, setup, saved) : firstModel(scene, setup);
      const ready = this.#adopt(model, start, setup);
      if (saved) this.#log.resume(log);
      if (saved?.log) this.#logs.set(saved.log, log);
      freeScene(this.#scene);
      this.#scene = scene;
      this.#origins = originsOf(source);
      const { bandCount: bands, mesh } = this.#current();
      const detail = scene.detail?.triangleCount;
      const { texture, warnings } = mesh;
      const buildMs = performance.now() - began;
      const hasChoice = detail !== undefined && !scene.base;
      const { support } = setup;
      return { ...ready, box: mesh.info().bounds, detail, bands, support, hasChoice, texture, warnings, buildMs };
    } catch (error) {
      freeScene(scene);
      throw error;
    }
  }

  async #rebuild(setup: Setup): Promise<Ready> {
    await this.#run.stop();
    const start = setup.start ?? (setup.support === this.#support ? this.#start : undefined);
    const first = firstModel(this.#scene, { ...setup, start });
    return this.#adopt(first.model, first.start, setup);
  }

  #adopt(built: Model, start: Pose, { params, pose, support }: Setup): Ready {
    this.#model?.free();
    const model = logged(built, this.#log, ['step', 'setParams', 'setEllipsoids']);
    this.#model = model;
    this.#log.begin({ start, params, support });
    this.#start = start;
    this.#support = support;
    this.#preview = new Preview();
    this.#dragging = false;
    this.#path.rewind(0);
    this.#iteration = 0;
    this.#forget();
    if (pose) this.#path.glideTo(model, pose);
    return { params: { ...model.params }, start, pose: pose ?? start };
  }

  /** Discards the step reports, which belong to an earlier model or state, and allows the next frame to be sent. */
  #forget(): void {
    this.#reports = [];
    this.#last = undefined;
    this.#shownSerial = this.#sentSerial;
  }

  #current(): Model {
    if (!this.#model) throw new VesicleError('invalid-argument', text('sculpt.noMesh'));
    return this.#model;
  }

  #play(): undefined {
    this.#current();
    this.#path.play();
    this.#last = undefined;
    this.#begin();
  }

  #settle(): undefined {
    this.#current();
    this.#last = undefined;
    this.#begin();
  }

  #begin(): void {
    if (this.#run.isUnderWay) return;
    void this.#run.begin((signal) => this.#runToRest(signal));
  }

  async #runToRest(signal: AbortSignal): Promise<void> {
    signal.addEventListener('abort', () => this.#wake());
    send({ event: 'state', state: 'running' });
    try {
      await this.#frames(signal);
    } catch (error) {
      // After the state event, so that the page shows the failure on top of that state.
      queueMicrotask(() => send({ event: 'failure', failure: workerFailure(error) }));
    }
    this.#path.stop();
    this.#standStill();
  }

  /**
   * Steps the model frame by frame, each after the page has drawn the previous one, until it has converged; while a
   * drag lasts, it then waits for the next pose.
   */
  async #frames(signal: AbortSignal): Promise<void> {
    while (!signal.aborted && (this.#dragging || !this.#isAtRest())) {
      if (this.#isAtRest()) await this.#until(() => !this.#isAtRest() || !this.#dragging, signal);
      else {
        this.#next();
        this.#sendFrame();
        await this.#until(() => this.#shownSerial === this.#sentSerial, signal);
      }
    }
  }

  #isAtRest(): boolean {
    return this.#last?.done === true && !this.#path.isUnderWay && !(this.#preview.on && !this.#dragging);
  }

  async #until(holds: () => boolean, signal: AbortSignal): Promise<void> {
    while (!holds() && !signal.aborted) {
      await new Promise<void>((resolve) => {
        this.#wake = resolve;
      });
    }
  }

  /** Does one step of the model, after moving its target by one frame of the film or glide. */
  #next(): void {
    const model = this.#current();
    this.#path.next(model);
    // A surface that holds itself has no other resolution.
    if (this.#support === 'membrane') this.#preview.prepare(model, this.#motion(), this.#durationMs);
    const began = performance.now();
    const report = model.step(1);
    this.#durationMs = performance.now() - began;
    if (report.iteration !== this.#last?.iteration) this.#reports.push(report);
    this.#last = report;
    this.#iteration = report.iteration;
  }

  #motion(): 'none' | 'path' | 'drag' {
    if (this.#dragging) return 'drag';
    return this.#path.isUnderWay || !this.#last?.done ? 'path' : 'none';
  }

  async #steps(count: number): Promise<undefined> {
    await this.#run.stop();
    for (let i = 0; i < count; i++) {
      this.#path.playOne();
      if (this.#isAtRest()) break;
      this.#next();
    }
    this.#path.stop();
    this.#preview.end(this.#current());
    this.#sendFrame();
    this.#standStill();
  }

  #standStill(): void {
    const model = this.#model;
    if (!model) return;
    const measures = { info: model.mesh.info(), report: model.mesh.check() };
    send({ event: 'measured', measures, facts: factsOf(model) });
    send({ event: 'state', state: this.#last?.done ? 'done' : 'paused' });
  }

  /** Ends a preview, then sets parameters of the model; returns the values of all parameters. */
  #setParams(params: ParamValues): ParamValues {
    const model = this.#current();
    this.#preview.end(model);
    model.setParams(params);
    this.#last = undefined;
    return { ...model.params };
  }

  #show(view: FrameContents): undefined {
    this.#view = view;
    if (!this.#run.isUnderWay && this.#model) this.#sendFrame();
  }

  #sendFrame(): void {
    const model = this.#current();
    const { layout, quantity, textured } = this.#view;
    const values = quantity && valuesFor(model, quantity);
    const result = textured ? texturedSurfaceOf(model.mesh) : surfaceOf(model.mesh, values);
    this.#sentSerial += 1;
    const frame: FrameEvent = {
      event: 'frame',
      serial: this.#sentSerial,
      result,
      ...(layout !== 'result' && { base: surfaceOf(model.baseMesh, values) }),
      ...(layout === 'row' && { link: surfaceOf(model.linkMesh, values) }),
      ...(layout === 'levels' && { levels: levelsOf(model) }),
      reports: this.#reports,
      ellipsoids: model.ellipsoids,
      pose: this.#path.finalTarget(model),
      ...{ poseId: this.#poseId, frame: this.#path.frame, durationMs: this.#durationMs, preview: this.#preview.on },
    };
    this.#reports = [];
    send(
      frame,
      [frame.result, frame.base, frame.link].flatMap((one) => (one ? transferOf(one) : [])),
    );
  }

  #originals(): Requests['originals']['reply'] {
    const setup = { start: undefined, params: {}, pose: undefined, support: this.#support };
    const model = buildModel(this.#scene, this.#start, setup);
    const { detail } = this.#scene;
    try {
      return { base: surfaceOf(model.baseMesh), detail: detail && surfaceOf(detail) };
    } finally {
      model.free();
    }
  }

  /** Records the film as an animated GLB, then restores the model to its previous state; undefined if cancelled. */
  async #record(frameSeconds: number): Promise<Requests['record']['reply']> {
    await this.#run.stop();
    await this.#recording.stop();
    const model = this.#current();
    const { film } = this.#path;
    if (!film) throw new VesicleError('invalid-argument', text('sculpt.noFilm'));
    const before = model.save();
    const { log } = this.#log;
    const tell = (progress: number) => send({ event: 'recorded', progress });
    return this.#recording
      .begin((signal) => recorded(model, film, frameSeconds, signal, tell))
      .finally(() => {
        model.restore(before);
        this.#log.resume(log);
      });
  }

  #save(): SavedPose {
    this.#preview.end(this.#current());
    const log = crypto.randomUUID();
    this.#logs.set(log, this.#log.log);
    const [oldest = ''] = this.#logs.keys();
    if (this.#logs.size > MOST_LOGS) this.#logs.delete(oldest);
    return {
      state: this.#current().save(),
      support: this.#support,
      start: this.#start,
      iteration: this.#iteration,
      frame: this.#path.frame,
      log,
    };
  }

  async #restore({ state, frame, iteration, log = '' }: SavedPose): Promise<Ready> {
    await this.#run.stop();
    const model = this.#current();
    model.restore(state);
    this.#log.resume(this.#logs.get(log));
    this.#preview = new Preview();
    this.#path.rewind(frame);
    this.#iteration = iteration;
    this.#forget();
    return { params: { ...model.params }, start: this.#start, pose: model.targets };
  }
}

const session = new Session();
serveLab('multires', session.handlers, (message: ShownMessage | PoseMessage) => {
  if (message.kind === 'shown') session.shown(message);
  else session.pose(message);
});
