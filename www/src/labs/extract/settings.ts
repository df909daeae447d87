import { toFailure } from '../../engine/failure';
import type { Attractor, ParamValues, VolumeView } from '../../engine/protocol';
import type { HistoryMark } from '../../kit/history';
import type { Moments } from '../../lab/session/moments';
import type { LabStates } from '../../lab/states';
import { type SavedMoment, UndoHistory } from '../../lab/undo-history';
import { plural, text } from '../../texts';
import type { ExtractClient } from './client';
import type { ExtractParts } from './parts';
import type { Preset, Variant } from './presets';
import type { SavedRun, Setup, StartShape } from './protocol';
import type { ExtractResults } from './results';
import type { StartChoice } from './start';

/**
 * Radius of the sphere around the crosshair that the user can choose as initial surface, as a fraction of the volume's
 * shortest side.
 */
const SPHERE_PART = 0.1;
/** Radius of influence of a new attractor, as a fraction of the volume's shortest side. */
const ATTRACTOR_PART = 0.15;

/** Message why nothing can be changed after a failure of the engine. */
const BROKEN = text('labs.engineStopped');

/** The page's part of a saved state; the worker saves the model. Undo restores both. */
interface PageState {
  choice: StartChoice;
  params: ParamValues;
  attractors: Attractor[];
  /** Creates a mark in the run's history at the iteration at which the model was saved. */
  mark: (iteration: number) => HistoryMark;
}

type Sphere = Omit<Extract<StartShape, { kind: 'sphere' }>, 'kind'>;

const sphereIn = (start: StartShape): Sphere | undefined => {
  if (start.kind !== 'sphere') return undefined;
  const { center, radius } = start;
  return { center, radius };
};

export type ExtractMoments = Moments<SavedMoment<PageState, SavedRun>>;

/**
 * Manages the settings that the Extract lab's model is built and run with: changes them, sends them to the worker, and
 * undoes changes.
 */
export class ExtractSettings {
  readonly #client: ExtractClient;
  readonly #ui: ExtractParts;
  readonly #states: LabStates;
  readonly #results: ExtractResults;
  readonly #onChange: () => void;
  readonly #undo: UndoHistory<PageState, SavedRun>;
  #volume: VolumeView | undefined;
  /** The sphere that the model began as; undefined if it began otherwise. */
  #sphere: Sphere | undefined;
  /** The parameters in force; rebuilding the model keeps them. */
  #params: ParamValues = {};
  /** The model's attractors; the list on the page may contain one whose request is pending. */
  #attractors: Attractor[] = [];

