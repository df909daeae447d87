import { isOfSmall } from '../../engine/small-files';
import { nameOf, reading } from '../../importers/files';
import { dataUrl, fetchBytes } from '../../lab/downloads';
import { Opening, type Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { Moments } from '../../lab/session/moments';
import type { LabStates } from '../../lab/states';
import type { TrackClient } from './client';
import { IMAGES, type TrackExample } from './examples';
import { fromHash, type LinkedTrack, setupOf } from './link';
import type { TrackParts } from './parts';
import { imageById } from './presets';
import type { ImageSource, NamedBytes, OpenedImage as OpenedFilm, Setup } from './protocol';
import type { TrackMoment } from './settings';

export type TrackSource = Source<TrackExample, LinkedTrack, ImageSource>;

/** A 4D image opened in the Track lab, and the setup of its tracker. */
export interface OpenedTrack extends OpenedFilm {
  setup: Setup;
  /** The states of the session that is continued. */
  moments: Moments<TrackMoment> | undefined;
}

/** Opens 4D images in the Track lab, and builds trackers of them. */
export class TrackOpening extends Opening<TrackExample, LinkedTrack, ImageSource, OpenedTrack> {
  protected readonly first = IMAGES[0];
  readonly #client: TrackClient;
  readonly #present: () => Setup;
  readonly #onOpened: (opened: OpenedTrack, source: TrackSource, reopening: boolean) => Promise<void>;

  /** `present` returns the setup in force, with which the image is opened again after a failure of the engine. */
  constructor(
    client: TrackClient,
    ui: TrackParts,
    states: LabStates,
    present: () => Setup,
    onOpened: (opened: OpenedTrack, source: TrackSource, reopening: boolean) => Promise<void>,
  ) {
    super(client, ui, states);
    this.#client = client;
    this.#present = present;
    this.#onOpened = onOpened;
  }

  protected find(id: string): TrackExample | undefined {
    return imageById(id);
  }

  protected linkedBy(hash: string): LinkedTrack | undefined {
    return fromHash(hash);
  }

  protected fromExample(example: TrackExample): TrackSource {
    return { name: example.name, load: () => imageOf(example), example };
  }

  protected fromFiles(files: File[]): TrackSource {
    return { name: nameOf(files), ...reading(files) };
  }

  protected override voxelsOf({ volume }: OpenedTrack): number {
    return volume.voxels.length;
  }

  override filesOf(source: ImageSource): NamedBytes[] {
    return 'files' in source ? source.files : [];
  }

  /** Ends a proposal, which opening would wait for. */
  protected override superseded(): void {
    this.#client.request('cancelProposal', undefined).catch(() => undefined);
  }

  protected async load(
    { name, example, linked, session }: TrackSource,
    source: ImageSource,
    reopening: boolean,
  ): Promise<OpenedTrack> {
    const moments = session && (await import('./session')).unpackTrack(contentOf(session, 'track'));
    const saved = moments?.now.saved;
    const setup = saved?.setup ?? (reopening ? this.#present() : setupOf(example, linked));
    const isSmall = isOfSmall(session, 'files' in source ? source.files : undefined);
    return { ...(await this.#client.request('open', { name, source, setup, saved, isSmall })), setup, moments };
  }

  protected adopt(opened: OpenedTrack, source: TrackSource, reopening: boolean): Promise<void> {
    return this.#onOpened(opened, source, reopening);
  }
}

async function imageOf({ source }: TrackExample): Promise<ImageSource> {
  if ('cine' in source) return source;
  return { files: [{ name: source.file, bytes: await fetchBytes(dataUrl(source.file)) }] };
}
