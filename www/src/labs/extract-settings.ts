import { type Client, toFailure } from '../client';
import type { Preset, Variant } from '../presets';
import type { Attractor, ParamValues, SavedRun, Setup, StartShape, Vec3, VolumeView } from '../protocol';
import { plural } from '../ui/format';
import type { HistoryMark } from '../ui/history';
import type { StartChoice } from '../ui/start';
import type { ExtractParts } from './extract-parts';
import type { ExtractResults } from './extract-results';
import type { LabStates } from './lab-states';
import { type Moment, Rewinder } from './rewinder';

/** Radius of the sphere placed at the crosshair, as a part of the volume's smallest side. */
const SPHERE_PART = 0.1;
/** Reach of a new attractor in the same measure. */
const ATTRACTOR_PART = 0.15;

const BROKEN = 'The engine has stopped; Reset starts it again.';

/** What the page holds beside the model, and undo brings back. */
interface PageState {
  choice: StartChoice;
  params: ParamValues;
  attractors: Attractor[];
  /** What had happened, up to whatever iteration the model was saved at. */
  mark: (iteration: number) => HistoryMark;
}

/** What a model is started from and with: changed here, handed to the worker, undone. */
export class ExtractSettings {
  readonly #client: Client;
  readonly #ui: ExtractParts;
  readonly #states: LabStates;
  readonly #results: ExtractResults;
  readonly #onChange: () => void;
  readonly #rewinder: Rewinder<PageState, SavedRun>;
  #volume: VolumeView | undefined;
  /** Those in force; they outlive a reset. */
  #params: ParamValues = {};
  /** Those the model has; the list may hold one that is being asked for. */
  #attractors: Attractor[] = [];

