/** Gives on what the Extract lab has: as an address, and to the Sculpt lab. */
import type { Client } from '../client';
import { copyAddress, FILE_LACKS, showAddress } from './address';
import type { ExtractOpening } from './extract-opening';
import type { ExtractParts } from './extract-parts';
import type { ExtractSettings } from './extract-settings';
import type { LabStates } from './lab-states';
import type { PassOn } from './labs';
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

  /** The page's address says what is open and how it is set. */
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
    // The lab without an address is this one, as it opens by itself.
    if (hash !== ADDRESS || location.hash) showAddress(hash);
  }

  async copyLink(): Promise<void> {
    this.updateAddress();
    await copyAddress(this.#ui.status, [!this.#opening.source?.example && FILE_LACKS]);
  }

  /** The surface as a mesh to be deformed. */
  toSculpt(passOn: PassOn): void {
    this.#client.request('export', { format: 'ply' }).then(
      (bytes) => passOn({ lab: 'sculpt', name: `${this.#ui.saving.name} (surface)`, bytes, params: {} }),
      (error) => this.#states.fail('The surface could not be passed on.', error),
    );
  }
}
