import { RequestError } from '../channel';
import { GUIDES } from '../guides';
import { SculptClient } from '../sculpt/client';
import { lastFrame } from '../sculpt/film';
import { isSculptPreset, type SculptPreset, type SculptVariant, variantInForce } from '../sculpt/presets';
import type {
  FrameContents,
  FrameEvent,
  OpenedScene,
  ParamValues,
  SculptQuantity,
  WorkerEvent,
} from '../sculpt/protocol';
import type { LabState } from '../state';
import { plural, text } from '../texts';
import { prefersReducedMotion } from '../ui/dom';
import { History } from '../ui/history';
import { labShortcuts, offerShortcuts, type Shortcut } from '../ui/shortcuts';
import type { SculptViewOptions } from '../view/sculpture';
import { copyAddress, FILE_NOTE, showAddress } from './address';
import { LabStates } from './lab-states';
import type { Handoff, Lab } from './labs';
import { Filming } from './sculpt-filming';
import { filmOf, linkOf, toHash } from './sculpt-link';
import { SculptOpening, type SculptSource } from './sculpt-opening';
import { type PartEvents, SculptParts } from './sculpt-parts';
import { Posing } from './sculpt-posing';
import { SculptResults } from './sculpt-results';
import { SculptSettings } from './sculpt-settings';

/** The colourings of the surface for which the worker has to compute values at the vertices. */
const QUANTITIES: readonly string[] = [
  'area distortion',
  'angle distortion',
  'mean curvature',
] satisfies SculptQuantity[];

/**
 * The Sculpt lab: a detailed surface is deformed by ellipsoids. This class connects the lab's parts; opening, settings,
 * posing, filming and results are in files of their own.
 */
export class SculptLab implements Lab {
  readonly #root: HTMLElement;
  readonly #closing = new AbortController();
  readonly #client = new SculptClient((event) => this.#onEvent(event));
  readonly #ui: SculptParts;
  readonly #states: LabStates;
  readonly #results: SculptResults;
  readonly #settings: SculptSettings;
  readonly #posing: Posing;
  readonly #filming: Filming;
  readonly #opening: SculptOpening;
  /**
   * Parameters that the scene opened with, including the model's own choices, but without changes by a link, which
   * contains only parameters that differ from these.
   */
  #usual: ParamValues = {};
  #shown: FrameContents = { layout: 'result', quantity: undefined, textured: false };

