import { isOfSmall } from '../../engine/small-files';
import { nameOf, reading } from '../../importers/files';
import { dataUrl, fetchBytes } from '../../lab/downloads';
import type { LabData, Loading, Opening, Source } from '../../lab/opening';
import { contentOf } from '../../lab/session/content';
import type { Moments } from '../../lab/session/moments';
import type { TrackClient } from './client';
import { IMAGES, type TrackExample } from './examples';
import { fromHash, type LinkedTrack, setupOf } from './link';
import { imageById } from './presets';
import type { ImageSource, NamedBytes, OpenedImage as OpenedFilm, Setup } from './protocol';
import type { TrackContent } from './schema';
import type { TrackMoment } from './settings';

export type TrackSource = Source<TrackExample, LinkedTrack, ImageSource>;
export type TrackOpening = Opening<TrackExample, LinkedTrack, ImageSource, OpenedTrack>;

/** A 4D image opened in the Track lab, and the setup of its tracker. */
export interface OpenedTrack extends OpenedFilm {
  setup: Setup;
  /** The states of the session that is continued. */
  moments: Moments<TrackMoment> | undefined;
}

/** 4D images of the Track lab, and how trackers of them are built. */
export class TrackData implements LabData<TrackExample, LinkedTrack, ImageSource, OpenedTrack> {
  readonly first = IMAGES[0];
  readonly #client: TrackClient;
  readonly #present: () => Setup;
  readonly adopt: (opened: OpenedTrack, source: TrackSource, reopening: boolean) => Promise<void>;

  /**
   * `present` returns the setup in force, with which the image is opened again after a failure of the engine; `adopt`
   * displays what was opened.
   */
  constructor(
    client: TrackClient,
    present: () => Setup,
    adopt: (opened: OpenedTrack, source: TrackSource, reopening: boolean) => Promise<void>,
  ) {
    this.#client = client;
    this.#present = present;
    this.adopt = adopt;
  }

  find(id: string): TrackExample | undefined {
    return imageById(id);
  }

  linkedBy(hash: string): LinkedTrack | undefined {
    return fromHash(hash);
  }

  fromExample(example: TrackExample): TrackSource {
    return { name: example.name, load: () => imageOf(example), example };
  }

  fromFiles(files: File[]): TrackSource {
    return { name: nameOf(files), ...reading(files) };
  }

  voxelsOf({ volume }: OpenedTrack): number {
    return volume.voxels.length;
  }

  filesOf(source: ImageSource): NamedBytes[] {
    return 'files' in source ? source.files : [];
  }

  /** Ends a proposal, which opening would wait for. */
  superseded(): void {
    this.#client.request('cancelProposal', undefined).catch(() => undefined);
  }

  async load(
    { name, example, linked, session }: TrackSource,
    source: ImageSource,
    { reopening }: Loading<TrackExample, LinkedTrack, ImageSource>,
  ): Promise<OpenedTrack> {
    const moments = session && (await import('./session')).unpackTrack(contentOf<TrackContent>(session, 'track'));
    const saved = moments?.now.saved;
    const setup = saved?.setup ?? (reopening ? this.#present() : setupOf(example, linked));
    const isSmall = isOfSmall(session, 'files' in source ? source.files : undefined);
    return { ...(await this.#client.request('open', { name, source, setup, saved, isSmall })), setup, moments };
  }
}

async function imageOf({ source }: TrackExample): Promise<ImageSource> {
  if ('cine' in source) return source;
  return { files: [{ name: source.file, bytes: await fetchBytes(dataUrl(source.file)) }] };
}
