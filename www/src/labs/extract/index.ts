import type { VertexQuantity } from '../../engine/protocol';
import { History } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { ViewOptions } from '../../kit/view-options';
import type { Handoff, OpenInLab } from '../../lab/lab';
import { RunLab } from '../../lab/shell';
import { LabStates } from '../../lab/states';
import { text } from '../../texts';
import { Client, toFailure } from './client';
import type { Example } from './examples';
import { linkOf, MOST_ATTRACTORS, toHash } from './link';
import { ExtractOpening, type ExtractSource, frameOf } from './opening';
import { ExtractParts, type PartEvents } from './parts';
import type { WorkerEvent } from './protocol';
import { ExtractResults } from './results';
import { ExtractSettings } from './settings';

/** The Extract lab: a deformable surface is fitted to a volume. Opening, settings and results are in files of their own. */
export class ExtractLab extends RunLab<Example> {
  protected readonly id = 'extract';
  protected readonly client = new Client((event) => this.#onEvent(event));
  protected readonly ui: ExtractParts;
  protected readonly states: LabStates;
  protected readonly opening: ExtractOpening;
  readonly #results: ExtractResults;
  readonly #settings: ExtractSettings;
  /** Quantity that the worker computes at each vertex to colour the surface by; undefined if none is needed. */
  #quantity: VertexQuantity | undefined;

  constructor(root: HTMLElement, help: HTMLElement, passOn: OpenInLab) {
    super(root, help, passOn);
    const { client } = this;
    const { signal } = this.closing;
    const history = new History();
    const ui = new ExtractParts(root, history, (request) => client.request('export', request), signal, this.#events());
    const states = new LabStates(ui.banner, ui.status, signal);
    this.ui = ui;
    this.states = states;
    this.#results = new ExtractResults(client, ui, states, history);
    this.#settings = new ExtractSettings(client, ui, states, this.#results, () => this.#showSettings());
    this.opening = new ExtractOpening(client, ui, states, this.#settings, this.#results, () =>
      client.request('quantity', this.#quantity),
    );
    const attract = () => ui.attractors.add(ui.stage.crosshair);
    this.beginRuns([{ key: 'a', shown: 'a', text: text('extract.attractorKey'), act: attract }]);
  }

  override async start(passedOn?: Handoff): Promise<void> {
    if (!passedOn) ExtractOpening.fetchLinked();
    await super.start(passedOn);
  }

  protected override closed(): void {
    this.#results.close();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      ...this.runEvents(),
      onLarge: (name, source) => {
        this.forgetSession();
        void this.opening.large(name, source);
      },
      onFrame: (frame) => void this.opening.frame(frame),
      onVariant: (preset, variant) => void this.#settings.changeTo(preset, variant),
      onStart: () => void this.#settings.restart(),
      onParam: (name, value) => void this.#settings.setParam(name, value),
      onAttractors: (attractors, what, tuning) => void this.#settings.setAttractors(attractors, what, tuning),
      onOptions: (options) => this.#setOptions(options),
      onPlanes: (planes) => {
        if (!this.states.engineBroken) this.ask(this.client.request('planes', planes));
      },
      onCompare: () => void this.#compare(),
      onCancelCompare: () => this.ask(this.client.request('cancelCompare', undefined)),
      onCoverage: () => void this.#measureCoverage(),
      onCancelCoverage: () => this.ask(this.client.request('cancelCoverage', undefined)),
      onSeed: () => void this.#settings.seed(),
      onSegment: () => this.ask(this.#toSegment()),
      onSculpt: () => this.toSculpt(this.ui.surfaceFile({ format: 'ply' })),
    };
  }

  /** Opens the volume's file in the Segment lab. */
  async #toSegment(): Promise<void> {
    const { source } = this.opening;
    const [file] = source ? this.opening.filesOf(await source.load()) : [];
    if (file) this.passOn({ lab: 'segment', ...file, params: {} });
  }

  protected override async sessionContent(): Promise<Record<string, unknown> | undefined> {
    const moments = await this.paused(() => this.#settings.moments());
    if (!moments) return undefined;
    const view = { ...this.ui.stage.view, options: this.ui.options.value };
    return { ...(await import('../../lab/session/moments')).packMoments(moments), view };
  }

  protected override linkLacks(): (string | false)[] {
    return [this.#settings.attractors.length > MOST_ATTRACTORS && text('extract.linkLacksAttractors')];
  }

  #showSettings(): void {
    this.ui.showParams(this.#settings.params, this.opening.source?.example);
    this.updateAddress();
  }

  #setOptions({ color }: ViewOptions): void {
    const quantity = color === 'plain' || color === 'component' ? undefined : color;
    if (quantity !== this.#quantity) this.ask(this.client.request('quantity', quantity));
    this.#quantity = quantity;
    this.updateAddress();
  }

  protected address(source: ExtractSource): string {
    const { example, name: file } = source;
    const { params, sphere, attractors } = this.#settings;
    const { defaults } = this.opening;
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
        color: this.ui.options.value.color,
      }),
    );
  }

  protected override beforeRun(change: string): void {
    this.#settings.checkpoint(change);
  }

  protected startOver(): Promise<void> {
    return this.#settings.startOver();
  }

  protected travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#settings.travel(way);
  }

  /**
   * Runs the extraction twice, direct and coarse to fine, both without attractors, and shows the comparison of the two
   * runs.
   */
  async #compare(): Promise<void> {
    if (!this.states.canChange) return;
    const { compare, start } = this.ui;
    if (start.value.levels === 0) return compare.reject(text('extract.compareNeedsLevel'));
    compare.begin();
    try {
      const setup = this.#settings.setup(start.value, this.#settings.params, []);
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
    if (this.takes(event)) return;
    if (event.event === 'comparing') this.ui.compare.showProgress(event);
    else if (event.event === 'data') this.ui.large.showProgress(event);
    else if (event.event === 'covering') this.ui.coverage.showProgress(event);
    else this.#results.take(event);
  }

  protected settled(state: LabState): void {
    this.#results.showState(state);
  }

  protected showControls(state: LabState): void {
    this.ui.showState(state, this.states.modelState, this.states.ready);
  }

  protected describe(): string {
    return this.#results.describe(this.states.value);
  }
}
