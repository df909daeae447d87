/** Opens and prepares 4D images, and builds trackers of them. Used by the worker only. */
import { SurfaceTracker, VesicleError, Volume } from 'vesicle';
import { groupFiles } from '../../engine/file-groups';
import { beyondSmall, MOST_VOXELS_OF_SMALL, TRACK_OF_SMALL } from '../../engine/small-files';
import { checkSmallImage, readFiles } from '../../engine/volumes';
import { invert } from '../../scene/anatomy';
import { text } from '../../texts';
import { boxOf, voxelsOf } from './box';
import { cineVoxels } from './cine';
import type { ImageSource, NamedBytes, ObjectQuery, Preparation, Proposal, Setup } from './protocol';

/** Seconds between frames of a computed image. */
const CINE_SECONDS = 0.04;
/** Digits of a proposed threshold, which is shown, and is in links and code: far finer than it could be chosen. */
const THRESHOLD_DIGITS = 4;

/**
 * Opens a 4D image: reads it from files, or computes the phantom. One of a single frame is refused; if its files are small,
 * so is one of too many voxels.
 */
export async function openImage(source: ImageSource, isSmall = false): Promise<Volume> {
  if ('cine' in source) {
    const { dims, spacing, frames } = source.cine;
    return new Volume({
      data: cineVoxels(source.cine),
      dims: [...dims, frames],
      spacing,
      frameSeconds: CINE_SECONDS,
    });
  }
  const image = await fromParts(groupFiles(source.files), isSmall);
  if (image.frames > 1) return image;
  image.free();
  throw new VesicleError('invalid-argument', text('track.oneFrame'));
}

async function fromParts(parts: NamedBytes[][], isSmall: boolean): Promise<Volume> {
  const [first] = parts;
  if (!first) throw new VesicleError('bad-file', text('track.noHeader'));
  const opened = async (files: NamedBytes[]) => {
    const init = await readFiles(files);
    const [x, y, z, frames = 1] = init.dims;
    if (isSmall) checkSmallImage({ data: init.data, dims: [x, y, z, frames * parts.length] });
    return new Volume(init);
  };
  if (parts.length === 1) return opened(first);
  const frames: Volume[] = [];
  try {
    for (const files of parts) frames.push(await opened(files));
    return Volume.fromFrames(frames);
  } finally {
    for (const frame of frames) frame.free();
  }
}

/** Returns an error in words of the app: of an object that is too large for a tracker, what to do about it here. */
export function inWords(error: unknown): unknown {
  const isTooLarge = error instanceof VesicleError && error.code === 'too-large';
  return isTooLarge ? new VesicleError(error.code, text('track.tooLarge')) : error;
}

/** The most pixels that slices are apart once the library has chosen the factor itself, and its largest choice. */
const MOST_APART = 2.1;
const MAX_CHOSEN_FACTOR = 3;

/** Throws a `VesicleError` if small files would become an image that is too large for the memory of a page. */
export function checkSmall(
  { dims, frames, spacing }: Pick<Volume, 'dims' | 'frames' | 'spacing'>,
  preparation: Preparation,
): void {
  if (!enriches(preparation)) return;
  const [finest, middle, thickest] = [...spacing].sort((a, b) => a - b) as [number, number, number];
  const { binning } = preparation;
  const apart = thickest / ((binning * (finest + middle)) / 2);
  const factor = preparation.factor || Math.min(MAX_CHOSEN_FACTOR, Math.max(1, Math.ceil(apart / MOST_APART)));
  const voxels = (dims[0] * dims[1] * dims[2] * frames * factor) / binning ** 2;
  if (voxels <= MOST_VOXELS_OF_SMALL) return;
  throw new VesicleError('too-large', beyondSmall('track.smallTooLarge', voxels, MOST_VOXELS_OF_SMALL));
}

/**
 * Bins an image and inserts slices, as set in `preparation`; returns a new volume, or `image` itself if there is
 * nothing to do. `onStage` receives each step in words, for the status line.
 */