  /** `onChange` hears whenever something else may be in force. */
  constructor(client: Client, ui: ExtractParts, states: LabStates, results: ExtractResults, onChange: () => void) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#results = results;
    this.#onChange = onChange;
    this.#rewinder = new Rewinder<PageState, SavedRun>(
      client,
      () => this.#pageState(),
      (undoable, redoable) => ui.transport.showUndo(undoable, redoable),
    );
  }

  get params(): ParamValues {
    return this.#params;
  }

  get attractors(): Attractor[] {
    return this.#attractors;
  }

  /** Where the sphere would be that the model may start from. */
  get sphere(): { center: Vec3; radius: number } {
    return { center: this.#ui.stage.crosshair, radius: SPHERE_PART * this.#smallestSide };
  }

  /** Where to go on when the engine was started again. */
  get newest(): Moment<PageState, SavedRun> | undefined {
    return this.#rewinder.newest;
  }

  /** What a model of the present volume is made with. */
  setup(choice: StartChoice, params = this.#params, attractors = this.#attractors): Setup {
    const { levels, edge } = choice;
    return { start: this.#startShape(choice), levels, edge, params, attractors };
  }

  /** Another volume, and a model of it that has not begun: what was done to the former cannot be undone. */
  adopt(volume: VolumeView, choice: StartChoice, params: ParamValues, attractors: Attractor[]): void {
    this.#volume = volume;
    this.#rewinder.clear();
    this.#ui.attractors.radius = ATTRACTOR_PART * this.#smallestSide;
    this.#attractors = attractors;
    this.#ui.showAttractors(attractors);
    this.#adoptModel(choice, params);
  }

  /** A model of the present volume that has not begun, after the engine was started again. */
  begin(choice: StartChoice, params: ParamValues): void {
    this.#states.stand('Ready to start.');
    this.#adoptModel(choice, params);
  }

  /** Keeps what is, in case that opening something else has to be cancelled. */
  keep(): void {
    void this.#rewinder.keep();
  }

  /** Settled when all that was to be kept is. */
  get kept(): Promise<unknown> {
    return this.#rewinder.kept;
  }

  /** Keeps what is, before it is changed. */
  remember(label: string, together = ''): () => void {
    return this.#rewinder.remember(label, together);
  }

  /** Another picture of the figure that is open: other parameters, from the same start or from where the surface is. */
  changeTo({ params: usual, startsOver }: Preset, { id, params: differing }: Variant): Promise<void> {
    const params = { ...usual, ...differing };
    return this.#change(`figure ${id}`, 'That did not work.', async () => {
      if (startsOver) await this.#rebuild(this.#ui.start.inForce, params);
      else this.#take(await this.#client.request('setParams', params));
      await this.#client.request('play', undefined);
    });
  }

  /** Adds what the surface leaves out, and runs on where there was something. */
  seed(): Promise<void> {
    const { coverage } = this.#ui;
    return this.#change('seeding', 'Missing parts could not be seeded.', async () => {
      const seeds = await this.#client.request('seed', undefined);
      coverage.say(seeds === 0 ? 'Nothing to seed on this level.' : `${plural(seeds, 'part')} seeded.`);
      if (seeds > 0) await this.#client.request('play', undefined);
    });
  }

  /** The model from its start, with the parameters as they are. */
  startOver(): Promise<void> {
    return this.#change('Reset', 'The model could not be built.', async () => {
      await this.#rebuild(this.#ui.start.inForce, this.#params);
    });
  }

  /** Starts over from the start that is chosen, and plays. When it is refused, the model that was there goes on. */
  async restart(): Promise<void> {
    if (!this.#states.canChange) return this.#ui.start.refuse(this.#why('Not while a volume is opened.'));
    await this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      const running = this.#states.value === 'running';
      const forget = this.remember('another start');
      try {
        await this.#rebuild(this.#ui.start.value, this.#params);
        await this.#client.request('play', undefined);
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        this.#ui.start.refuse(message);
        if (code === 'internal') return this.#states.fail('The model could not be built.', error);
        this.#states.back((state) => this.#results.describe(state));
        if (running) this.#play();
      }
    });
  }

  /** Live: the run goes on, or is taken up again, with the new value. */
  setParam(name: string, value: unknown): Promise<void> {
    return this.#states.inTurn(async () => {
      if (this.#states.engineBroken) return this.#refuseParam(name, BROKEN);
      if (!this.#states.canChange) return this.#onChange();
      const forget = this.remember(`change of ${this.#ui.labelOf(name)}`, name);
      try {
        this.#take(await this.#client.request('setParams', { [name]: value }));
        this.#goOn();
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail('That did not work.', error);
        this.#refuseParam(name, this.#why(message));
      }
    });
  }

  /** Live, too. The same `what` again soon after belongs to it where it is `tuning`. */
  setAttractors(attractors: Attractor[], what: string, tuning: boolean): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return this.#ui.attractors.show(this.#attractors);
      const forget = this.remember(what, tuning ? what : '');
      try {
        await this.#client.request('setAttractors', attractors);
        this.#attractors = attractors;
        this.#ui.stage.showAttractors(attractors);
        this.#onChange();
        this.#goOn();
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail('That did not work.', error);
        this.#ui.showAttractors(this.#attractors);
        this.#ui.attractors.complain(this.#why(message));
      }
    });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      this.#states.load(way === 'undo' ? 'Going back.' : 'Going forth again.');
      try {
        const moment = await this.#rewinder.travel(way);
        if (moment) this.adoptMoment(moment);
        else this.#states.back((state) => this.#results.describe(state));
      } catch (error) {
        this.#states.fail('That did not work.', error);
      }
    });
  }

  /** The page as it was at that moment; the model is there already. */
  adoptMoment({ saved, page }: Moment<PageState, SavedRun>): void {
    this.#ui.start.show(page.choice);
    this.#attractors = page.attractors;
    this.#ui.showAttractors(page.attractors);
    this.#results.rewind(page.mark(saved.iteration));
    this.#take(page.params);
    const state = saved.done ? 'done' : 'paused';
    this.#states.stand(this.#results.describe(state), state);
    this.#showPyramid(page.choice);
  }

  /** What does to the model what `label` says; when it fails, what was there stays. */
  #change(label: string, complaint: string, work: () => Promise<void>): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      const forget = this.remember(label);
      try {
        await work();
      } catch (error) {
        forget();
        this.#states.fail(complaint, error);
      }
    });
  }

  async #rebuild(choice: StartChoice, params: ParamValues): Promise<void> {
    this.#states.load('Starting over.');
    const ready = await this.#client.request('rebuild', this.setup(choice, params));
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

  /** A model that had settled has further to go under other forces. */
  #goOn(): void {
    if (this.#states.beneath === 'done') this.#play();
  }

  #play(): void {
    this.#client.request('play', undefined).catch((error) => this.#states.fail('That did not work.', error));
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
        return { kind, ...this.sphere };
      default:
        return { kind };
    }
  }

  /** Of the volume, in world units. */
  get #smallestSide(): number {
    const { dims = [1, 1, 1], spacing = [1, 1, 1] } = this.#volume ?? {};
    return Math.min(...dims.map((n, axis) => n * (spacing[axis] ?? 1)));
  }
}
