import type { ReconstructClient } from '../reconstruct/client';
import { text } from '../texts';
import type { LabStates } from './lab-states';
import type { ReconstructParts } from './reconstruct-parts';

/** Runs, pauses and steps the model of the Reconstruct lab. */
export class RunControl {
  readonly #client: ReconstructClient;
  readonly #ui: ReconstructParts;
  readonly #states: LabStates;

  constructor(client: ReconstructClient, ui: ReconstructParts, states: LabStates) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
  }

  async play(): Promise<void> {
    await this.#client.request('play', undefined);
  }

  toggle(): void {
    const running = this.#states.value === 'running';
    if (!running && !this.#states.canRun) return;
    this.#ui.banner.hide();
    this.ask(running ? this.#client.request('pause', undefined) : this.play());
  }

  step(steps: number): void {
    if (!this.#states.canRun) return;
    this.#ui.banner.hide();
    this.ask(this.#client.request('step', { count: steps }));
  }

  /** Shows an error message if a request fails, without waiting for the reply. */
  ask(request: Promise<unknown>): void {
    request.catch((error) => this.#states.fail(text('labs.requestFailed'), error));
  }
}
