import { Opening, type Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { ContentOf } from '../../lab/session/schema';
import type { LabStates } from '../../lab/states';
import { text } from '../../texts';
import { completed } from './before';
import type { ReconstructClient } from './client';
import { CLOUDS, type CloudExample } from './examples';
import { fromHash, type LinkedCloud, withLink } from './link';
import type { CloudChoice } from './panels/cloud-setup';
import type { ReconstructParts } from './parts';
import type { Photograph } from './photographs';
import { NO_EDITS } from './picking';
import { type PointFiles as Data, fromExample, fromFiles } from './point-files';
import { type CloudVariant, cloudById, isCloudPreset } from './presets';
import type { Cloud, CloudSource, NamedBytes, ParamSpec, ParamValues, SavedSurface, Setup } from './protocol';
import type { ReconstructSettings } from './settings';

export type CloudOrigin = Source<CloudExample, LinkedCloud, Data>;

/** Points opened in the Reconstruct lab, and the settings of their model, which the worker has built. */
export interface OpenedCloud {
  cloud: Cloud;
  params: ParamValues;
  photographs: Photograph[];
  setup: Setup;
  /** Source of the points; if only cameras were opened, that of the points already open. */
  from: CloudSource;
}

/** Opens points in the Reconstruct lab, with or without cameras and photographs. */
export class ReconstructOpening extends Opening<CloudExample, LinkedCloud, Data, OpenedCloud> {
  protected readonly first = CLOUDS[0];
  readonly #client: ReconstructClient;
  readonly #settings: ReconstructSettings;
  readonly #onOpened: (opened: OpenedCloud, origin: CloudOrigin) => Promise<void>;
  /** Default parameters of the method; links contain only the parameters that differ. */
  defaults: ParamValues = {};

  constructor(
    client: ReconstructClient,
    ui: ReconstructParts,
    states: LabStates,
    settings: ReconstructSettings,
    onOpened: (opened: OpenedCloud, origin: CloudOrigin) => Promise<void>,
  ) {
    super(client, ui, states);
    this.#client = client;
    this.#settings = settings;
    this.#onOpened = onOpened;
  }

  protected override onEngineReady(specs: ParamSpec[]): void {
    this.defaults = Object.fromEntries(specs.map(({ name, default: value }) => [name, value]));
  }

  protected find(id: string): CloudExample | undefined {
    return cloudById(id);
  }

  protected linkedBy(hash: string): LinkedCloud | undefined {
    return fromHash(hash);
  }

  protected fromExample(example: CloudExample): CloudOrigin {
    const name = 'file' in example.source ? example.source.file : example.source.shape;
    return { name, load: () => fromExample(example), example };
  }

  protected fromFiles(files: File[]): CloudOrigin {
    const points = files.find((file) => !/\.(json|png|jpe?g|webp)$/i.test(file.name))?.name;
    return { name: points ?? files.map((file) => file.name).join(' + '), load: () => fromFiles(files) };
  }

  protected async load(origin: CloudOrigin, { source, photographs }: Data): Promise<OpenedCloud> {
    const from = source ?? (await this.#presentPoints());
    const saved = origin.session && savedIn(completed(contentOf(origin.session, 'reconstruct')));
    const setup = saved?.setup ?? this.#setupFor(origin, source === undefined);
    const cameras = photographs.map(({ view }) => view);
    const loaded = await this.#client.request('load', { source: from, cameras, setup, saved });
    return { ...loaded, photographs, setup, from };
  }

  /**
   * Returns the source to open again after a failure of the engine: the opened one or, if only cameras were opened, the
   * present points with these cameras.
   */
  protected override sourceToRemember(
    origin: CloudOrigin,
    { from, photographs }: OpenedCloud,
    { source }: Data,
  ): CloudOrigin {
    if (source) return origin;
    return { ...origin, name: this.source?.name ?? origin.name, load: async () => ({ source: from, photographs }) };
  }

  override filesOf({ source, files = [] }: Data): NamedBytes[] {
    return source && 'file' in source && files.length === 0 ? [source.file] : files;
  }

  protected adopt(opened: OpenedCloud, origin: CloudOrigin): Promise<void> {
    return this.#onOpened(opened, origin);
  }

  /**
   * Returns the source of the points that are open, for cameras that are opened after them. Throws if there are none.
   */
  async #presentPoints(): Promise<CloudSource> {
    if (!this.source) throw new Error(text('reconstruct.camerasNeedPoints'));
    const { source } = await this.source.load();
    if (!source) throw new Error(text('reconstruct.camerasWithPoints'));
    return source;
  }

  #setupFor(origin: CloudOrigin, samePoints: boolean): Setup {
    const { linked } = origin;
    const { params, ...choice } = this.#usual(origin, samePoints);
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
  #usual({ example, linked }: CloudOrigin, samePoints: boolean): CloudChoice & { params: ParamValues } {
    if (example) {
      const first = firstVariant(example);
      const params = { ...this.defaults, ...example.params, ...(linked ? {} : first?.params) };
      return { params, maxPoints: first?.maxPoints ?? example.maxPoints, keepComponents: example.keepComponents };
    }
    const { params, choice } = this.#settings;
    if (samePoints) return { params, ...choice };
    if (linked || !this.source || this.source.example)
      return { params: this.defaults, maxPoints: undefined, keepComponents: undefined };
    // The cell size is a length in the units of other points.
    const { cell: _, ...others } = params;
    return { params: others, ...choice };
  }
}

const savedIn = ({ state, model }: ContentOf<'reconstruct'>): SavedSurface => ({ ...model, state });

function firstVariant(example: CloudExample): CloudVariant | undefined {
  return isCloudPreset(example) ? example.variants[0] : undefined;
}
