/**
 * Opens volumes larger than memory in the Extract lab's worker. They need the whole library, whose models can read
 * parts of a volume: this file is loaded when the first one is opened.
 */
import { VesicleError } from 'vesicle/channel';
import init, { DeformableModel, type Volume } from 'vesicle/index';
import { openZarr, type ZarrVolume } from 'vesicle/zarr';
import type { VolumeView } from '../../engine/protocol';
import { areSmall, CACHE_OF_SMALL } from '../../engine/small-files';
import { viewOf } from '../../engine/volumes';
import { text } from '../../texts';
import { modelOptions, withAttractors } from './models';
import type { LargeSource, Setup } from './protocol';

/** An OME-Zarr image, and its coarsest level as a volume, which the page displays. */
export class LargeVolume {
  readonly #image: ZarrVolume;
  readonly #coarsest: Volume;
  /** Number of bytes of all levels. */
  readonly bytes: number;

  private constructor(image: ZarrVolume, coarsest: Volume) {
    this.#image = image;
    this.#coarsest = coarsest;
    this.bytes = image.loaded().reduce((sum, level) => sum + level.of.bytes, 0);
  }

  /** Opens an image, and reads its coarsest level. */
  static async open({ zarr }: LargeSource, signal: AbortSignal): Promise<LargeVolume> {
    await init();
    const isSmall = zarr instanceof Blob && areSmall([zarr]);
    const image = await openZarr(zarr, { signal, ...(isSmall && { cache: CACHE_OF_SMALL }) });
    try {
      const last = image.levels.length - 1;
      const max = image.levels[last]?.dims ?? [0, 0, 0];
      // Opening has not read a coarsest level that is too large.
      if (!image.range) throw new VesicleError('too-large', text('extract.largeCoarsest', { dims: max.join(' × ') }));
      return new LargeVolume(image, await image.region(last, { min: [0, 0, 0], max }, { signal }));
    } catch (error) {
      image.free();
      throw error;
    }
  }

  /** Number of levels coarser than the finest. */
  get coarserLevels(): number {
    return this.#image.levels.length - 1;
  }

  /** Describes the image, with the voxels of its coarsest level. */
  view(name: string): VolumeView {
    const levels = this.#image.levels.map(({ dims }) => dims);
    return { ...viewOf(this.#coarsest, name), large: { levels, bytes: this.bytes } };
  }

  /** Builds a model that starts on the coarsest level, and ends as many levels below as the set-up says. */
  model(setup: Setup, isSmall?: boolean): DeformableModel {
    const coarser = this.coarserLevels;
    if (setup.levels > coarser)
      throw new VesicleError('invalid-argument', text('extract.largeLevels', { most: coarser }));
    const { levels, ...options } = modelOptions(this.#coarsest, setup, isSmall);
    const image = { volume: this.#image, finest: coarser - levels, ...(setup.box && { box: setup.box }) };
    return withAttractors(setup, () => new DeformableModel({ ...options, ...image }));
  }

  free(): void {
    this.#image.free();
    this.#coarsest.free();
  }
}
