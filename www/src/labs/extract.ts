import { Client, RequestError, toFailure } from '../client';
import { GUIDES } from '../guides';
import type { VertexQuantity, WorkerEvent } from '../protocol';
import type { LabState } from '../state';
import { plural, text } from '../texts';
import { History } from '../ui/history';
import { labShortcuts, offerShortcuts, type Shortcut } from '../ui/shortcuts';
import type { ViewOptions } from '../ui/view-options';
import { ExtractOpening } from './extract-opening';
import { ExtractParts, type PartEvents } from './extract-parts';
import { ExtractResults } from './extract-results';
import { ExtractSettings } from './extract-settings';
import { ExtractSharing } from './extract-sharing';
import { LabStates } from './lab-states';
import type { Handoff, Lab, OpenInLab } from './labs';

/**
 * The Extract lab: a deformable surface is fitted to a volume. This class connects the lab's parts; opening, settings,
 * results and sharing are in files of their own.
 */
export class ExtractLab implements Lab {
  readonly #root: HTMLElement;
  /** Aborted when the lab is closed, which removes all event listeners. */
  readonly #closing = new AbortController();
  readonly #client = new Client((event) => this.#onEvent(event));
  readonly #ui: ExtractParts;
  readonly #states: LabStates;
  readonly #results: ExtractResults;
  readonly #settings: ExtractSettings;
  readonly #opening: ExtractOpening;
  readonly #sharing: ExtractSharing;
  readonly #passOn: OpenInLab;
  /** Quantity that the worker computes at each vertex to colour the surface by; undefined if none is needed. */
  #quantity: VertexQuantity | undefined;

