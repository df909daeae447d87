import { toFailure } from '../../engine/failure';

import { prefersReducedMotion } from '../../kit/dom';
import { History } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { Lab, LabPlace } from '../../lab/lab';
import { Opening } from '../../lab/opening';
import { type RunningLab, Runs } from '../../lab/runs';
import { contentOf } from '../../lab/session/content';
import type { Moments } from '../../lab/session/moments';
import { LabShell } from '../../lab/shell';
import { LabStates } from '../../lab/states';
import { unitOf } from '../../lab/surface-space';
import { invert, sliceOrientations } from '../../scene/anatomy';
import { text } from '../../texts';
import { pointToShow, TrackAsking } from './asking';
import { boxOf, type VoxelBox, voxelsOf } from './box';
import { connectTrack } from './client';
import { compareWith } from './comparison';
import { type OpenedTrack, TrackData, type TrackOpening, type TrackSource } from './data';
import type { TrackExample } from './examples';
import { isChosen, linkOf, toHash } from './link';
import { type PartEvents, TrackParts } from './parts';
import { isTrackPreset, type TrackPreset, type TrackVariant, variantInForce, viewOf } from './presets';
import type { Alternative, StepEvent, Vec3, VolumeView, WorkerEvent } from './protocol';
import { TrackResults } from './results';
import { saveTrack } from './saving';
import type { TrackContent } from './schema';
import { type TrackMoment, TrackSettings } from './settings';

/**
 * The Track lab: a surface is tracked through the frames of a 4D image. Data, settings, results and comparison are in
 * files of their own.
 */
class TrackLab implements RunningLab<TrackExample> {
  readonly shell: LabShell<TrackExample>;
  readonly #runs: Runs<TrackExample>;

