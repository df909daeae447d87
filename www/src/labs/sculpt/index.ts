import { prefersReducedMotion } from '../../kit/dom';
import { History } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { Lab, LabPlace } from '../../lab/lab';
import { LinkError, readLink } from '../../lab/link-query';
import { Opening } from '../../lab/opening';
import { type RunningLab, Runs } from '../../lab/runs';
import { contentOf } from '../../lab/session/content';
import { LabShell } from '../../lab/shell';
import { LabStates } from '../../lab/states';
import { text } from '../../texts';
import { connectSculpt } from './client';
import { type OpenedPose, SculptData, type SculptOpening, type SculptSource } from './data';
import { type SculptExample, viewOf } from './examples';
import { lastFrame } from './film';
import { Filming } from './filming';
import { filmOf, fits, fromHash, linkOf, toHash } from './link';
import { offerStages } from './panels/options';
import { type PartEvents, SculptParts } from './parts';
import { Posing } from './posing';
import { isSculptPreset, poseOf, type SculptPreset, type SculptVariant, variantInForce } from './presets';
import type { FrameContents, FrameEvent, ParamValues, SculptQuantity, Support, WorkerEvent } from './protocol';
import { SculptResults } from './results';
import type { SculptContent } from './schema';
import { type SculptMoments, SculptSettings } from './settings';
import type { SculptViewOptions } from './view';

/** The colourings of the surface for which the worker has to compute values at the vertices. */
const QUANTITIES: readonly string[] = [
  'area distortion',
  'angle distortion',
  'mean curvature',
] satisfies SculptQuantity[];

/**
 * The Sculpt lab: a detailed surface is deformed by ellipsoids. Data, settings, posing, filming and results are in
 * files of their own.
 */
class SculptLab implements RunningLab<SculptExample> {
  readonly shell: LabShell<SculptExample>;
  readonly #runs: Runs<SculptExample>;

  readonly id = 'sculpt';
  readonly client = connectSculpt((event) => this.#onEvent(event));
  readonly ui: SculptParts;
  readonly states: LabStates;
  readonly opening: SculptOpening;
  readonly #results: SculptResults;
  readonly #settings: SculptSettings;
  readonly #posing: Posing;
  readonly #filming: Filming;
  /**
   * Parameters that the scene opened with, including the model's own choices, but without changes by a link, which
   * contains only parameters that differ from these.
   */
  #usual: ParamValues = {};
  #shown: FrameContents = { layout: 'result', quantity: undefined, textured: false };

  readonly escape = {
    text: text('sculpt.dismissKey'),
    act: () => {
      if (this.ui.page.banner.shown) this.shell.dismiss();
      else this.#settings.choose(undefined);
    },
  };

  constructor(place: LabPlace) {
    const shell = new LabShell(place, this);
    const runs = new Runs(shell, this);
    this.shell = shell;
    this.#runs = runs;
    const { client } = this;
    const { root, signal } = shell;
    const history = new History();
    const ui = new SculptParts(root, history, client, signal, this.#events());
    const states = new LabStates(ui.page.banner, ui.page.status, signal);
    this.ui = ui;
    this.states = states;
    this.#results = new SculptResults(client, ui, states, history, (frame) => this.#follow(frame));
    this.#settings = new SculptSettings(client, ui, states, history, () => this.#showSettings());
    this.#posing = new Posing(ui, this.#settings, () => this.shell.work.did('shaped'));
    this.#filming = new Filming(client, ui, states, this.#settings);
    const data = new SculptData(client, states, (opened, source) => this.#adopt(opened, source));
    this.opening = new Opening(client, ui.page, states, data);
    const addKey = () => this.#filming.addKey();
    runs.begin([{ key: 'k', shown: 'k', text: text('sculpt.addKeyframeKey'), act: addKey }]);
  }

  closed(): void {
    this.#posing.close();
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      ...this.#runs.events(),
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
      onCancelRecord: () => void this.client.request('cancelRecord', undefined),
      onParam: (name, value) => void this.#settings.setParams({ [name]: value }, this.ui.page.labelOf(name)),
      onSupport: (support) => void this.#setSupport(support),
      onOptions: (options) => this.#setOptions(options),
    };
  }

  /**
   * Displays a newly opened scene, with the settings of its example or link. Plays its film; without a film, with a
   * pose from a link, or if the film loops and the user prefers reduced motion, the surface only settles in the pose.
   */
  async #adopt(opened: OpenedPose, { name, example, session, ...source }: SculptSource): Promise<void> {
    const settings = session ? readLink(() => fromHash(session.hash)) : source.linked;
    const linked = settings instanceof LinkError ? undefined : settings;
    this.states.ready = true;
    this.#usual = { ...opened.params };
    for (const [name, value] of Object.entries(linked?.params ?? {}))
      if (example?.params[name] === undefined) delete this.#usual[name];
      else if (Object.is(opened.params[name], value)) this.#usual[name] = example.params[name];
    this.#results.clear();
    this.ui.adopt(opened, example, name, source.warnings);
    const film = filmOf(linked ?? {}, example?.film);
    const { support, start, pose, params } = opened;
    this.#settings.adopt({
      support,
      start,
      pose,
      names: example?.names ?? [],
      posed: linked?.pose !== undefined,
      opensPosed: poseOf(example) !== undefined,
      film,
      params,
    });
    const preset = isSculptPreset(example) ? example : undefined;
    offerStages(this.ui.options, preset?.stages !== undefined);
    const view = { ...viewOf(example), ...linked?.view };
    this.ui.options.set(view.layout === 'stages' && !preset?.stages ? { ...view, layout: 'result' } : view);
    if (preset?.stages) this.#results.showStages(preset.stages);
    if (opened.moments)
      return this.#resume(opened.moments, session && contentOf<SculptContent>(session, 'sculpt').view);
    await this.#settings.setFilm(film, 0);
    await this.client.request('show', this.#shown);
    const endless = film?.loop === true && prefersReducedMotion();
    await this.client.request(film && !linked?.pose && !endless ? 'play' : 'settle', undefined);
  }

