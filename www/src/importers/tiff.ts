/** Reads stacks of TIFF images, as written by microscopes and Fiji: pages of one file, or one file per slice. */
import { fromArrayBuffer, type GeoTIFFImage } from 'geotiff';
import type { VolumeInit, VoxelArray } from 'vesicle';
import type { NamedBytes } from '../protocol';
import { text } from '../texts';
import { Refusal } from '../worker/refusal';
import { describedIn, type Stack } from './tiff-description';

const KINDS = [Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array, Float32Array, Float64Array];

/**
 * Reads the volume from all pages of TIFF files, in the order of the file names; of several channels only the first.
 * Throws a `Refusal` if the images cannot be read, differ in size or are in colour.
 */
export async function readStack(files: NamedBytes[]): Promise<VolumeInit> {
  const byName = [...files].sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
  const pages = (await Promise.all(byName.map(pagesOf))).flat();
  const [first] = pages;
  if (!first) throw new Refusal('bad-file', text('files.tiffEmpty'));
  const stack = describedIn(String((await tagOf(first, 'ImageDescription')) ?? ''), pages.length);
  const planes = stack.pages.map((page) => pages[page]).filter((page) => page !== undefined);
  return joined(planes, stack, await pixelSize(first, stack));
}

async function pagesOf({ name, bytes }: NamedBytes): Promise<GeoTIFFImage[]> {
  try {
    const file = await fromArrayBuffer(bytes.slice().buffer);
    const count = await file.getImageCount();
    return await Promise.all(Array.from({ length: count }, (_, k) => file.getImage(k)));
  } catch (error) {
    throw new Refusal(
      'bad-file',
      text('files.tiffError', { name, reason: error instanceof Error ? error.message : String(error) }),
    );
  }
}

async function joined(planes: GeoTIFFImage[], stack: Stack, spacing: [number, number, number]): Promise<VolumeInit> {
  const [first] = planes;
  const [wide, high] = [first?.getWidth() ?? 0, first?.getHeight() ?? 0];
  let data: VoxelArray | undefined;
  for (const [k, plane] of planes.entries()) {
    if (plane.getWidth() !== wide || plane.getHeight() !== high)
      throw new Refusal('bad-file', text('files.tiffSizes', { page: k + 1, width: wide, height: high }));
    const values = await valuesOf(plane, k);
    data ??= new (values.constructor as new (length: number) => VoxelArray)(wide * high * planes.length);
    data.set(values, k * wide * high);
  }
  if (!data) throw new Refusal('bad-file', text('files.tiffEmpty'));
  const slices = planes.length / stack.frames;
  return { data, dims: [wide, high, slices, stack.frames], spacing, ...(stack.unit && { unit: stack.unit }) };
}

async function valuesOf(plane: GeoTIFFImage, k: number): Promise<VoxelArray> {
  if (plane.getSamplesPerPixel() !== 1) throw new Refusal('bad-file', text('files.tiffColour', { page: k + 1 }));
  const values = await plane.readRasters({ interleave: true });
  const kind = KINDS.find((Kind) => values instanceof Kind);
  if (!kind) throw new Refusal('bad-file', text('files.tiffFormat', { page: k + 1 }));
  return values as VoxelArray;
}

/** Returns the value of a tag of a TIFF page; undefined if the page has none of that name. */
async function tagOf(page: GeoTIFFImage, name: 'ImageDescription' | 'XResolution' | 'YResolution'): Promise<unknown> {
  const directory = page.getFileDirectory();
  return directory.hasTag(name) ? directory.loadValue(name) : undefined;
}

/**
 * Returns the voxel size along x, y and z: from the description, else 1 along z and, along x and y, the page's
 * resolution if it counts pixels per unit of the description (scanners store that of paper), else 1.
 */
async function pixelSize(page: GeoTIFFImage, { spacing, perUnit, scale }: Stack): Promise<[number, number, number]> {
  const resolution = async (tag: 'XResolution' | 'YResolution') => {
    const [count = 0, units = 0] = perUnit ? Array.from(((await tagOf(page, tag)) ?? []) as ArrayLike<number>) : [];
    return count > 0 && units > 0 ? (scale * units) / count : 1;
  };
  return [
    spacing[0] ?? (await resolution('XResolution')),
    spacing[1] ?? (await resolution('YResolution')),
    spacing[2] ?? 1,
  ];
}
