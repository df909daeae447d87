/**
 * Shares the state of the Track lab as an address, saves its results as files, and opens a surface in the Sculpt lab.
 */

import { zipSync } from 'three/addons/libs/fflate.module.js';
import { text } from '../texts';
import type { TrackClient } from '../track/client';
import { copyAddress, FILE_NOTE, showAddress } from './address';
import type { LabStates } from './lab-states';
import type { OpenInLab } from './labs';
import { linkOf, toHash } from './track-link';
import { framesCsv } from './track-measures';
import type { TrackOpening } from './track-opening';
import type { TrackParts } from './track-parts';
import type { TrackResults } from './track-results';
import type { TrackSettings } from './track-settings';

export class TrackSharing {
  readonly #client: TrackClient;
  readonly #ui: TrackParts;
  readonly #states: LabStates;
  readonly #results: TrackResults;
  readonly #settings: TrackSettings;
  readonly #opening: TrackOpening;

  constructor(
    client: TrackClient,
    ui: TrackParts,
    states: LabStates,
    results: TrackResults,
    settings: TrackSettings,
    opening: TrackOpening,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#results = results;
    this.#settings = settings;
    this.#opening = opening;
  }

  /** Writes what is open and the settings in force into the page's address, so that it can be shared. */
  updateAddress(): void {
    const { source } = this.#opening;
    if (!source || (this.#states.value === 'loading' && !this.#states.ready)) return;
    const { example, name: file } = source;
    const { setup } = this.#settings;
    showAddress(toHash(linkOf({ example, file, setup, view: this.#ui.options.value })));
  }

  async copyLink(): Promise<void> {
    this.updateAddress();
    await copyAddress(this.#ui.status, [!this.#opening.source?.example && FILE_NOTE]);
  }

  save(what: 'frames' | 'animation' | 'table'): void {
    const work = { frames: () => this.#frames(), animation: () => this.#animation(), table: async () => this.#table() };
    work[what]().catch((error) => this.#states.fail(text('track.fileFailed'), error));
  }

  /** Opens the displayed frame's surface in the Sculpt lab, as a mesh to deform. */
  toSculpt(passOn: OpenInLab): void {
    const { frame } = this.#results;
    this.#client.request('export', { frame, format: 'ply' }).then(
      (bytes) =>
        passOn({
          lab: 'sculpt',
          name: text('track.frameName', { name: this.#ui.saving.name, frame: frame + 1 }),
          bytes,
          params: {},
        }),
      (error) => this.#states.fail(text('labs.toSculptFailed'), error),
    );
  }

  /** Saves the surfaces of all tracked frames as PLY files in one ZIP archive. */
  async #frames(): Promise<void> {
    const { frames } = this.#results;
    const files: Record<string, Uint8Array> = {};
    const digits = String(frames.length).length;
    for (const frame of frames.keys()) {
      const name = `frame-${String(frame + 1).padStart(digits, '0')}.ply`;
      files[name] = await this.#client.request('export', { frame, format: 'ply' });
    }
    // Fast compression: coordinates hardly compress anyway.
    this.#ui.saving.bytes('zip', zipSync(files, { level: 1 }), 'application/zip');
  }

  async #animation(): Promise<void> {
    this.#ui.saving.bytes('glb', await this.#client.request('animation', undefined), 'model/gltf-binary');
  }

  #table(): void {
    const { frames, truth } = this.#results;
    this.#ui.saving.bytes('csv', new TextEncoder().encode(framesCsv(frames, truth)), 'text/csv');
  }
}
