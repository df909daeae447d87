import { toFailure } from '../../engine/failure';
import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import { boxOf, type VoxelBox } from './box';
import type { TrackClient } from './client';
import { isChosen } from './link';
import type { TrackParts } from './parts';
import type { Box, ObjectQuery, Proposal, Vec3 } from './protocol';
import type { TrackSettings } from './settings';

/** Milliseconds that the worker has to end a proposal before it is restarted. */
const PATIENCE_MS = 1000;

/** Called by {@link TrackAsking}. */
interface AskingEvents {
  /** Called when the lab begins or ends to ask. */
  onToggle: () => void;
  /** Called when settings were proposed, and are in force. */
  onProposed: (proposal: Proposal, query: ObjectQuery) => void;
  /** Called when the worker does not end a proposal that was cancelled. */
  onStuck: () => void;
  /** Returns the text for the status line in the present state. */
  describe: () => string;
}

/**
 * Asks for the object to track, by a click in a slice, a box or a button, and tracks it with the settings that the worker
 * proposes for it. Meanwhile the tracker does not run by itself after changes of the settings.
 */
export class TrackAsking {
  readonly #client: TrackClient;
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #settings: TrackSettings;
  readonly #events: AskingEvents;
  #box: Box | undefined;
  /** Whether settings are being proposed, or a tracker built with them. */
  #isBusy = false;

  constructor(client: TrackClient, ui: TrackParts, states: LabStates, settings: TrackSettings, events: AskingEvents) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#settings = settings;
    this.#events = events;
  }

  /** Whether the lab asks for the object. */
  get isOpen(): boolean {
    return this.#ui.object.isOpen.peek();
  }

  /** The box that was drawn to find an object in it, not in force yet. */
  get box(): Box | undefined {
    return this.#box;
  }

  begin(): void {
    const { object, options, view } = this.#ui;
    view.onPick = (point) => void this.propose({ point, frame: this.#ui.frames.frame });
    options.set({ ...options.value, below: 'slices', region: true });
    object.open();
    this.#toggled();
  }

  end(): void {
    this.#ui.view.onPick = undefined;
    this.#ui.object.close();
    this.#toggled();
  }

  #toggled(): void {
    this.#box = undefined;
    this.#settings.runs = !this.isOpen;
    this.#ui.region.asks.value = this.isOpen;
    this.#ui.object.hasBox.value = this.#settings.setup.box !== undefined;
    this.#ui.object.hasOther.value = isChosen(this.#settings.setup) || this.#settings.wasRun;
    this.#events.onToggle();
  }

  /** Takes over a box that was drawn, to find an object in it; undefined is the whole image. */
  draw(region: VoxelBox | undefined, affine: ArrayLike<number>): void {
    this.#box = region && boxOf(region, affine);
    this.#ui.object.hasBox.value = region !== undefined;
    this.#events.onToggle();
  }

  /** Finds the object at the crosshair in the frame shown. */
  here(): void {
    void this.propose({ point: this.#ui.view.crosshair.point, frame: this.#ui.frames.frame });
  }

  /** Finds what moves most. */
  moving(where: 'box' | 'image'): void {
    const box = this.#box ?? this.#settings.setup.box;
    void this.propose(where === 'box' && box ? { box } : {});
  }

  /** Has settings proposed for an object, and tracks it with them; a refusal is shown in words. */
  async propose(query: ObjectQuery): Promise<void> {
    if (!this.#states.canChange || this.#isBusy) return;
    this.#isBusy = true;
    try {
      const proposal = await this.#proposed(query);
      if (proposal) await this.#adopt(proposal, query);
    } finally {
      this.#isBusy = false;
    }
  }

  /**
   * Cancels the proposal; returns whether one was under way. If it is there already, and the tracker is being built with it,
   * it stays, but is not run.
   */
  cancel(): boolean {
    if (!this.#isBusy) return false;
    this.#settings.runs = false;
    const stuck = setTimeout(() => this.#isBusy && this.#events.onStuck(), PATIENCE_MS);
    const end = () => clearTimeout(stuck);
    this.#client.request('cancelProposal', undefined).then(end, end);
    return true;
  }

  async #proposed(query: ObjectQuery): Promise<Proposal | undefined> {
    let found: Proposal | undefined;
    await this.#states.enqueue(async () => {
      if (!this.#states.canChange) return;
      this.#ui.object.refusal.value = '';
      this.#states.load(text('track.proposing'));
      this.#settings.runs = true;
      try {
        found = await this.#client.request('propose', query);
        this.#states.restore(() => (found ? this.#events.describe() : text('labs.cancelled')));
      } catch (error) {
        this.#refuse(error, query);
      }
    });
    if (!found) this.#settings.runs = !this.isOpen;
    return found;
  }

  async #adopt(proposal: Proposal, query: ObjectQuery): Promise<void> {
    const { threshold, ...places } = proposal;
    const params = { ...this.#settings.setup.params, threshold };
    const isInForce = await this.#settings.change({ ...places, params }, text('track.objectChange'));
    const isCancelled = !this.#settings.runs;
    if (isInForce && !isCancelled) {
      this.end();
      this.#events.onProposed(proposal, query);
      return;
    }
    this.#toggled();
    if (isInForce) this.#ui.page.status.say(text('labs.cancelled'));
  }

  #refuse(error: unknown, query: ObjectQuery): void {
    // Cancelled: the engine is being restarted.
    if (this.#states.engineBroken) return;
    const { code, message } = toFailure(error);
    const refused = text('track.noProposal');
    if (code === 'internal') this.#states.fail(refused, error);
    else {
      this.#states.restore(() => refused);
      this.#ui.object.refusal.value = `${refused} ${adviceFor(query)} ${text('track.refusal', { message })}`;
    }
  }
}

/** Returns what to do if there is no proposal for an object. */
function adviceFor(query: ObjectQuery): string {
  if ('point' in query) return text('track.adviceForPoint');
  return text('box' in query ? 'track.adviceForBox' : 'track.adviceForMoving');
}

/** Returns the point to show after a proposal; undefined for one that was clicked, which is shown already. */
export function pointToShow({ at }: Proposal, query: ObjectQuery): Vec3 | undefined {
  return 'point' in query ? undefined : at;
}
