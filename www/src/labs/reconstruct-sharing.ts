import type { ReconstructClient } from '../reconstruct/client';
import { text } from '../texts';
import { copyAddress, FILE_NOTE, showAddress } from './address';
import type { LabStates } from './lab-states';
import type { OpenInLab } from './labs';
import { fits, linkOf, toHash } from './reconstruct-link';
import type { ReconstructOpening } from './reconstruct-opening';
import type { ReconstructParts } from './reconstruct-parts';
import type { ReconstructSettings } from './reconstruct-settings';

/**
 * Number of voxels along the longest side of the volume in which the implicit function f is saved, or passed on to the
 * Extract lab.
 */
const VOLUME_SIZE = 96;

/**
 * Shares the state of the Reconstruct lab as an address, saves the implicit function f as a volume, and passes volume
 * or surface to other labs.
 */
export class ReconstructSharing {
  readonly #client: ReconstructClient;
  readonly #ui: ReconstructParts;
  readonly #states: LabStates;
  readonly #settings: ReconstructSettings;
  readonly #opening: ReconstructOpening;

  constructor(
    client: ReconstructClient,
    ui: ReconstructParts,
    states: LabStates,
    settings: ReconstructSettings,
    opening: ReconstructOpening,
  ) {
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
    const { choice, params, edits } = this.#settings;
    const linked = linkOf({
      example: source.example,
      file: source.name,
      choice,
      params,
      defaults,
      edits,
      color: this.#ui.options.value.color,
      photo: this.#ui.photos.chosen,
    });
    showAddress(toHash(linked));
  }

  async copyLink(): Promise<void> {
    this.updateAddress();
    const fit = fits(this.#settings.edits);
    await copyAddress(this.#ui.status, [
      !this.#opening.source?.example && FILE_NOTE,
      !fit && text('reconstruct.linkLacksEdits'),
    ]);
  }

  saveVolume(): void {
    this.#tryTo(async () => {
      const { bytes } = await this.#client.request('volume', { size: VOLUME_SIZE });
      this.#ui.saving.bytes('nii', bytes, 'application/octet-stream');
    });
  }

  /**
   * Opens the implicit function f in the Extract lab as a volume, with the value of f at the surface as iso value;
   * inside the surface, f is above it.
   */
  toExtract(passOn: OpenInLab): void {
    this.#ui.status.say(text('reconstruct.samplingVolume'));
    this.#tryTo(async () => {
      const { bytes, level } = await this.#client.request('volume', { size: VOLUME_SIZE });
      passOn({
        lab: 'extract',
        name: text('reconstruct.volumeName', { name: this.#ui.saving.name }),
        bytes,
        params: { iso: level, isoForce: -1 },
      });
    });
  }

  /** Opens the reconstructed surface in the Sculpt lab, as a mesh to deform. */
  toSculpt(passOn: OpenInLab): void {
    this.#tryTo(async () => {
      const bytes = await this.#client.request('export', { format: 'ply' });
      passOn({ lab: 'sculpt', name: text('labs.surfaceName', { name: this.#ui.saving.name }), bytes, params: {} });
    }, text('labs.toSculptFailed'));
  }

  #tryTo(work: () => Promise<void>, title = text('reconstruct.volumeFailed')): void {
    work().catch((error) => this.#states.fail(title, error));
  }
}