  constructor(root: HTMLElement, help: HTMLElement, passOn: OpenInLab) {
    this.#root = root;
    this.#passOn = passOn;
    const { signal } = this.#closing;
    const client = this.#client;
    const history = new History();
    const ui = new ExtractParts(
      root,
      history,
      (format) => client.request('export', { format }),
      signal,
      this.#events(),
    );
    const states = new LabStates(ui.banner, ui.status, signal);
    this.#ui = ui;
    this.#states = states;
    this.#results = new ExtractResults(client, ui, states, history);
    this.#settings = new ExtractSettings(client, ui, states, this.#results, () => this.#showSettings());
    this.#opening = new ExtractOpening(client, ui, states, this.#settings, this.#results, () =>
      client.request('quantity', this.#quantity),
    );
    this.#sharing = new ExtractSharing(client, ui, states, this.#settings, this.#opening);
    states.subscribe((state) => this.#showState(state));
    offerShortcuts(this.#shortcuts(), help, GUIDES.extract, signal);
  }

  /** Opens what another lab passes on, or what the address asks for, or else the first example, and runs it. */
  async start(passedOn?: Handoff): Promise<void> {
    if (!passedOn) ExtractOpening.fetchLinked();
    const open = passedOn && (() => this.#opening.passedOn(passedOn));
    await this.#opening.start(this.#closing.signal, () => this.#sharing.updateAddress(), open);
  }

  close(): void {
    this.#closing.abort();
    this.#opening.close();
    this.#client.close();
    this.#results.close();
    this.#ui.dispose();
    this.#root.replaceChildren();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      onFiles: (files) => void this.#opening.files(files),
      onLarge: (name, source) => void this.#opening.large(name, source),
      onExample: (example) => void this.#opening.example(example),
      onExampleId: (id) => this.#opening.byId(id),
      onVariant: (preset, variant) => void this.#settings.changeTo(preset, variant),
      onStart: () => void this.#settings.restart(),
      onParam: (name, value) => void this.#settings.setParam(name, value),
      onAttractors: (attractors, what, tuning) => void this.#settings.setAttractors(attractors, what, tuning),
      onOptions: (options) => this.#setOptions(options),
      onPlanes: (planes) => {
        if (!this.#states.engineBroken) this.#ask(this.#client.request('planes', planes));
      },
      onCompare: () => void this.#compare(),
      onCancelCompare: () => this.#ask(this.#client.request('cancelCompare', undefined)),
      onCoverage: () => void this.#measureCoverage(),
      onCancelCoverage: () => this.#ask(this.#client.request('cancelCoverage', undefined)),
      onSeed: () => void this.#settings.seed(),
      onSculpt: () => this.#sharing.toSculpt(this.#passOn),
      onCancel: () => void this.#opening.cancel(),
      onToggle: () => this.#toggle(),
      onStep: (steps) => this.#step(steps),
      onReset: () => void this.#reset(),
      onUndo: () => void this.#settings.travel('undo'),
      onRedo: () => void this.#settings.travel('redo'),
      onDismiss: () => this.#dismiss(),
      onCopyLink: () => void this.#sharing.copyLink(),
      onError: (title, error) => this.#states.fail(title, error),
    };
  }

  #shortcuts(): Shortcut[] {
    const attract = () => this.#ui.attractors.add(this.#ui.stage.crosshair);
    return [
      ...labShortcuts(this.#events(), [{ key: 'a', shown: 'a', text: text('extract.attractorKey'), act: attract }]),
      { key: 'Escape', shown: text('labs.keyEscape'), text: text('labs.dismissKey'), act: () => this.#dismiss() },
    ];
  }

  #showSettings(): void {
    this.#ui.showParams(this.#settings.params, this.#opening.source?.example);
    this.#sharing.updateAddress();
  }

  #setOptions({ color }: ViewOptions): void {
    const quantity = color === 'plain' || color === 'component' ? undefined : color;
    if (quantity !== this.#quantity) this.#ask(this.#client.request('quantity', quantity));
    this.#quantity = quantity;
    this.#sharing.updateAddress();
  }

  #toggle(): void {
    const running = this.#states.value === 'running';
    if (!running && !this.#states.canRun) return;
    this.#ui.banner.hide();
    if (!running) this.#settings.checkpoint(text('labs.play'));
    this.#ask(this.#client.request(running ? 'pause' : 'play', undefined));
  }

  #step(steps: number): void {
    if (!this.#states.canRun) return;
    this.#ui.banner.hide();
    this.#settings.checkpoint(plural('counts.step', steps));
    this.#ask(this.#client.request('step', { count: steps }));
  }

  async #reset(): Promise<void> {
    const { ready, engineBroken, value } = this.#states;
    if (!ready || value === 'loading') return;
    await (engineBroken ? this.#opening.reopen() : this.#settings.startOver());
  }

  /**
   * Runs the extraction twice, direct and coarse to fine, both without attractors, and shows the comparison of the two
   * runs.
   */
  async #compare(): Promise<void> {
    if (!this.#states.canChange) return;
    const { compare, start } = this.#ui;
    if (start.value.levels === 0) return compare.reject(text('extract.compareNeedsLevel'));
    compare.begin();
    try {
      const setup = this.#settings.setup(start.value, this.#settings.params, []);
      compare.finish(await this.#client.request('compare', setup));
    } catch (error) {
      compare.reject(text('extract.compareFailed', { message: toFailure(error).message }));
    }
  }

  async #measureCoverage(): Promise<void> {
    const { coverage } = this.#ui;
    coverage.begin();
    try {
      coverage.finish(await this.#client.request('coverage', undefined));
    } catch (error) {
      coverage.say(text('extract.coverageFailed', { message: toFailure(error).message }));
    }
  }

  /** Shows an error message if a request fails, without waiting for the reply. */
  #ask(request: Promise<unknown>): void {
    request.catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }

  #onEvent(event: WorkerEvent): void {
    if (event.event === 'failure') this.#states.fail(text('labs.runFailed'), new RequestError(event.failure));
    else if (event.event === 'comparing') this.#ui.compare.showProgress(event);
    else if (event.event === 'data') this.#ui.large.showProgress(event);
    else if (event.event === 'covering') this.#ui.coverage.showProgress(event);
    else if (event.event !== 'state') this.#results.take(event);
    else if (this.#states.setModelState(event.state)) this.#results.showState(event.state);
  }

  #showState(state: LabState): void {
    const { modelState, ready } = this.#states;
    this.#ui.showState(state, modelState, ready);
    if (state === 'done' || state === 'paused') this.#sharing.updateAddress();
  }

  #dismiss(): void {
    if (this.#states.dismiss()) this.#ui.status.say(this.#results.describe(this.#states.value));
  }
}
