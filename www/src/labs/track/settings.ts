import { toFailure } from '../../engine/failure';
import type { ParamValues } from '../../engine/protocol';
import type { Moments } from '../../lab/session/moments';
import type { LabStates } from '../../lab/states';
import { type SavedMoment, UndoHistory } from '../../lab/undo-history';
import { text } from '../../texts';
import type { TrackClient } from './client';
import type { TrackParts } from './parts';
import type { Ready, SavedTrack, Setup, VolumeView } from './protocol';
import type { TrackRecord, TrackResults } from './results';

/** The page's part of a saved state; the worker saves the tracker. Undo restores both. */
interface PageState {
  record: TrackRecord;
}

export type TrackMoment = SavedMoment<PageState, SavedTrack>;

/**
 * Manages the setup of the tracker (preparation of the image, region, tracked component, parameters): changes it, sends
 * it to the worker, and undoes changes.
 */
export class TrackSettings {
  readonly #client: TrackClient;
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #results: TrackResults;
  readonly #onChange: () => void;
  readonly #onVolume: (volume: VolumeView) => void;
  readonly #undo: UndoHistory<PageState, SavedTrack>;
  #setup: Setup = {
    preparation: { binning: 1, enrichment: 'none', factor: 0 },
    box: undefined,
    at: undefined,
    params: {},
  };
  /** Whether the tracker runs after a change. */
  runs = true;
  #ready: Omit<Ready, 'volume'> = { params: {}, suggested: 1, noise: 0 };

  /**
   * `onChange` is called whenever the settings in force may have changed, to display them and to update the page's
   * address; `onVolume` when the image was prepared again.
   */
  constructor(
    client: TrackClient,
    ui: TrackParts,
    states: LabStates,
    results: TrackResults,
    onChange: () => void,
    onVolume: (volume: VolumeView) => void,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#results = results;
    this.#onChange = onChange;
    this.#onVolume = onVolume;
    this.#undo = new UndoHistory<PageState, SavedTrack>(
      client,
      () => ({ record: results.record() }),
      (undoable, redoable) => ui.run.transport.showUndo(undoable, redoable),
    );
  }

  /** Whether the tracker has done a step. */
  get wasRun(): boolean {
    return !this.#results.isNew;
  }

  /** The setup of the tracker as requested; its `params` are only those set by the example, a link or the user. */
  get setup(): Setup {
    return this.#setup;
  }

  /** All parameters of the tracker in force, defaults included. */
  get params(): ParamValues {
    return this.#ready.params;
  }

  /** The edge threshold τ suggested by the noise and the range of the image's intensities, in intensity units. */
  get suggested(): number {
    return this.#ready.suggested;
  }

  /** Standard deviation of the image's noise, in intensity units. */
  get noise(): number {
    return this.#ready.noise;
  }

  /** Takes over the setup of a newly opened image and of its tracker, and clears the undo history. */
  adopt(setup: Setup, ready: Ready): void {
    this.#undo.clear();
    this.#take(setup, ready);
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
   * Changes the preparation of the image, the region of interest or what is tracked in it: builds a new tracker, and runs
   * it. `what` names the change for undo. Returns whether the new settings are in force.
   */
  async change(changed: Partial<Setup>, what: string): Promise<boolean> {
    let isDone = false;
    await this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      await this.#client.request('pause', undefined);
      const forget = this.checkpoint(text('labs.changeOf', { name: what }));
      const setup = { ...this.#setup, ...changed };
      this.#states.load(text('track.preparing'));
      try {
        const ready = await this.#client.request('rebuild', setup);
        this.#take(setup, ready);
        this.#results.startOver();
        this.#states.idle(text('labs.ready'));
        isDone = true;
        if (this.runs) await this.#client.request('play', undefined);
      } catch (error) {
        forget();
        // Cancelled: the engine is being restarted.
        if (this.#states.engineBroken) return;
        this.#onChange();
        this.#states.fail(text('track.settingsRejected', { what }), error);
      }
    });
    return isDone;
  }

  /**
   * Sets parameters, discards the surfaces tracked so far, and runs the tracker again from the first step that depends
   * on the changed parameters. If the values are in force already, nothing changes. `what` names the change for undo.
   */
  setParams(values: ParamValues, what: string): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return this.#onChange();
      // A value entered again changes nothing, and the surfaces tracked with it remain.
      if (Object.entries(values).every(([name, value]) => Object.is(this.params[name], value))) {
        this.#onChange();
        return;
      }
      const forget = this.checkpoint(text('labs.changeOf', { name: what }), what);
      try {
        const { params, iteration } = await this.#client.request('setParams', values);
        this.#setup = { ...this.#setup, params: { ...this.#setup.params, ...values } };
        this.#ready = { ...this.#ready, params };
        this.#inForce();
        this.#ui.page.banner.hide();
        this.#results.rewind(iteration);
        this.#states.idle(text(this.runs ? 'track.trackingAgain' : 'labs.ready'));
        this.#onChange();
        if (this.runs) await this.#client.request('play', undefined);
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail(text('labs.requestFailed'), error);
        this.#onChange();
        this.#ui.refuseParam(Object.keys(values)[0] ?? '', message);
      }
    });
  }

  /** Has the worker build a new tracker of the same image, which does not run yet; clears the undo history. */
  rebuild(): Promise<void> {
    return this.#states.enqueue(async () => {
      const ready = await this.#client.request('rebuild', this.#setup);
      this.#undo.clear();
      this.#take(this.#setup, ready);
      this.#results.startOver();
    });
  }

  /** Returns the present state and those to undo and redo, for a session; undefined if they cannot be saved. */
  moments(): Promise<Moments<TrackMoment> | undefined> {
    return this.#undo.moments();
  }

  /** Continues a session, whose image has been adopted. */
  async resume(moments: Moments<TrackMoment>): Promise<void> {
    this.#undo.adopt(moments);
    await this.#goTo(moments.now.saved, moments.now.page);
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      try {
        const moment = await this.#undo.step(way);
        if (moment) await this.#goTo(moment.saved, moment.page);
      } catch (error) {
        this.#states.fail(way === 'undo' ? text('labs.undoFailed') : text('labs.redoFailed'), error);
      }
    });
  }

  async #goTo(saved: SavedTrack, { record }: PageState): Promise<void> {
    // The worker has restored this state already; the reply contains its settings.
    const ready = await this.#client.request('restore', saved);
    const asBefore = JSON.stringify(saved.setup.preparation) === JSON.stringify(this.#setup.preparation);
    const volume = asBefore ? undefined : await this.#client.request('view', undefined);
    this.#take(saved.setup, { ...ready, volume });
    this.#results.restore(record, saved.iteration, saved.done);
    this.#onChange();
    await this.#client.request('sendState', undefined);
  }

  #take(setup: Setup, { volume, ...ready }: Ready): void {
    this.#setup = setup;
    this.#ready = ready;
    this.#inForce();
    if (volume) this.#onVolume(volume);
    this.#onChange();
  }

  #inForce(): void {
    const { window, threshold } = this.#ready.params;
    Object.assign(this.#results, { window: Number(window), threshold: Number(threshold), noise: this.#ready.noise });
  }
}
