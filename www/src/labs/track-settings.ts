import { toFailure } from '../channel';
import type { ParamValues } from '../protocol';
import type { TrackClient } from '../track/client';
import type { Ready, SavedTrack, Setup, VolumeView } from '../track/protocol';
import type { LabStates } from './lab-states';
import { Rewinder } from './rewinder';
import type { TrackParts } from './track-parts';
import type { TrackRecord, TrackResults } from './track-results';

/** What the page holds beside the tracker, and undo brings back. */
interface PageState {
  record: TrackRecord;
}

/** How the image is prepared and tracked: changed here, handed to the worker, undone. */
export class TrackSettings {
  readonly #client: TrackClient;
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #results: TrackResults;
  readonly #onChange: () => void;
  readonly #onVolume: (volume: VolumeView) => void;
  readonly #rewinder: Rewinder<PageState, SavedTrack>;
  #setup: Setup = {
    preparation: { binning: 1, enrichment: 'none', factor: 0 },
    box: undefined,
    at: undefined,
    params: {},
  };
  #ready: Omit<Ready, 'volume'> = { params: {}, suggested: 1, noise: 0 };

  /** `onChange` hears whenever something else may be in force; `onVolume` of the image prepared in another way. */
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
    this.#rewinder = new Rewinder<PageState, SavedTrack>(
      client,
      () => ({ record: results.record() }),
      (undoable, redoable) => ui.transport.showUndo(undoable, redoable),
    );
  }

  /** As it was asked for: `params` are those that were not left to the method. */
  get setup(): Setup {
    return this.#setup;
  }

  /** All parameters as they are in force. */
  get params(): ParamValues {
    return this.#ready.params;
  }

  get suggested(): number {
    return this.#ready.suggested;
  }

  get noise(): number {
    return this.#ready.noise;
  }

  /** Another image: what was done to the former cannot be undone. */
  adopt(setup: Setup, ready: Ready): void {
    this.#rewinder.clear();
    this.#take(setup, ready);
  }

  /** Keeps what is, before it is changed. */
  remember(label: string, together = ''): () => void {
    return this.#rewinder.remember(label, together);
  }

  /** What a tracker is made with is changed: a new one, which runs. */
  change(changed: Partial<Omit<Setup, 'params'>>, what: string): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      await this.#client.request('pause', undefined);
      const forget = this.remember(`change of ${what}`);
      const setup = { ...this.#setup, ...changed };
      this.#states.load('Preparing the image.');
      try {
        const ready = await this.#client.request('rebuild', setup);
        this.#take(setup, ready);
        this.#results.startOver();
        this.#states.stand('Ready.');
        await this.#client.request('play', undefined);
      } catch (error) {
        forget();
        // Cancelled: the engine is being started again.
        if (this.#states.engineBroken) return;
        this.#onChange();
        this.#states.fail(`That ${what} cannot be.`, error);
      }
    });
  }

  /** All frames anew with the new value, as far as it makes a difference to them. */
  setParams(values: ParamValues, what: string): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      const forget = this.remember(`change of ${what}`, what);
      try {
        const { params, iteration } = await this.#client.request('setParams', values);
        this.#setup = { ...this.#setup, params: { ...this.#setup.params, ...values } };
        this.#ready = { ...this.#ready, params };
        this.#inForce();
        this.#ui.banner.hide();
        this.#results.rewind(iteration);
        this.#states.stand('Beginning again.');
        this.#onChange();
        await this.#client.request('play', undefined);
      } catch (error) {
        forget();
        const { code, message } = toFailure(error);
        if (code === 'internal') this.#states.fail('That did not work.', error);
        this.#onChange();
        this.#ui.refuseParam(Object.keys(values)[0] ?? '', message);
      }
    });
  }

  /** A new tracker of the same image, before its first step. */
  rebuild(): Promise<void> {
    return this.#states.inTurn(async () => {
      const ready = await this.#client.request('rebuild', this.#setup);
      this.#rewinder.clear();
      this.#take(this.#setup, ready);
      this.#results.startOver();
    });
  }

  travel(way: 'undo' | 'redo'): Promise<void> {
    return this.#states.inTurn(async () => {
      if (!this.#states.canChange) return;
      try {
        const moment = await this.#rewinder.travel(way);
        if (moment) await this.#goTo(moment.saved, moment.page);
      } catch (error) {
        this.#states.fail(way === 'undo' ? 'That could not be undone.' : 'That could not be done again.', error);
      }
    });
  }

  async #goTo(saved: SavedTrack, { record }: PageState): Promise<void> {
    // The worker went back to the state already; this tells what was in it.
    const ready = await this.#client.request('restore', saved);
    const asBefore = JSON.stringify(saved.setup.preparation) === JSON.stringify(this.#setup.preparation);
    const volume = asBefore ? undefined : await this.#client.request('view', undefined);
    this.#take(saved.setup, { ...ready, volume });
    this.#results.restore(record, saved.iteration, saved.done);
    this.#onChange();
    await this.#client.request('tell', undefined);
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
