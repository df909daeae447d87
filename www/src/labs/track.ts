import { RequestError, toFailure } from '../channel';
import { GUIDES } from '../guides';
import type { LabState } from '../state';
import { plural, text } from '../texts';
import { boxOf, type VoxelBox, voxelsOf } from '../track/box';
import { TrackClient } from '../track/client';
import { isTrackPreset, type TrackPreset, type TrackVariant, variantInForce, viewOf } from '../track/presets';
import type { Alternative, StepEvent, VolumeView, WorkerEvent } from '../track/protocol';
import { prefersReducedMotion } from '../ui/dom';
import { History } from '../ui/history';
import { labShortcuts, offerShortcuts, type Shortcut } from '../ui/shortcuts';
import { invert, sliceOrientations } from '../view/anatomy';
import { LabStates } from './lab-states';
import type { Handoff, Lab, OpenInLab } from './labs';
import { compareWith } from './track-comparing';
import { type OpenedTrack, TrackOpening, type TrackSource } from './track-opening';
import { type PartEvents, TrackParts } from './track-parts';
import { TrackResults } from './track-results';
import { TrackSettings } from './track-settings';
import { TrackSharing } from './track-sharing';

/**
 * The Track lab: a surface is tracked through the frames of a 4D image. This class connects the lab's parts; opening,
 * settings, results, comparison and sharing are in files of their own.
 */
export class TrackLab implements Lab {
  readonly #root: HTMLElement;
  readonly #closing = new AbortController();
  readonly #client = new TrackClient((event) => this.#onEvent(event));
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #results: TrackResults;
  readonly #settings: TrackSettings;
  readonly #opening: TrackOpening;
  readonly #sharing: TrackSharing;
  readonly #passOn: OpenInLab;
  #volume: VolumeView | undefined;
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

  constructor(root: HTMLElement, help: HTMLElement, passOn: OpenInLab) {
    this.#root = root;
    this.#passOn = passOn;
    const { signal } = this.#closing;
    const ui = new TrackParts(root, this.#client, signal, this.#events());
    const states = new LabStates(ui.banner, ui.status, signal);
    this.#ui = ui;
    this.#states = states;
    this.#results = new TrackResults(this.#client, ui, states, new History());
    this.#settings = new TrackSettings(
      this.#client,
      ui,
      states,
      this.#results,
      () => this.#showSettings(),
      (volume) => this.#takeVolume(volume, true),
    );
    this.#opening = new TrackOpening(this.#client, ui, states, (opened, source) => this.#adopt(opened, source));
    this.#sharing = new TrackSharing(this.#client, ui, states, this.#results, this.#settings, this.#opening);
    states.subscribe((state) => this.#showState(state));
    offerShortcuts(this.#shortcuts(), help, GUIDES.track, signal);
  }

  /** Opens what the address asks for, or else the first example, and runs it. */
  async start(_passedOn?: Handoff): Promise<void> {
    await this.#opening.start(this.#closing.signal, () => this.#sharing.updateAddress());
  }

  close(): void {
    this.#closing.abort();
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
      onPreparation: (preparation, what) => void this.#settings.change({ preparation }, what),
      onRegion: (region) => this.#setRegion(region),
      onComponent: (which) => this.#setComponent(which),
      onParam: (name, value) => void this.#settings.setParams({ [name]: value }, this.#ui.labelOf(name)),
      onOptions: () => this.#optionsChanged(),
      onFrame: (frame) => this.#results.choose(frame),
      onMoved: () => this.#results?.showFigures(),
      onCompare: (other) => void this.#compare(other),
      onCancelCompare: () => this.#ask(this.#client.request('cancelCompare', undefined)),
      onSave: (what) => this.#sharing.save(what),
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
    const { frames } = this.#ui;
    return [
      ...labShortcuts(
        this.#events(),
        [
          { key: 'b', shown: 'b', text: text('track.framesKey'), act: () => frames.toggle() },
          { key: ',', shown: ',', text: text('track.previousFrameKey'), act: () => frames.go(-1) },
          { key: '.', shown: '.', text: text('track.nextFrameKey'), act: () => frames.go(1) },
        ],
        text('track.playOrPause'),
      ),
      { key: 'Escape', shown: text('labs.keyEscape'), text: text('labs.dismissKey'), act: () => this.#dismiss() },
    ];
  }

  /** Displays a newly opened image, with the settings of its example or link, and starts tracking. */
  async #adopt(opened: OpenedTrack, { name, example, linked }: TrackSource): Promise<void> {
    const { setup } = opened;
    this.#states.ready = true;
    this.#slices = opened.dims[2];
    this.#truth = opened.truth;
    this.#results.unit = example?.unit ?? 'mm';
    this.#ui.adopt(opened, example, name);
    this.#takeVolume(opened.volume, false);
    this.#settings.adopt(setup, { ...opened, volume: undefined });
    this.#results.startOver();
    this.#ui.options.set({ ...viewOf(example), ...linked?.view });
    if (setup.box && this.#region) this.#ui.view.fitRegion(this.#region);
    const crosshair = (setup.at === example?.at && example?.crosshair) || setup.at;
    if (crosshair) this.#ui.view.goTo(crosshair);
    await this.#client.request('play', undefined);
  }

  #takeVolume(volume: VolumeView, keep: boolean): void {
    this.#volume = volume;
    this.#results.setImage(volume, this.#slices, this.#truth, keep);
  }

  /** The region of interest in voxels, the whole image by default; undefined if no image is open. */
  get #region(): VoxelBox | undefined {
    if (!this.#volume) return undefined;
    const { dims, affine } = this.#volume;
    const { box } = this.#settings.setup;
    if (!box) return { low: [0, 0, 0], high: [dims[0] - 1, dims[1] - 1, dims[2] - 1] };
    return voxelsOf(box, invert(affine), dims);
  }

  #setRegion(region: VoxelBox | undefined): void {
    const volume = this.#volume;
    const present = this.#region;
    if (!volume || JSON.stringify(region) === JSON.stringify(present)) return;
    const box = region && boxOf(region, volume.affine);
    void this.#settings.change({ box }, text('track.regionChange'));
  }

  #setComponent(which: 'here' | 'largest'): void {
    const at = which === 'here' ? this.#ui.view.crosshair.point : undefined;
    void this.#settings.change({ at }, text('track.surfaceChange'));
  }