export function prepare(image: Volume, preparation: Preparation, onStage: (what: string) => void): Volume {
  const binned = binnedBy(image, preparation, onStage);
  if (!enriches(preparation)) return binned;
  try {
    return binned.enrichSlices(enrichmentOf(binned, preparation, onStage));
  } finally {
    if (binned !== image) binned.free();
  }
}

/** As {@link prepare}, with pauses; rejects with the signal's reason when it aborts. */
export async function prepareInSlices(
  image: Volume,
  preparation: Preparation,
  onStage: (what: string) => void,
  signal: AbortSignal,
): Promise<Volume> {
  const binned = binnedBy(image, preparation, onStage);
  if (!enriches(preparation)) return binned;
  try {
    return await binned.inSlices({ signal }).enrichSlices(enrichmentOf(binned, preparation, onStage));
  } finally {
    if (binned !== image) binned.free();
  }
}

function binnedBy(image: Volume, { binning }: Preparation, onStage: (what: string) => void): Volume {
  if (binning <= 1) return image;
  onStage(text('track.binning'));
  return image.binned(factorsOf(image, binning));
}

const enriches = ({ enrichment, factor }: Preparation) => enrichment !== 'none' && factor !== 1;

/** Returns the options of the interpolation of slices, once the user knows of it. */
function enrichmentOf({ frames }: Volume, { enrichment, factor }: Preparation, onStage: (what: string) => void) {
  onStage(text(enrichment === 'flow' ? 'track.enrichingFlow' : 'track.enrichingLinear', { frames }));
  const method = enrichment === 'flow' ? ('flow' as const) : ('linear' as const);
  return { method, ...(factor > 0 && { factor }) };
}

/**
 * Returns the binning factors along the three voxel axes, 1 across slices. Slices lie across the axis with the largest
 * spacing, or the last of several such axes.
 */
export function factorsOf({ spacing }: Pick<Volume, 'spacing'>, binning: number): [number, number, number] {
  const across = spacing.lastIndexOf(Math.max(...spacing));
  return [0, 1, 2].map((axis) => (axis === across ? 1 : binning)) as [number, number, number];
}

/** Returns the options of a tracker, without the edge threshold τ; `isSmall` tells whether the image is in small files. */
export function trackerOptions(
  { affine, dims }: Pick<Volume, 'affine' | 'dims'>,
  { box, at, cavity, params }: Setup,
  isSmall = false,
) {
  const { threshold: _, ...others } = params;
  const region = box && voxelsOf(box, invert(affine), dims);
  const voxels = region && { min: region.low, max: region.high };
  return {
    component: at ?? ('largest' as const),
    params: others,
    ...(voxels && { voxels }),
    ...(cavity === 'closed' && { cavity }),
    ...(isSmall && TRACK_OF_SMALL),
  };
}

/** Proposes settings for an object in a prepared image; rejects with the signal's reason when it aborts. */
export async function proposeFor(volume: Volume, query: ObjectQuery, signal: AbortSignal): Promise<Proposal> {
  const { options } = await SurfaceTracker.propose(volume, query, { signal });
  const { voxels, component: at, cavity, params } = options;
  const threshold = Number(params.threshold.toPrecision(THRESHOLD_DIGITS));
  return { box: boxOf({ low: voxels.min, high: voxels.max }, volume.affine), at, cavity, threshold };
}

function made(make: () => SurfaceTracker): SurfaceTracker {
  try {
    return make();
  } catch (error) {
    throw inWords(error);
  }
}

/**
 * Builds a tracker of a prepared image; also returns the tracker's default for the edge threshold τ, which the setup
 * may override.
 */
export function buildTracker(
  volume: Volume,
  setup: Setup,
  isSmall: boolean,
  state?: Uint8Array,
): { tracker: SurfaceTracker; suggested: number } {
  const tracker = made(() => new SurfaceTracker({ volume, ...trackerOptions(volume, setup, isSmall) }));
  try {
    const { threshold } = setup.params;
    const suggested = tracker.params.threshold;
    if (threshold !== undefined) tracker.setParams({ threshold: threshold as number });
    if (state) tracker.restore(state);
    return { tracker, suggested };
  } catch (error) {
    tracker.free();
    throw error;
  }
}
