/** Shares the state of the Extract lab as an address, and opens its surface in the Sculpt lab. */

import type { Client } from '../client';
import { text } from '../texts';
import { copyAddress, FILE_NOTE, showAddress } from './address';
import type { ExtractOpening } from './extract-opening';
import type { ExtractParts } from './extract-parts';
import type { ExtractSettings } from './extract-settings';
import type { LabStates } from './lab-states';
import type { OpenInLab } from './labs';
import { ADDRESS, linkOf, toHash } from './link';

export class ExtractSharing {
  readonly #client: Client;
  readonly #ui: ExtractParts;
  readonly #states: LabStates;
  readonly #settings: ExtractSettings;
  readonly #opening: ExtractOpening;

  constructor(client: Client, ui: ExtractParts, states: LabStates, settings: ExtractSettings, opening: ExtractOpening) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#settings = settings;
    this.#opening = opening;
  }

  /** Writes what is open and the settings in force into the page's address, so that it can be shared. */
  updateAddress(): void {
    const { source, defaults } = this.#opening;
    if (!source || (this.#states.value === 'loading' && !this.#states.ready)) return;
    const hash = toHash(
      linkOf({
        example: source.example,
        file: source.name,
        choice: this.#ui.start.inForce,
        sphere: this.#settings.sphere,
        params: this.#settings.params,
        defaults,
        attractors: this.#settings.attractors,
        color: this.#ui.options.value.color,
      }),
    );
    // An empty address opens this lab, too, and may stay empty.
    if (hash !== ADDRESS || location.hash) showAddress(hash);
  }

  async copyLink(): Promise<void> {
    this.updateAddress();
    await copyAddress(this.#ui.status, [!this.#opening.source?.example && FILE_NOTE]);
  }

  /** Opens the extracted surface in the Sculpt lab, as a mesh to deform. */
  toSculpt(passOn: OpenInLab): void {
    this.#client.request('export', { format: 'ply' }).then(
      (bytes) =>
        passOn({ lab: 'sculpt', name: text('labs.surfaceName', { name: this.#ui.saving.name }), bytes, params: {} }),
      (error) => this.#states.fail(text('labs.toSculptFailed'), error),
    );
  }
}
