import type { LabData, Loading, Opening, Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import { text } from '../../texts';
import { completed } from './before';
import type { ReconstructClient } from './client';
import { CLOUDS, type CloudExample } from './examples';
import { fromHash, type LinkedCloud, withLink } from './link';
import type { CloudChoice } from './panels/cloud-setup';
import type { Photograph } from './photographs';
import { NO_EDITS } from './picking';
import { type PointFiles as Data, fromExample, fromFiles } from './point-files';
import { type CloudVariant, cloudById, isCloudPreset } from './presets';
import type { Cloud, CloudSource, NamedBytes, ParamSpec, ParamValues, SavedSurface, Setup } from './protocol';
import type { ReconstructContent } from './schema';
import type { ReconstructSettings } from './settings';

export type CloudOrigin = Source<CloudExample, LinkedCloud, Data>;
export type ReconstructOpening = Opening<CloudExample, LinkedCloud, Data, OpenedCloud>;

/** Points opened in the Reconstruct lab, and the settings of their model, which the worker has built. */
export interface OpenedCloud {
  cloud: Cloud;
  params: ParamValues;
  photographs: Photograph[];
  setup: Setup;
  /** Source of the points; if only cameras were opened, that of the points already open. */
  from: CloudSource;
}

/** Points of the Reconstruct lab, with or without cameras and photographs, and how they are opened. */
export class ReconstructData implements LabData<CloudExample, LinkedCloud, Data, OpenedCloud> {
  readonly first = CLOUDS[0];
  readonly #client: ReconstructClient;
  readonly #settings: ReconstructSettings;
  readonly adopt: (opened: OpenedCloud, origin: CloudOrigin) => Promise<void>;
  /** Default parameters of the method; links contain only the parameters that differ. */
  defaults: ParamValues = {};

  /** `adopt` displays what was opened. */
  constructor(
    client: ReconstructClient,
    settings: ReconstructSettings,
    adopt: (opened: OpenedCloud, origin: CloudOrigin) => Promise<void>,
  ) {
    this.#client = client;
    this.#settings = settings;
    this.adopt = adopt;
  }

  onEngineReady(specs: ParamSpec[]): void {
    this.defaults = Object.fromEntries(specs.map(({ name, default: value }) => [name, value]));
  }

  find(id: string): CloudExample | undefined {
    return cloudById(id);
  }

  linkedBy(hash: string): LinkedCloud | undefined {
    return fromHash(hash);
  }

  fromExample(example: CloudExample): CloudOrigin {
    const name = 'file' in example.source ? example.source.file : example.source.shape;
    return { name, load: () => fromExample(example), example };
  }

  fromFiles(files: File[]): CloudOrigin {
    const points = files.find((file) => !/\.(json|png|jpe?g|webp)$/i.test(file.name))?.name;
    return { name: points ?? files.map((file) => file.name).join(' + '), load: () => fromFiles(files) };
  }

  async load(
    origin: CloudOrigin,
    { source, photographs }: Data,
    { present }: Loading<CloudExample, LinkedCloud, Data>,
  ): Promise<OpenedCloud> {
    const from = source ?? (await pointsOf(present));
    const saved = origin.session && savedIn(completed(contentOf<ReconstructContent>(origin.session, 'reconstruct')));
    const setup = saved?.setup ?? this.#setupFor(origin, source === undefined, present);
    const cameras = photographs.map(({ view }) => view);
    const loaded = await this.#client.request('load', { source: from, cameras, setup, saved });
    return { ...loaded, photographs, setup, from };
  }

  /**
   * Returns the source to open again after a failure of the engine: the opened one or, if only cameras were opened, the
   * present points with these cameras.
   */
  sourceToRemember(
    origin: CloudOrigin,
    { from, photographs }: OpenedCloud,
    { source }: Data,
    present: CloudOrigin | undefined,
  ): CloudOrigin {
    if (source) return origin;
    return { ...origin, name: present?.name ?? origin.name, load: async () => ({ source: from, photographs }) };
  }

  filesOf({ source, files = [] }: Data): NamedBytes[] {
    return source && 'file' in source && files.length === 0 ? [source.file] : files;
  }

  #setupFor(origin: CloudOrigin, samePoints: boolean, present: CloudOrigin | undefined): Setup {
    const { linked } = origin;
    const { params, ...choice } = this.#usual(origin, samePoints, present);
    return {
      params: { ...params, ...linked?.params },
      ...withLink(choice, linked ?? {}),
      edits: linked?.edits ?? NO_EDITS,
    };
  }

  /**
   * Returns the settings for newly opened data, before a link changes them: an example's own; for cameras alone, those
   * in force; for points from a file opened without a link, when those before were from a file, too, the settings in
   * force but the cell size; else the defaults.
   */
  #usual(
    { example, linked }: CloudOrigin,
    samePoints: boolean,
    present: CloudOrigin | undefined,
  ): CloudChoice & { params: ParamValues } {
    if (example) {
      const first = firstVariant(example);
      const params = { ...this.defaults, ...example.params, ...(linked ? {} : first?.params) };
      return { params, maxPoints: first?.maxPoints ?? example.maxPoints, keepComponents: example.keepComponents };
    }
    const { params, choice } = this.#settings;
    if (samePoints) return { params, ...choice };
    if (linked || !present || present.example)
      return { params: this.defaults, maxPoints: undefined, keepComponents: undefined };
    // The cell size is a length in the units of other points.
    const { cell: _, ...others } = params;
    return { params: others, ...choice };
  }
}

/**
 * Returns the points of a source, for cameras that are opened after them. Throws if there are none.
 */
async function pointsOf(present: CloudOrigin | undefined): Promise<CloudSource> {
  if (!present) throw new Error(text('reconstruct.camerasNeedPoints'));
  const { source } = await present.load();
  if (!source) throw new Error(text('reconstruct.camerasWithPoints'));
  return source;
}

const savedIn = ({ state, model }: ReconstructContent): SavedSurface => ({ ...model, state });

function firstVariant(example: CloudExample): CloudVariant | undefined {
  return isCloudPreset(example) ? example.variants[0] : undefined;
}