  /**
   * `onChange` is called whenever the settings in force may have changed, to display them and to update the page's
   * address.
   */
  constructor(
    client: ExtractClient,
    ui: ExtractParts,
    states: LabStates,
    results: ExtractResults,
    onChange: () => void,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#results = results;
    this.#onChange = onChange;
    this.#undo = new UndoHistory<PageState, SavedRun>(
      client,
      () => this.#pageState(),
      (undoable, redoable) => ui.run.transport.showUndo(undoable, redoable),
    );
  }

  get params(): ParamValues {
    return this.#params;
  }

  get attractors(): Attractor[] {
    return this.#attractors;
  }

  /** The sphere, in world units, that the model began as or, if it began otherwise, the one around the crosshair. */
  get sphere(): Sphere {
    return this.#sphere ?? this.#sphereHere;
  }

  /** The sphere around the crosshair, from which a new model starts if the user chooses a sphere as initial surface. */
  get #sphereHere(): Sphere {
    return { center: this.#ui.stage.crosshair, radius: SPHERE_PART * this.#smallestSide };
  }

  /**
   * The newest saved state of model and page, to resume from after a restart of the engine; undefined if there is none.
   */
  get newest(): SavedMoment<PageState, SavedRun> | undefined {
    return this.#undo.newest;
  }

  /**
   * Returns the settings for a model of the present volume that starts as chosen, by default with the parameters and
   * attractors in force.
   */
  setup(choice: StartChoice, params = this.#params, attractors = this.#attractors): Setup {
    const { levels, edge } = choice;
    const box = choice.box === undefined ? {} : { box: this.#boxOf(choice.box) };
    return { start: this.#startShape(choice), levels, edge, params, attractors, ...box };
  }

  /**
   * Takes over the settings of a newly opened volume, whose model the worker has built, and clears the undo history.
   */
  adopt(volume: VolumeView, choice: StartChoice, params: ParamValues, { start, attractors }: Setup): void {
    this.#volume = volume;
    this.#sphere = sphereIn(start);
    // A reset takes the crosshair's.
    if (this.#sphere) this.#ui.stage.goTo(this.#sphere.center);
    this.#undo.clear();
    this.#ui.attractors.radius = ATTRACTOR_PART * this.#smallestSide;
    this.#ui.coverage.size = this.#smallestSide;
    this.#attractors = attractors;
    this.#ui.showAttractors(attractors);
    this.#adoptModel(choice, params);
  }

  /**
   * Takes over the settings of a new model of the present volume, which the worker has built, before its first step.
   */
  begin(choice: StartChoice, params: ParamValues): void {
    this.#states.idle(text('labs.readyToStart'));
    this.#adoptModel(choice, params);
  }

  /** Returns the present state and those to undo and redo, for a session; undefined if they cannot be saved. */
  moments(): Promise<ExtractMoments | undefined> {
    return this.#undo.moments();
  }

  /** Continues a session, whose volume has been adopted, and whose model the worker has restored. */
  resume(moments: ExtractMoments): void {
    this.#undo.adopt(moments);
    this.adoptMoment(moments.now);
  }

  /** Saves the present state of model and page, to return to it if the user cancels opening something else. */
  save(): void {
    void this.#undo.save();
  }

  /** Promise that settles when all pending saves of the model are complete. */
  get saved(): Promise<unknown> {
    return this.#undo.saved;
  }

  /**
   * Saves the present state before a change, so that undo can restore it; `label` names the change. Changes with the
   * same `mergeKey`, unless empty, in short succession are undone as one. Returns a function that discards the saved
   * state, to call if the change fails.
   */
  checkpoint(label: string, mergeKey = ''): () => void {
    return this.#undo.checkpoint(label, mergeKey);
  }

  /**
   * Changes to another variant of the open figure: sets its parameters, restarts the model or continues from the
   * present surface, as the figure demands, and runs it.
   */
  changeTo({ params: usual, startsOver }: Preset, { id, params: differing }: Variant): Promise<void> {
    const params = { ...usual, ...differing };
    return this.#change(text('extract.figureChange', { id }), text('labs.requestFailed'), async () => {
      if (startsOver) await this.#rebuild(this.#ui.start.inForce, params);
      else this.#take(await this.#client.request('setParams', params));
      await this.#client.request('play', undefined);
    });
  }

  /**
   * Adds components to the surface for the parts of the object that it misses, and continues the run if there were any.
   */
  seed(): Promise<void> {
    const { coverage } = this.#ui;
    return this.#change(text('extract.seeding'), text('extract.seedFailed'), async () => {
      const seeds = await this.#client.request('seed', undefined);
      coverage.say(seeds === 0 ? text('extract.nothingToSeed') : plural('extract.seeded', seeds));
      if (seeds > 0) await this.#client.request('play', undefined);
    });
  }

  /**
   * Rebuilds the model from the initial surface in force, with the parameters unchanged; the model does not run until
   * the user asks for it.
   */
  startOver(): Promise<void> {
    return this.#change(text('labs.reset'), text('labs.buildFailed'), async () => {
      await this.#rebuild(this.#ui.start.inForce, this.#params);
    });
  }

  /**
   * Rebuilds the model from the initial surface chosen on the page, and runs it. If the choice is rejected, the
   * previous model stays, and its run continues.
   */
  async restart(): Promise<void> {
    if (!this.#states.canChange) return this.#ui.start.reject(this.#why(text('extract.notWhileOpening')));
    await this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      const running = this.#states.value === 'running';
      const forget = this.checkpoint(text('extract.startChange'));
      try {
        await this.#rebuild(this.#ui.start.shown.peek(), this.#params);
        await this.#client.request('play', undefined);
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        this.#ui.start.reject(message);
        if (code === 'internal') return this.#states.fail(text('labs.buildFailed'), error);
        this.#states.restore((state) => this.#results.describe(state));
        if (running) await this.#play();
      }
    });
  }

  /** Sets a parameter of the live model; a run continues, and a converged one is resumed. */
  setParam(name: string, value: unknown): Promise<void> {
    return this.#states.enqueue(async () => {
      if (this.#states.engineBroken) return this.#refuseParam(name, BROKEN);
      if (!this.#states.canChange) return this.#onChange();
      const forget = this.checkpoint(text('labs.changeOf', { name: this.#ui.page.labelOf(name) }), name);
      try {
        this.#take(await this.#client.request('setParams', { [name]: value }));
        await this.#goOn();
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail(text('labs.requestFailed'), error);
        this.#refuseParam(name, this.#why(message));
      }
    });
  }

  /**
   * Sets the attractors of the live model; a run continues, and a converged one is resumed. `what` names the change for
   * undo; with `tuning`, changes of the same name in short succession are undone as one.
   */
  setAttractors(attractors: Attractor[], what: string, tuning: boolean): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return this.#ui.attractors.show(this.#attractors);
      const forget = this.checkpoint(what, tuning ? what : '');
      try {
        await this.#client.request('setAttractors', attractors);
        this.#attractors = attractors;
        this.#ui.stage.showAttractors(attractors);
        this.#onChange();
        await this.#goOn();
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail(text('labs.requestFailed'), error);
        this.#ui.showAttractors(this.#attractors);
        this.#ui.attractors.showError(this.#why(message));
      }
    });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      this.#states.load(way === 'undo' ? text('labs.undoing') : text('labs.redoing'));
      try {
        const moment = await this.#undo.step(way);
        if (moment) this.adoptMoment(moment);
        else this.#states.restore((state) => this.#results.describe(state));
      } catch (error) {
        this.#states.fail(text('labs.requestFailed'), error);
      }
    });
  }

  /** Restores the page to a saved state that the model has already been restored to. */
  adoptMoment({ saved, page }: SavedMoment<PageState, SavedRun>): void {
    this.#ui.start.show(page.choice);
    this.#sphere = saved.log && sphereIn(saved.log.setup.start);
    this.#attractors = page.attractors;
    this.#ui.showAttractors(page.attractors);
    this.#results.rewind(page.mark(saved.iteration));
    this.#take(page.params);
    const state = saved.done ? 'done' : 'paused';
    this.#states.idle(this.#results.describe(state), state);
    this.#showPyramid(page.choice);
  }

  /** Makes a change that undo can revert; if it fails, an error is displayed, and undo does not list it. */
  #change(label: string, errorTitle: string, work: () => Promise<void>): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      const forget = this.checkpoint(label);
      try {
        await work();
      } catch (error) {
        forget();
        this.#states.fail(errorTitle, error);
      }
    });
  }

  async #rebuild(choice: StartChoice, params: ParamValues): Promise<void> {
    this.#states.load(text('labs.resetting'));
    const setup = this.setup(choice, params);
    const ready = await this.#client.request('rebuild', setup);
    this.#sphere = sphereIn(setup.start);
    this.begin(choice, ready.params);
  }

  #adoptModel(choice: StartChoice, params: ParamValues): void {
    this.#ui.coverage.clear();
    this.#ui.start.show(choice);
    this.#results.startOver();
    this.#take(params);
    this.#showPyramid(choice);
  }

  #take(params: ParamValues): void {
    this.#params = params;
    this.#onChange();
  }

  /** Resumes a converged run: under other forces it can move on. */
  async #goOn(): Promise<void> {
    if (this.#states.modelState === 'done') await this.#play();
  }

  #play(): Promise<unknown> {
    return this.#client
      .request('play', undefined)
      .catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }

  #showPyramid({ levels }: StartChoice): void {
    if (this.#volume) void this.#results.showPyramid(this.#volume, levels);
  }

  #refuseParam(name: string, message: string): void {
    this.#onChange();
    this.#ui.refuseParam(name, message);
  }

  #why(reason: string): string {
    return this.#states.engineBroken ? BROKEN : reason;
  }

  #pageState(): PageState {
    const { inForce: choice } = this.#ui.start;
    return { choice, params: this.#params, attractors: this.#attractors, mark: this.#results.marker() };
  }

  #startShape({ kind, bubbles }: StartChoice): StartShape {
    switch (kind) {
      case 'bubbles':
        return { kind, count: bubbles };
      case 'sphere':
        return { kind, ...this.#sphereHere };
      default:
        return { kind };
    }
  }

  /** Returns the box around the crosshair with sides of a length in world units. */
  #boxOf(side: number): NonNullable<Setup['box']> {
    const [x, y, z] = this.#ui.stage.crosshair;
    const half = side / 2;
    return { min: [x - half, y - half, z - half], max: [x + half, y + half, z + half] };
  }

  /** Shortest side of the volume, in world units. */
  get #smallestSide(): number {
    const { dims = [1, 1, 1], spacing = [1, 1, 1] } = this.#volume ?? {};
    return Math.min(...dims.map((n, axis) => n * (spacing[axis] ?? 1)));
  }
}
