/** Reads photographs with their cameras and masks, for the Reconstruct lab. */

import { checkPictures } from '../../scene/picture-size';
import { text } from '../../texts';
import type { CameraView } from './protocol';

/** A camera and its photograph, if there is one: as data for the worker, and as an image for the page. */
export interface Photograph {
  name: string;
  view: CameraView;
  picture?: ImageBitmap;
}

/** One camera in a cameras.json file: `P` is its 3 × 4 projection from world to pixels, row by row, nested or flat. */
interface CameraEntry {
  image?: string;
  mask?: string;
  P?: number[] | number[][];
  width?: number;
  height?: number;
}

interface CameraFile {
  width?: number;
  height?: number;
  cameras: CameraEntry[];
}

/** Function that returns the file with a name given in the list of cameras; undefined if there is none. */
export type FileByName = (name: string) => Promise<Blob | undefined>;

/** Red value of a mask's pixel, 0 to 255, below which the photograph's pixel is masked out. */
const MASKED = 128;

/**
 * Reads all cameras of a list, `json`, and the photographs and masks that are available. Throws if the list is
 * malformed, the size of an image is unknown, a photograph or its mask cannot be decoded, or a photograph does not fit
 * its camera.
 */
export async function readPhotographs(json: string, fileOf: FileByName): Promise<Photograph[]> {
  const file = parseCameras(json);
  const named = async (name: string | undefined) => (name ? await fileOf(name) : undefined);
  const pictures = await Promise.all(
    file.cameras.map(async ({ image, mask }) => ({ image: await named(image), mask: await named(mask) })),
  );
  await checkPictures(pictures.flatMap(({ image, mask }) => [image ?? [], mask ?? []].flat()));
  return Promise.all(file.cameras.map((entry, i) => readOne(entry, i, file, pictures[i] ?? {})));
}

function parseCameras(json: string): CameraFile {
  let file: Partial<CameraFile>;
  try {
    file = JSON.parse(json) as Partial<CameraFile>;
  } catch {
    throw new Error(text('reconstruct.camerasNoJson'));
  }
  if (!Array.isArray(file?.cameras)) throw new Error(text('reconstruct.camerasMissing'));
  return file as CameraFile;
}

async function readOne(
  entry: CameraEntry,
  i: number,
  file: CameraFile,
  { image, mask }: { image?: Blob | undefined; mask?: Blob | undefined },
): Promise<Photograph> {
  const projection = (entry.P ?? []).flat();
  if (projection.length !== 12 || !projection.every(Number.isFinite))
    throw new Error(text('reconstruct.cameraNeedsP', { number: i + 1 }));
  const name = entry.image ?? text('reconstruct.camera', { number: i + 1 });
  const picture = image && (await decode(image, name));
  const width = entry.width ?? file.width ?? picture?.width ?? 0;
  const height = entry.height ?? file.height ?? picture?.height ?? 0;
  if (picture && (picture.width !== width || picture.height !== height))
    throw new Error(
      text('reconstruct.photoSize', {
        name,
        width: picture.width,
        height: picture.height,
        cameraWidth: width,
        cameraHeight: height,
      }),
    );
  if (!(width > 0 && height > 0)) throw new Error(text('reconstruct.cameraSizeMissing', { number: i + 1 }));
  const view: CameraView = { projection, width, height };
  if (!picture) return { name, view };
  const pixels = pixelsOf(picture);
  if (mask) applyMask(pixels, pixelsOf(await decode(mask, entry.mask ?? '')));
  return { name, view: { ...view, image: pixels.data as Uint8ClampedArray<ArrayBuffer> }, picture };
}

async function decode(blob: Blob, name: string): Promise<ImageBitmap> {
  try {
    return await createImageBitmap(blob, { premultiplyAlpha: 'none', colorSpaceConversion: 'none' });
  } catch {
    throw new Error(text('reconstruct.photoUnreadable', { name }));
  }
}

function pixelsOf(picture: ImageBitmap): ImageData {
  const context = new OffscreenCanvas(picture.width, picture.height).getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error(text('reconstruct.pixelsUnreadable'));
  context.drawImage(picture, 0, 0);
  return context.getImageData(0, 0, picture.width, picture.height);
}

/** Makes all pixels transparent that are dark in the mask; a mask with another number of pixels is ignored. */
function applyMask(pixels: ImageData, mask: ImageData): void {
  if (mask.data.length !== pixels.data.length) return;
  for (let i = 0; i < pixels.data.length; i += 4) if ((mask.data[i] ?? 0) < MASKED) pixels.data[i + 3] = 0;
}