  /** Continues a session: shows its state and view, and does not run it. */
  async #resume(moments: SculptMoments, view: SculptContent['view']): Promise<void> {
    if (view) this.ui.options.set(view.options);
    await this.client.request('show', this.#shown);
    await this.#settings.resume(moments);
    this.states.idle(this.#results.describe('paused'));
    if (view) this.ui.view.pose = view.camera;
  }

  async sessionContent(): Promise<Record<string, unknown> | undefined> {
    const [moments, log] = await this.#runs.paused(async () => [
      await this.#settings.moments(),
      await this.client.request('log', undefined),
    ]);
    if (!moments) return undefined;
    const view = { camera: this.ui.view.pose, options: this.ui.options.value };
    return {
      ...(await import('../../lab/session/moments')).packMoments(moments),
      params: this.#settings.params,
      log,
      view,
    };
  }

  linkLacks(): (string | false)[] {
    return [!fits(this.#settings.pose) && text('sculpt.linkLacksPose')];
  }

  #openVariant(preset: SculptPreset, { name, params, pose }: SculptVariant): void {
    const values = { ...this.#usual, ...params };
    const differs = Object.entries(values).some(([key, value]) => !Object.is(this.#settings.params[key], value));
    if (differs) void this.#settings.setParams(values, text('labs.figureChange', { name }));
    this.#settings.checkpoint(text('labs.figureChange', { name }));
    this.#settings.send(pose ?? preset.start ?? this.#settings.pose, false);
  }

  #follow(frame: FrameEvent): void {
    this.#settings.follow(frame, this.states.modelState === 'running');
  }

  #showSettings(): void {
    const { params, pose, support } = this.#settings;
    this.ui.showSupport(support);
    this.#results.support = support;
    const example = this.opening.source?.example;
    const preset = isSculptPreset(example) ? example : undefined;
    this.ui.showParams(params, preset, preset && variantInForce(preset, pose, params, this.#usual));
    this.showControls(this.states.value);
    this.shell.updateAddress();
  }

  get #hasFilm(): boolean {
    const { film } = this.#settings;
    return film !== undefined && lastFrame(film) > 0;
  }

  #setOptions({ layout, color }: SculptViewOptions): void {
    const quantity = QUANTITIES.includes(color) ? (color as SculptQuantity) : undefined;
    const textured = color === 'texture';
    const before = this.#shown;
    const changed = layout !== before.layout || quantity !== before.quantity || textured !== before.textured;
    this.#shown = { layout, quantity, textured };
    if (!this.states.ready) return;
    if (changed) this.shell.ask(this.client.request('show', this.#shown));
    this.#results.showOriginals();
    this.shell.updateAddress();
  }

  get canPlay(): boolean {
    return this.states.canChange && (this.#hasFilm || this.states.modelState === 'paused');
  }

  get canStep(): boolean {
    return this.states.canChange;
  }

  beforeRun(change: string): void {
    this.#settings.checkpoint(change);
  }

  /** Builds another model of the same surface, with another support. */
  async #setSupport(support: Support): Promise<void> {
    if (this.states.canChange) await this.#build(support);
    this.ui.showSupport(this.#settings.support);
  }

  /** Rebuilds the model, with the ellipsoids in the scene's start pose and the history of steps cleared. */
  startOver(): Promise<void> {
    return this.#build(this.#settings.support);
  }

  #build(support: Support): Promise<void> {
    return this.#runs.building(async () => {
      await this.#settings.rebuild(support);
      this.#results.startOver();
      await this.client.request('show', this.#shown);
    });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#settings.travel(way);
  }

  address({ example, name: file }: SculptSource): string {
    const { params, support, start, pose: present, posed, film } = this.#settings;
    const { value: view } = this.ui.options;
    const pose = posed ? present : undefined;
    return toHash(linkOf({ example, file, params, usual: this.#usual, support, start, pose, film, view }));
  }

  #onEvent(event: WorkerEvent): void {
    if (this.#runs.takes(event)) return;
    if (event.event === 'recorded') this.ui.film.recording.value = event.progress;
    else if (event.event === 'frame') this.#results.take(event);
    else if (event.event === 'measured') this.#results.measured(event);
    else this.#settings.reject(event.pose, event.failure.message);
  }

  settled(state: LabState): void {
    this.#results.showState(state);
  }

  showControls(state: LabState): void {
    const { modelState, ready } = this.states;
    this.ui.showState(state, modelState, ready, this.#hasFilm);
  }

  describe(): string {
    return this.#results.describe(this.states.value);
  }
}

/** Makes the Sculpt lab. */
export const makeSculpt = (place: LabPlace): Lab => new SculptLab(place).shell;
