import { type Client, toFailure } from '../client';
import type { Attractor, Vec3 } from '../protocol';
import { AttractorControls } from '../ui/attractors';
import type { Stage } from '../view/stage';
import type { Rewinder } from './rewinder';

export interface AttractingEvents {
  /** Whether there is a model to attract. */
  ready: () => boolean;
  /** The model has taken attractors. */
  onTaken: () => void;
  onPlacing: (placing: boolean) => void;
}

/** Attractors from the list and the views to the model and back. */
export class Attracting {
  readonly #client: Client;
  readonly #stage: Stage;
  readonly #rewinder: () => Rewinder;
  readonly #events: AttractingEvents;
  readonly #controls: AttractorControls;
  /** Those the model has; the list may hold one that is being asked for. */
  #inForce: Attractor[] = [];

  constructor(client: Client, stage: Stage, rewinder: () => Rewinder, events: AttractingEvents) {
    this.#client = client;
    this.#stage = stage;
    this.#rewinder = rewinder;
    this.#events = events;
    this.#controls = new AttractorControls({
      onChange: (attractors, what, tuning) => void this.#change(attractors, what, tuning),
      onPlacing: (placing) => this.#setPlacing(placing),
      onGoTo: (point) => stage.goTo(point),
      crosshair: () => stage.crosshair,
    });
  }

  get element(): HTMLElement {
    return this.#controls.element;
  }

  get inForce(): Attractor[] {
    return this.#inForce;
  }

  /** The reach of the next one, in world units. */
  set radius(radius: number) {
    this.#controls.radius = radius;
  }

  /** Shows those that the model has already. */
  show(attractors: Attractor[]): void {
    this.#inForce = attractors;
    this.#controls.show(attractors);
    this.#stage.showAttractors(attractors);
  }

  add(point: Vec3): void {
    this.#controls.add(point);
  }

  async #change(attractors: Attractor[], what: string, tuning: boolean): Promise<void> {
    if (!this.#events.ready()) return this.#controls.show(this.#inForce);
    const forget = this.#rewinder().remember(what, tuning ? what : '');
    try {
      await this.#client.request('setAttractors', attractors);
      this.#inForce = attractors;
      this.#stage.showAttractors(attractors);
      this.#events.onTaken();
    } catch (error) {
      forget();
      this.show(this.#inForce);
      this.#controls.complain(toFailure(error).message);
    }
  }

  #setPlacing(placing: boolean): void {
    this.#stage.onPlace = placing ? (point) => this.add(point) : undefined;
    this.#events.onPlacing(placing);
  }
}
