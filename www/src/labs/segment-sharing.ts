/** Shares the state of the Segment lab as an address, and saves label map and surfaces as files. */

import { zipSync } from 'three/addons/libs/fflate.module.js';
import type { SegmentClient } from '../segment/client';
import type { ParamValues, VolumeFormat } from '../segment/protocol';
import { text } from '../texts';
import { copyAddress, FILE_NOTE, showAddress } from './address';
import type { LabStates } from './lab-states';
import { Saving } from './saving';
import type { SegmentEditing } from './segment-editing';
import { linkOf, toHash } from './segment-link';
import type { SegmentOpening } from './segment-opening';
import type { SegmentParts, SurfaceFormat } from './segment-parts';

/** Extension and media type of the files of label maps. */
const MAPS: Record<VolumeFormat, [string, string]> = {
  nifti: ['nii.gz', 'application/gzip'],
  nrrd: ['seg.nrrd', 'application/octet-stream'],
  mha: ['mha', 'application/octet-stream'],
};

export class SegmentSharing {
  readonly #client: SegmentClient;
  readonly #ui: SegmentParts;
  readonly #states: LabStates;
  readonly #editing: SegmentEditing;
  readonly #opening: SegmentOpening;
  readonly #saving: Saving;
  /** Parameters of the surfaces in force. */
  params: ParamValues = {};

  constructor(
    client: SegmentClient,
    ui: SegmentParts,
    states: LabStates,
    editing: SegmentEditing,
    opening: SegmentOpening,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#editing = editing;
    this.#opening = opening;
    this.#saving = new Saving(
      async () => new Uint8Array(),
      (text) => ui.status.say(text),
    );
  }

  /** Name of the open volume, from which the names of saved files are derived. */
  set name(name: string) {
    this.#saving.name = name.replace(/^.*\//, '');
  }

  /** Writes what is open and the settings in force into the page's address, so that it can be shared. */
  updateAddress(): void {
    const { source, defaults } = this.#opening;
    if (!source || (this.#states.value === 'loading' && !this.#states.ready)) return;
    const { example, name: file } = source;
    const { params } = this;
    showAddress(toHash(linkOf({ example, file, params, defaults, view: this.#ui.options.value })));
  }

  async copyLink(): Promise<void> {
    this.updateAddress();
    await copyAddress(this.#ui.status, [!this.#opening.source?.example && FILE_NOTE, text('segment.linkLacksLabels')]);
  }

  saveMap(format: VolumeFormat): void {
    const [extension, type] = MAPS[format];
    this.#client
      .request('exportMap', { format, labels: this.#editing.labels })
      .then((bytes) => this.#saving.bytes(extension, bytes, type, '-labels'))
      .catch((error) => this.#states.fail(text('segment.saveFailed'), error));
  }

  saveSurfaces(format: SurfaceFormat): void {
    const saving = format === 'glb' ? this.#scene() : this.#archive(format);
    saving.catch((error) => this.#states.fail(text('segment.saveFailed'), error));
  }

  /** Saves the surfaces as one GLB, with a node for each label that has its name and colour. */
  async #scene(): Promise<void> {
    const { toGlb } = await import('../segment/glb');
    const bytes = await toGlb(this.#editing.labels, this.#ui.view.surfaces());
    this.#saving.bytes('glb', bytes, 'model/gltf-binary', '-labels');
  }

  /** Saves the surfaces as files of the same format, one a label, in a ZIP archive. */
  async #archive(format: Exclude<SurfaceFormat, 'glb'>): Promise<void> {
    const present = this.#ui.view.surfaces();
    const files: Record<string, Uint8Array> = {};
    for (const { value, name } of this.#editing.labels) {
      if (!present.has(value)) continue;
      const stem = `${value}-${name.replace(/[^\p{L}\p{N}]+/gu, '-')}`;
      files[`${stem}.${format}`] = await this.#client.request('exportMesh', { value, format });
    }
    this.#saving.bytes('zip', zipSync(files, { level: 1 }), 'application/zip', `-${format}`);
  }
}