  constructor(root: HTMLElement, help: HTMLElement) {
    this.#root = root;
    const { signal } = this.#closing;
    const client = this.#client;
    const history = new History();
    const ui = new SculptParts(root, history, client, signal, this.#events());
    const states = new LabStates(ui.banner, ui.status, signal);
    this.#ui = ui;
    this.#states = states;
    this.#results = new SculptResults(client, ui, states, history, (frame) => this.#follow(frame));
    this.#settings = new SculptSettings(client, ui, states, history, () => this.#showSettings());
    this.#posing = new Posing(ui, this.#settings);
    this.#filming = new Filming(client, ui, states, this.#settings);
    this.#opening = new SculptOpening(client, ui, states, (opened, source) => this.#adopt(opened, source));
    states.subscribe((state) => this.#showState(state));
    offerShortcuts(this.#shortcuts(), help, GUIDES.sculpt, signal);
  }

  /** Opens what another lab passes on, or what the address asks for, or else the first example, and runs it. */
  async start(passedOn?: Handoff): Promise<void> {
    const open = passedOn && (() => this.#opening.bytes(passedOn.name, passedOn.bytes));
    await this.#opening.start(this.#closing.signal, () => this.#updateAddress(), open);
  }

  close(): void {
    this.#closing.abort();
    this.#posing.close();
    this.#opening.close();
    this.#client.close();
    this.#ui.dispose();
    this.#root.replaceChildren();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      onFiles: (files) => void this.#opening.files(files),
      onExample: (example) => void this.#opening.example(example),
      onExampleId: (id) => this.#opening.byId(id),
      onVariant: (preset, variant) => this.#openVariant(preset, variant),
      onChoose: (index) => this.#settings.choose(index),
      onMode: (mode) => {
        this.#posing.mode = mode;
      },
      onChange: (ellipsoid, what) => this.#posing.change(ellipsoid, what),
      onAdd: () => this.#posing.add(),
      onRemove: () => this.#posing.remove(),
      onAddKey: () => this.#filming.addKey(),
      onRemoveKey: (index) => this.#filming.removeKey(index),
      onBetween: (frames) => this.#filming.setBetween(frames),
      onLoop: (loop) => this.#filming.setLoop(loop),
      onSeek: (frame) => this.#filming.seek(frame),
      onRecord: () => void this.#filming.record(),
      onCancelRecord: () => void this.#client.request('cancelRecord', undefined),
      onParam: (name, value) => void this.#settings.setParams({ [name]: value }, this.#ui.labelOf(name)),
      onOptions: (options) => this.#setOptions(options),
      onCancel: () => void this.#opening.cancel(),
      onToggle: () => this.#toggle(),
      onStep: (steps) => this.#step(steps),
      onReset: () => void this.#reset(),
      onUndo: () => void this.#settings.travel('undo'),
      onRedo: () => void this.#settings.travel('redo'),
      onDismiss: () => this.#dismiss(),
      onCopyLink: () => void this.#copyLink(),
      onError: (title, error) => this.#states.fail(title, error),
    };
  }

  #shortcuts(): Shortcut[] {
    return [
      ...labShortcuts(this.#events(), [
        { key: 'k', shown: 'k', text: text('sculpt.addKeyframeKey'), act: () => this.#filming.addKey() },
      ]),
      {
        key: 'Escape',
        shown: text('labs.keyEscape'),
        text: text('sculpt.dismissKey'),
        act: () => this.#escape(),
      },
    ];
  }

  /**
   * Displays a newly opened scene, with the settings of its example or link. Plays its film; without a film, with a
   * pose from a link, or if the film loops and the user prefers reduced motion, the surface only settles in the pose.
   */
  async #adopt(opened: OpenedScene, { name, example, linked }: SculptSource): Promise<void> {
    this.#states.ready = true;
    this.#usual = { ...opened.params };
    for (const [name, value] of Object.entries(linked?.params ?? {}))
      if (example?.params[name] === undefined) delete this.#usual[name];
      else if (Object.is(opened.params[name], value)) this.#usual[name] = example.params[name];
    this.#results.clear();
    this.#ui.adopt(opened, example, name);
    const film = filmOf(linked ?? { params: {} }, example?.film);
    const { pose, params } = opened;
    this.#settings.adopt({ pose, names: example?.names ?? [], posed: linked?.pose !== undefined, film, params });
    const color = (linked?.color ?? example?.color ?? 'plain') as SculptViewOptions['color'];
    const layout = (linked?.layout ?? example?.layout ?? 'result') as SculptViewOptions['layout'];
    const preset = isSculptPreset(example) ? example : undefined;
    this.#ui.options.staged = preset?.stages !== undefined;
    this.#ui.options.set({
      color,
      layout: layout === 'stages' && !preset?.stages ? 'result' : layout,
      edges: false,
      ellipsoids: true,
      ...preset?.view,
    });
    if (preset?.stages) this.#results.showStages(preset.stages);
    await this.#settings.setFilm(film, 0);
    await this.#client.request('show', this.#shown);
    const endless = film?.loop === true && prefersReducedMotion();
    await this.#client.request(film && !linked?.pose && !endless ? 'play' : 'settle', undefined);
  }

  #openVariant(preset: SculptPreset, { name, params, pose }: SculptVariant): void {
    const values = { ...this.#usual, ...params };
    const differs = Object.entries(values).some(([key, value]) => !Object.is(this.#settings.params[key], value));
    if (differs) void this.#settings.setParams(values, text('labs.figureChange', { name }));
    this.#settings.checkpoint(text('labs.figureChange', { name }));
    this.#settings.send(pose ?? preset.start ?? this.#settings.pose, false);
  }

  #follow(frame: FrameEvent): void {
    this.#settings.follow(frame, this.#states.modelState === 'running');
  }

  #showSettings(): void {
    const { params, pose } = this.#settings;
    const example = this.#opening.source?.example;
    const preset = isSculptPreset(example) ? example : undefined;
    this.#ui.showParams(params, preset, preset && variantInForce(preset, pose, params, this.#usual));
    this.#ui.showState(this.#states.modelState, this.#states.ready, this.#canPlay);
    this.#updateAddress();
  }

  get #canPlay(): boolean {
    const { film } = this.#settings;
    return film !== undefined && lastFrame(film) > 0;
  }

  #setOptions({ layout, color }: SculptViewOptions): void {
    const quantity = QUANTITIES.includes(color) ? (color as SculptQuantity) : undefined;
    const textured = color === 'texture';
    const before = this.#shown;
    const changed = layout !== before.layout || quantity !== before.quantity || textured !== before.textured;
    this.#shown = { layout, quantity, textured };
    if (!this.#states.ready) return;
    if (changed) this.#ask(this.#client.request('show', this.#shown));
    this.#results.showOriginals();
    this.#updateAddress();
  }

  #toggle(): void {
    const { value, canChange } = this.#states;
    if (!canChange) return;
    this.#ui.banner.hide();
    if (value === 'running') this.#ask(this.#client.request('pause', undefined));
    else if (this.#canPlay || this.#states.modelState === 'paused') {
      this.#settings.checkpoint(text('labs.play'));
      this.#ask(this.#client.request('play', undefined));
    }
  }

  #step(steps: number): void {
    if (!this.#states.canChange || this.#states.value === 'running') return;
    this.#ui.banner.hide();
    this.#settings.checkpoint(plural('counts.step', steps));
    this.#ask(this.#client.request('step', { count: steps }));
  }

  /** Rebuilds the model, with the ellipsoids in the scene's start pose and the history of steps cleared. */
  async #reset(): Promise<void> {
    const { ready, value, engineBroken } = this.#states;
    if (!ready || value === 'loading') return;
    if (engineBroken) return this.#opening.reopen();
    this.#states.load(text('labs.resetting'));
    try {
      await this.#settings.rebuild(undefined);
      this.#results.startOver();
      await this.#client.request('show', this.#shown);
      this.#states.idle(text('labs.readyToStart'));
    } catch (error) {
      this.#states.fail(text('labs.buildFailed'), error);
    }
  }

  /** Shows an error message if a request fails, without waiting for the reply. */
  #ask(request: Promise<unknown>): void {
    request.catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }

  /** Writes what is open and the settings in force into the page's address, so that it can be shared. */
  #updateAddress(): void {
    const { source } = this.#opening;
    if (!source || (this.#states.value === 'loading' && !this.#states.ready)) return;
    const { params, pose, posed, film } = this.#settings;
    const { color, layout } = this.#ui.options.value;
    const { example, name: file } = source;
    const linked = linkOf({
      example,
      file,
      params,
      usual: this.#usual,
      pose: posed ? pose : undefined,
      film,
      color,
      layout,
    });
    showAddress(toHash(linked));
  }

  async #copyLink(): Promise<void> {
    this.#updateAddress();
    await copyAddress(this.#ui.status, [!this.#opening.source?.example && FILE_NOTE]);
  }

  #onEvent(event: WorkerEvent): void {
    if (event.event === 'recorded') this.#ui.film.showRecording(event.progress);
    else if (event.event === 'failure') this.#states.fail(text('labs.runFailed'), new RequestError(event.failure));
    else if (event.event === 'frame') this.#results.take(event);
    else if (event.event === 'measured') this.#results.measured(event);
    else if (event.event === 'refused') this.#settings.reject(event.pose, event.failure.message);
    else if (this.#states.setModelState(event.state)) this.#results.showState(event.state);
  }

  #showState(state: LabState): void {
    const { modelState, ready } = this.#states;
    this.#root.dataset.state = state;
    this.#ui.showState(modelState, ready, this.#canPlay);
    if (state === 'done' || state === 'paused') this.#updateAddress();
  }

  #escape(): void {
    if (this.#ui.banner.shown) this.#dismiss();
    else this.#settings.choose(undefined);
  }

  #dismiss(): void {
    if (this.#states.dismiss()) this.#ui.status.say(this.#results.describe(this.#states.value));
  }
}