  #openVariant(preset: TrackPreset, { name, params, view }: TrackVariant): void {
    this.#ui.options.set({ ...viewOf(preset), ...view });
    const differs = Object.entries(params).some(([key, value]) => !Object.is(this.#settings.params[key], value));
    if (differs) void this.#settings.setParams(params, text('labs.figureChange', { name }));
  }

  #showSettings(): void {
    const { params, setup, noise, suggested } = this.#settings;
    const [low, high] = this.#volume?.range ?? [0, 1];
    this.#ui.showParams(params, noise, suggested, high - low);
    this.#ui.preparation.show(setup.preparation);
    this.#ui.compare.show(params.prediction === true, setup.preparation);
    const region = this.#region;
    if (region && this.#volume) {
      const names = sliceOrientations(this.#volume).map((frame) => frame.name);
      this.#ui.region.show(region, this.#volume.dims, names, setup.at, setup.box === undefined);
      this.#ui.view.showRegion(region);
    }
    const example = this.#opening.source?.example;
    const preset = isTrackPreset(example) ? example : undefined;
    const given = { ...preset?.params };
    const variant = preset && variantInForce(preset, params, given);
    this.#ui.showFigure(preset, variant);
    this.#sharing.updateAddress();
  }

  #optionsChanged(): void {
    if (!this.#states?.ready) return;
    this.#results.showFigures();
    this.#sharing.updateAddress();
  }

  #toggle(): void {
    const { value, canChange, canRun } = this.#states;
    if (!canChange) return;
    this.#ui.banner.hide();
    if (value === 'running') this.#ask(this.#client.request('pause', undefined));
    else if (canRun) {
      this.#results.follow();
      this.#ask(this.#client.request('play', undefined));
    }
  }

  #step(steps: number): void {
    if (!this.#states.canRun || this.#states.value === 'running') return;
    this.#ui.banner.hide();
    this.#results.follow();
    this.#settings.checkpoint(plural('counts.step', steps));
    this.#client.request('step', { count: steps }).catch((error) => this.#states.fail(text('track.stepFailed'), error));
  }

  /** Rebuilds the tracker with the same settings, and clears the results. */
  async #reset(): Promise<void> {
    const { ready, value, engineBroken } = this.#states;
    if (!ready || value === 'loading') return;
    if (engineBroken) return this.#opening.reopen();
    this.#states.load(text('labs.resetting'));
    try {
      await this.#settings.rebuild();
      this.#states.idle(text('labs.readyToStart'));
    } catch (error) {
      this.#states.fail(text('track.buildFailed'), error);
    }
  }

  async #compare(other: Alternative): Promise<void> {
    const { compare } = this.#ui;
    compare.begin();
    try {
      const present = { results: this.#results, duration: this.#duration };
      const runs = await compareWith(this.#client, this.#settings, present, other);
      if (!runs) return compare.reject(text('labs.cancelled'));
      compare.finish(runs);
      const [, there] = runs;
      this.#results.other = { volumes: there.facts.map(({ volume }) => volume), name: there.name };
    } catch (error) {
      const { code, message } = toFailure(error);
      compare.reject(message);
      if (code === 'internal') this.#states.fail(text('track.compareFailed'), error);
    }
  }

  /** Shows an error message if a request fails, without waiting for the reply. */
  #ask(request: Promise<unknown>): void {
    request.catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }

  #onEvent(event: WorkerEvent): void {
    if (event.event === 'preparing') this.#ui.status.say(event.what);
    else if (event.event === 'comparing') this.#ui.compare.showProgress(event.part, event.phase);
    else if (event.event === 'failure') this.#states.fail(text('labs.runFailed'), new RequestError(event.failure));
    else if (event.event === 'step') {
      this.#results.take(event);
      this.#report(event);
    } else if (this.#states.setModelState(event.state)) this.#settled(event.state);
  }

  /** Reports progress of the tracking to screen readers occasionally: every frame would be too often. */
  #report({ index }: StepEvent): void {
    if (index === undefined || this.#states.value !== 'running') return;
    const { frames } = this.#results;
    if (index === 0) this.#ui.status.say(this.#results.describe('running'));
    else
      this.#ui.status.report(() =>
        text('track.tracked', { tracked: frames.length, frames: this.#volume?.frames ?? 0 }),
      );
  }

  #settled(state: 'running' | 'paused' | 'done'): void {
    this.#time(state);
    this.#ui.status.say(this.#results.describe(state));
    if (state === 'done' && !prefersReducedMotion()) this.#ui.frames.start();
    else this.#ui.frames.stop();
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

  #showState(state: LabState): void {
    const { modelState, ready } = this.#states;
    const { frames, frame } = this.#results;
    this.#root.dataset.state = state;
    this.#ui.showState(modelState, ready, frames.length, frames[frame] !== undefined);
    if (state === 'done' || state === 'paused') this.#sharing.updateAddress();
  }

  #dismiss(): void {
    if (this.#states.dismiss()) this.#ui.status.say(this.#results.describe(this.#states.value));
  }
}