  readonly id = 'track';
  readonly client = connectTrack((event) => this.#onEvent(event));
  readonly ui: TrackParts;
  readonly states: LabStates;
  readonly opening: TrackOpening;
  readonly #results: TrackResults;
  readonly #settings: TrackSettings;
  readonly #asking: TrackAsking;
  #volume: VolumeView | undefined;
  /** Whether the image that is opened again is not to be run. */
  #stays = false;
  /** Number of slices of the image before its preparation, which may insert some. */
  #slices = 1;
  #truth: number[] | undefined;
  /**
   * Time in milliseconds at which the present run of the tracker began; undefined if none is running, or if it was
   * resumed midway.
   */
  #began: number | undefined;
  /**
   * Duration in milliseconds of the last complete run of the tracker, for comparisons; undefined before the first, and
   * after a pause.
   */
  #duration: number | undefined;

  constructor(place: LabPlace) {
    const shell = new LabShell(place, this);
    const runs = new Runs(shell, this);
    this.shell = shell;
    this.#runs = runs;
    const { client } = this;
    const { root, signal } = shell;
    const history = new History();
    const ui = new TrackParts(root, history, client, signal, this.#events());
    const states = new LabStates(ui.page.banner, ui.page.status, signal);
    this.ui = ui;
    this.states = states;
    this.#results = new TrackResults(client, ui, states, history);
    this.#settings = new TrackSettings(
      client,
      ui,
      states,
      this.#results,
      () => this.#showSettings(),
      (volume) => this.#takeVolume(volume, true),
    );
    this.#asking = new TrackAsking(client, ui, states, this.#settings, {
      onToggle: () => this.#askingChanged(),
      onProposed: (proposal, query) => this.#showProposed(pointToShow(proposal, query)),
      onStuck: () => void this.opening.cancel(),
      describe: () => this.describe(),
    });
    const data = new TrackData(
      client,
      () => this.#settings.setup,
      (opened, source, reopening) => this.#adopt(opened, source, reopening),
    );
    this.opening = new Opening(client, ui.page, states, data);
    runs.begin(
      [
        { key: 'b', shown: 'b', text: text('track.framesKey'), act: () => ui.frames.toggle() },
        { key: ',', shown: ',', text: text('track.previousFrameKey'), act: () => ui.frames.go(-1) },
        { key: '.', shown: '.', text: text('track.nextFrameKey'), act: () => ui.frames.go(1) },
      ],
      text('track.playOrPause'),
    );
  }

  /** Returns the handlers of the user's actions, which call the parts of the lab. */
  #events(): PartEvents {
    return {
      ...this.#runs.events(),
      onCancel: () => this.#cancel(),
      onAsk: () => void this.#toggleAsking(),
      onHere: () => this.#asking.isOpen && this.#asking.here(),
      onMoving: (where) => this.#asking.moving(where),
      onWhole: () => void this.#trackWhole(),
      onKeep: () => void this.#toggleAsking(),
      onCavity: (cavity) => void this.#settings.change({ cavity }, text('trackPanels.cavity')),
      onVariant: (preset, variant) => this.#openVariant(preset, variant),
      onPreparation: (preparation, what) => void this.#settings.change({ preparation }, what),
      onRegion: (region) => this.#setRegion(region),
      onComponent: (which) => this.#setComponent(which),
      onParam: (name, value) => void this.#settings.setParams({ [name]: value }, this.ui.page.labelOf(name)),
      onOptions: () => this.#optionsChanged(),
      onFrame: (frame) => this.#results.choose(frame),
      onMoved: () => this.#results.showFigures(),
      onCompare: (other) => void this.#compare(other),
      onCancelCompare: () => this.shell.ask(this.client.request('cancelCompare', undefined)),
      onSave: (what) => this.shell.ask(this.#save(what), text('track.fileFailed')),
      onSculpt: () => this.#frameToSculpt(),
    };
  }

  /** Displays a newly opened image, with the settings of its example or link, and tracks it, or asks for the object in it. */
  async #adopt(opened: OpenedTrack, source: TrackSource, reopening: boolean): Promise<void> {
    const { name, example, linked, session } = source;
    const stays = reopening && this.#stays;
    this.#stays = false;
    const asks = reopening ? this.#asking.isOpen : !example && !isChosen(linked ?? {});
    this.#asking.end();
    const { setup, moments } = opened;
    this.states.ready = true;
    this.#slices = opened.dims[2];
    this.#truth = opened.truth;
    this.#results.unit = example?.unit ?? unitOf(opened.volume);
    this.ui.adopt(opened, example, name);
    this.#takeVolume(opened.volume, false);
    this.#settings.adopt(setup, { ...opened, volume: undefined });
    this.#results.startOver();
    if (moments) return this.#resume(moments, session && contentOf<TrackContent>(session, 'track').view);
    this.ui.options.set({ ...viewOf(example), ...linked?.view });
    if (setup.box && this.#region) this.ui.view.fitRegion(this.#region);
    const crosshair = (setup.at === example?.at && example?.crosshair) || setup.at;
    if (crosshair) this.ui.view.goTo(crosshair);
    if (asks || (stays && this.#isUntouched)) this.#ask();
    else if (stays) this.states.idle(text('labs.cancelled'));
    else await this.client.request('play', undefined);
  }

  /** Asks for the object to track. */
  #ask(): void {
    this.#asking.begin();
    this.states.idle(this.describe());
  }

  async #toggleAsking(): Promise<void> {
    if (this.#asking.isOpen) {
      this.#asking.end();
      this.ui.page.status.say(this.describe());
      return;
    }
    await this.client.request('pause', undefined);
    this.#asking.begin();
    this.ui.page.status.say(this.describe());
  }

  /** Cancels what the worker is busy with. If that is the present image, it is opened again, and not run by itself. */
  #cancel(): void {
    if (this.#asking.cancel()) return;
    this.#stays = !this.states.isOpening;
    void this.opening.cancel();
  }

  #askingChanged(): void {
    this.#showSettings();
    this.showControls(this.states.value);
  }

  /** Shows an object for which settings were proposed. */
  #showProposed(point: Vec3 | undefined): void {
    if (this.#region) this.ui.view.fitRegion(this.#region);
    if (point) this.ui.view.goTo(point);
  }

  /** Tracks the largest object of the whole image, without a proposal. */
  async #trackWhole(): Promise<void> {
    this.#asking.end();
    const { box, at } = this.#settings.setup;
    if (box || at) await this.#settings.change({ box: undefined, at: undefined }, text('track.regionChange'));
    else await this.client.request('play', undefined);
  }

  /** Continues a session: shows its state and view, and does not run it. */
  async #resume(moments: Moments<TrackMoment>, view: TrackContent['view']): Promise<void> {
    await this.#settings.resume(moments);
    if (this.#isUntouched) this.#asking.begin();
    const state = moments.now.saved.done ? 'done' : 'paused';
    this.states.idle(this.#results.describe(state), state);
    if (!view) return;
    this.ui.options.set(view.options);
    this.ui.view.pose = view;
    if (view.frame !== undefined) this.#results.choose(view.frame);
  }

  async sessionContent(): Promise<Record<string, unknown> | undefined> {
    const moments = await this.#runs.paused(() => this.#settings.moments());
    if (!moments) return undefined;
    const view = { ...this.ui.view.pose, options: this.ui.options.value, frame: this.#results.frame };
    return { ...(await import('./session')).packTrack(moments), view };
  }

  async #save(what: Parameters<typeof saveTrack>[0]): Promise<void> {
    await saveTrack(what, this.client, this.ui, this.#results);
    if (what !== 'table') this.shell.work.settled('run');
  }

  /** The surface of one frame is not the run. */
  surfaceSaved(): void {
    this.shell.work.settled('edited');
  }

  codeRequest(): { frame: number } {
    return { frame: this.#results.frame };
  }

  #takeVolume(volume: VolumeView, keep: boolean): void {
    this.#volume = volume;
    this.ui.page.warnings.showData(volume.warnings);
    this.#results.setImage(volume, this.#slices, this.#truth, keep);
  }

  /** Whether the image is the user's own and nothing in it was chosen or tracked. */
  get #isUntouched(): boolean {
    return !this.opening.source?.example && !isChosen(this.#settings.setup) && this.#results.isNew;
  }

  /** The region of interest in voxels, the whole image by default; undefined if no image is open. */
  get #region(): VoxelBox | undefined {
    if (!this.#volume) return undefined;
    const { dims, affine } = this.#volume;
    const box = this.#asking.box ?? this.#settings.setup.box;
    if (!box) return { low: [0, 0, 0], high: [dims[0] - 1, dims[1] - 1, dims[2] - 1] };
    return voxelsOf(box, invert(affine), dims);
  }

  #setRegion(region: VoxelBox | undefined): void {
    const volume = this.#volume;
    const present = this.#region;
    if (!volume || JSON.stringify(region) === JSON.stringify(present)) return;
    if (this.#asking.isOpen) this.#asking.draw(region, volume.affine);
    else void this.#settings.change({ box: region && boxOf(region, volume.affine) }, text('track.regionChange'));
  }

  #setComponent(which: 'here' | 'largest'): void {
    const at = which === 'here' ? this.ui.view.crosshair.point : undefined;
    this.#asking.end();
    void this.#settings.change({ at }, text('track.surfaceChange'));
  }

  #openVariant(preset: TrackPreset, { name, params, view }: TrackVariant): void {
    this.ui.options.set({ ...viewOf(preset), ...view });
    const differs = Object.entries(params).some(([key, value]) => !Object.is(this.#settings.params[key], value));
    if (differs) void this.#settings.setParams(params, text('labs.figureChange', { name }));
  }

  #showSettings(): void {
    const { params, setup, noise, suggested } = this.#settings;
    const [low, high] = this.#volume?.range ?? [0, 1];
    this.ui.showParams(params, noise, suggested, high - low);
    this.ui.preparation.show(setup.preparation);
    this.ui.compare.show(params.prediction === true, setup.preparation);
    const region = this.#region;
    if (region && this.#volume) {
      const names = sliceOrientations(this.#volume).map((frame) => frame.name);
      const { at: nearest, cavity } = setup;
      const whole = setup.box === undefined && this.#asking.box === undefined;
      this.ui.region.show({ region, whole, dims: this.#volume.dims, names, nearest, cavity });
      this.ui.view.showRegion(region);
    }
    const example = this.opening.source?.example;
    const preset = isTrackPreset(example) ? example : undefined;
    const given = { ...preset?.params };
    const variant = preset && variantInForce(preset, params, given);
    this.ui.showFigure(preset, variant);
    this.shell.updateAddress();
  }

  #optionsChanged(): void {
    if (!this.states.ready) return;
    this.#results.showFigures();
    this.shell.updateAddress();
  }

  get canPlay(): boolean {
    return this.states.canRun && !this.#asking.isOpen;
  }

  get canStep(): boolean {
    return this.canPlay;
  }

  beforeRun(change: string, isStep: boolean): void {
    this.#results.follow();
    if (isStep) this.#settings.checkpoint(change);
  }

  /** Rebuilds the tracker with the same settings, and clears the results. */
  startOver(): Promise<void> {
    return this.#runs.building(() => this.#settings.rebuild());
  }

  async travel(way: 'undo' | 'redo'): Promise<void> {
    this.#asking.end();
    await this.#settings.travel(way);
    if (this.#isUntouched) this.#ask();
  }

  address({ example, name: file }: TrackSource): string {
    const { setup } = this.#settings;
    return toHash(linkOf({ example, file, setup, view: this.ui.options.value, asks: this.#asking.isOpen }));
  }

  #frameToSculpt(): void {
    const { frame } = this.#results;
    this.#runs.toSculpt(
      this.ui.run.surfaceFile({ format: 'ply' }),
      text('track.frameName', { name: this.ui.page.saving.name, frame: frame + 1 }),
    );
  }

  async #compare(other: Alternative): Promise<void> {
    const { compare } = this.ui;
    compare.begin();
    try {
      const present = { results: this.#results, duration: this.#duration };
      const runs = await compareWith(this.client, this.#settings, present, other);
      if (!runs) return compare.reject(text('labs.cancelled'));
      compare.finish(runs);
      const [, there] = runs;
      this.#results.other = { volumes: there.facts.map(({ volume }) => volume), name: there.name };
    } catch (error) {
      const { code, message } = toFailure(error);
      compare.reject(message);
      if (code === 'internal') this.states.fail(text('track.compareFailed'), error);
    }
  }

  closed(): void {
    this.#results.close();
  }

  #onEvent(event: WorkerEvent): void {
    // A new state is displayed after the frames before it.
    if (event.event === 'state') this.#results.showPending();
    if (this.#runs.takes(event)) return;
    if (event.event === 'preparing') this.ui.page.status.say(event.what);
    else if (event.event === 'comparing') this.ui.compare.showProgress(event.part, event.phase);
    else {
      this.#results.take(event);
      this.#report(event);
    }
  }

  /** Reports progress of the tracking to screen readers occasionally: every frame would be too often. */
  #report({ index }: StepEvent): void {
    if (index === undefined || this.states.value !== 'running') return;
    const { frames } = this.#results;
    if (index === 0) this.ui.page.status.say(this.#results.describe('running'));
    else
      this.ui.page.status.report(() =>
        text('track.tracked', { tracked: frames.length, frames: this.#volume?.frames ?? 0 }),
      );
  }

  settled(state: 'running' | 'paused' | 'done'): void {
    this.#time(state);
    this.ui.page.status.say(this.#results.describe(state));
    if (state === 'done' && !prefersReducedMotion()) this.ui.frames.start();
    else this.ui.frames.stop();
  }

  /**
   * Measures the duration of a run from its first step to its end; a run that was paused has no duration, for the
   * comparison.
   */
  #time(state: 'running' | 'paused' | 'done'): void {
    if (state === 'running') this.#began = this.#results.isNew ? performance.now() : undefined;
    else if (state === 'done' && this.#began !== undefined) this.#duration = performance.now() - this.#began;
    if (state !== 'running') this.#began = undefined;
    if (state === 'paused') this.#duration = undefined;
  }

  showControls(state: LabState): void {
    const { frames, frame } = this.#results;
    this.ui.showState(state, this.states.modelState, this.states.ready, frames.length, frames[frame] !== undefined);
  }

  describe(): string {
    if (this.#asking.isOpen && this.states.modelState !== 'running') return text('track.asks');
    return this.#results.describe(this.states.value);
  }
}

/** Makes the Track lab. */
export const makeTrack = (place: LabPlace): Lab => new TrackLab(place).shell;
