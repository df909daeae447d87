import { toFailure } from '../../engine/failure';
import type { VertexQuantity } from '../../engine/protocol';
import { History } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { Lab, LabPlace } from '../../lab/lab';
import { Opening } from '../../lab/opening';
import { type RunningLab, Runs } from '../../lab/runs';
import { LabShell } from '../../lab/shell';
import { LabStates } from '../../lab/states';
import { text } from '../../texts';
import { connectExtract } from './client';
import { ExtractData, type ExtractOpening, type ExtractSource, fetchLinked, frameOf } from './data';
import type { Example } from './examples';
import { linkOf, MOST_ATTRACTORS, toHash } from './link';
import { ExtractParts, type PartEvents } from './parts';
import type { WorkerEvent } from './protocol';
import { ExtractResults } from './results';
import { ExtractSettings } from './settings';
import type { ExtractViewOptions } from './view';

/** The Extract lab: a deformable surface is fitted to a volume. Data, settings and results are in files of their own. */
class ExtractLab implements RunningLab<Example> {
  readonly shell: LabShell<Example>;
  readonly #runs: Runs<Example>;

  readonly id = 'extract';
  readonly client = connectExtract((event) => this.#onEvent(event));
  readonly ui: ExtractParts;
  readonly states: LabStates;
  readonly opening: ExtractOpening;
  readonly #data: ExtractData;
  readonly #results: ExtractResults;
  readonly #settings: ExtractSettings;
  /** Quantity that the worker computes at each vertex to colour the surface by; undefined if none is needed. */
  #quantity: VertexQuantity | undefined;

  constructor(place: LabPlace) {
    const shell = new LabShell(place, this);
    const runs = new Runs(shell, this);
    this.shell = shell;
    this.#runs = runs;
    const { client } = this;
    const { root, signal } = shell;
    const history = new History();
    const ui = new ExtractParts(root, history, client, signal, this.#events());
    const states = new LabStates(ui.page.banner, ui.page.status, signal);
    this.ui = ui;
    this.states = states;
    this.#results = new ExtractResults(client, ui, states, history);
    this.#settings = new ExtractSettings(client, ui, states, this.#results, () => this.#showSettings());
    this.#data = new ExtractData(client, ui, states, this.#settings, this.#results, () =>
      client.request('quantity', this.#quantity),
    );
    this.opening = new Opening(client, ui.page, states, this.#data);
    const attract = () => ui.attractors.add(ui.stage.crosshair);
    runs.begin([{ key: 'a', shown: 'a', text: text('extract.attractorKey'), act: attract }]);
  }

  starting(): void {
    fetchLinked();
  }

  closed(): void {
    this.#results.close();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      ...this.#runs.events(),
      onLarge: (name, source) => {
        this.shell.forgetSession();
        void this.opening.open({ name, load: async () => source });
      },
      onFrame: (frame) => this.#openFrame(frame),
      onVariant: (preset, variant) => void this.#settings.changeTo(preset, variant),
      onStart: () => void this.#settings.restart(),
      onParam: (name, value) => void this.#settings.setParam(name, value),
      onAttractors: (attractors, what, tuning) => void this.#settings.setAttractors(attractors, what, tuning),
      onOptions: (options) => this.#setOptions(options),
      onPlanes: (planes) => {
        if (!this.states.engineBroken) this.shell.ask(this.client.request('planes', planes));
      },
      onCompare: () => void this.#compare(),
      onCancelCompare: () => this.shell.ask(this.client.request('cancelCompare', undefined)),
      onCoverage: () => void this.#measureCoverage(),
      onCancelCoverage: () => this.shell.ask(this.client.request('cancelCoverage', undefined)),
      onSeed: () => void this.#settings.seed(),
      onSegment: () => this.shell.ask(this.#toSegment()),
      onSculpt: () => this.#runs.toSculpt(this.ui.run.surfaceFile({ format: 'ply' })),
    };
  }

  #openFrame(frame: number): void {
    const { source } = this.opening;
    if (source) void this.opening.open(this.#data.atFrame(source, frame));
  }

  /** Opens the volume's file in the Segment lab. */
  async #toSegment(): Promise<void> {
    const { source } = this.opening;
    const [file] = source ? this.opening.filesOf(await source.load()) : [];
    if (file) this.shell.passOn({ lab: 'segment', ...file, params: {} });
  }

  async sessionContent(): Promise<Record<string, unknown> | undefined> {
    const moments = await this.#runs.paused(() => this.#settings.moments());
    if (!moments) return undefined;
    const view = { ...this.ui.stage.view, options: this.ui.options.value };
    return { ...(await import('../../lab/session/moments')).packMoments(moments), view };
  }

  linkLacks(): (string | false)[] {
    return [this.#settings.attractors.length > MOST_ATTRACTORS && text('extract.linkLacksAttractors')];
  }

  #showSettings(): void {
    this.ui.showParams(this.#settings.params, this.opening.source?.example);
    this.shell.updateAddress();
  }

  #setOptions({ color }: ExtractViewOptions): void {
    const quantity = color === 'plain' || color === 'component' ? undefined : color;
    if (quantity !== this.#quantity) this.shell.ask(this.client.request('quantity', quantity));
    this.#quantity = quantity;
    this.shell.updateAddress();
  }

  address(source: ExtractSource): string {
    const { example, name: file } = source;
    const { params, sphere, attractors } = this.#settings;
    const { defaults } = this.#data;
    const choice = this.ui.start.inForce;
    return toHash(
      linkOf({
        example,
        file,
        frame: frameOf(source),
        choice,
        sphere,
        params,
        defaults,
        attractors,
        view: this.ui.options.value,
      }),
    );
  }

  beforeRun(change: string): void {
    this.#settings.checkpoint(change);
  }

  startOver(): Promise<void> {
    return this.#settings.startOver();
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#settings.travel(way);
  }

  /**
   * Runs the extraction twice, direct and coarse to fine, both without attractors, and shows the comparison of the two
   * runs.
   */
  async #compare(): Promise<void> {
    if (!this.states.canChange) return;
    const { compare, start } = this.ui;
    if (start.shown.peek().levels === 0) return compare.reject(text('extract.compareNeedsLevel'));
    compare.begin();
    try {
      const setup = this.#settings.setup(start.shown.peek(), this.#settings.params, []);
      compare.finish(await this.client.request('compare', setup));
    } catch (error) {
      compare.reject(text('extract.compareFailed', { message: toFailure(error).message }));
    }
  }

  async #measureCoverage(): Promise<void> {
    const { coverage } = this.ui;
    coverage.begin();
    try {
      coverage.finish(await this.client.request('coverage', undefined));
    } catch (error) {
      coverage.say(text('extract.coverageFailed', { message: toFailure(error).message }));
    }
  }

  #onEvent(event: WorkerEvent): void {
    if (event.event === 'state' && event.measures) this.ui.measures.showMeasures(event.measures);
    if (this.#runs.takes(event)) return;
    if (event.event === 'comparing') this.ui.compare.showProgress(event);
    else if (event.event === 'data') this.ui.large.showProgress(event);
    else if (event.event === 'covering') this.ui.coverage.showProgress(event);
    else this.#results.take(event);
  }

  settled(state: LabState): void {
    this.#results.showState(state);
  }

  showControls(state: LabState): void {
    this.ui.showState(state, this.states.modelState, this.states.ready);
  }

  describe(): string {
    return this.#results.describe(this.states.value);
  }
}

/** Makes the Extract lab. */
export const makeExtract = (place: LabPlace): Lab => new ExtractLab(place).shell;
