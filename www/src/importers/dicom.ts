/**
 * Reads series of DICOM files with ITK: all transfer syntaxes supported by GDCM, with slices sorted along their normal.
 */
import { type Image, InterfaceTypes, runPipeline } from 'itk-wasm';
import type { VolumeInit, VoxelArray } from 'vesicle';
import type { NamedBytes } from '../protocol';
import { text } from '../texts';
import { Refusal } from '../worker/refusal';

const PIPELINE = 'read-image-dicom-file-series';

/**
 * Returns the options for itk-wasm: its program that reads DICOM is served beside the page, and runs in the calling
 * worker.
 */
export const options = () => ({ pipelineBaseUrl: new URL('./dicom', pageAddress()).href, webWorker: false });

/**
 * Returns the base address of the page that this worker belongs to: the worker's own file is in a subfolder of the
 * built page.
 */
function pageAddress(): string {
  return new URL(import.meta.env.DEV ? import.meta.env.BASE_URL : '../', self.location.href).href;
}

/**
 * Reads the volume from the DICOM files of one series, in world space LPS as in DICOM. Throws a `Refusal` if they
 * cannot be read or the voxels are not single numbers.
 */
export async function readSeries(files: NamedBytes[]): Promise<VolumeInit> {
  const paths = files.map((_, k) => `${k}.dcm`);
  const inputs = files.map(({ bytes }, k) => ({
    type: InterfaceTypes.BinaryFile,
    data: { path: paths[k] ?? '', data: bytes },
  }));
  const outputs = [{ type: InterfaceTypes.Image }, { type: InterfaceTypes.JsonCompatible }];
  const args = ['0', '1', '--memory-io', '--input-images', ...paths];
  const run = await runPipeline(PIPELINE, args, outputs, inputs, options()).catch((error: unknown) => {
    throw unreadable(files, error instanceof Error ? error.message : String(error));
  });
  const [image] = run.outputs ?? [];
  if (run.returnValue !== 0 || !image) throw unreadable(files, run.stderr);
  return volumeOf(image.data as Image);
}

function unreadable(files: NamedBytes[], reason: string): Refusal {
  const what = files.length === 1 ? text('files.thisFile') : text('files.theseFiles', { count: files.length });
  return new Refusal('bad-file', text('files.dicomUnreadable', { files: what, reason: firstLine(reason) }));
}

export const firstLine = (text: string) => text.trim().split('\n').at(-1)?.slice(0, 200) ?? '';

function volumeOf(image: Image): VolumeInit {
  const { components } = image.imageType;
  if (components !== 1) throw new Refusal('bad-file', text('files.dicomComponents', { components }));
  return { ...geometryOf(image), data: image.data as VoxelArray };
}

/** Returns the grid of an image, in world space LPS. */
export function geometryOf({ size, spacing, origin, direction }: Image): Omit<VolumeInit, 'data'> {
  const dims = [0, 1, 2].map((axis) => Number(size[axis] ?? 1)) as [number, number, number];
  return { dims, affine: affineOf(spacing, origin, Array.from(direction, Number)), space: 'LPS' };
}

/**
 * Returns the affine matrix from voxel indices to world space, column-major; ITK's direction matrix is row-major, with
 * the image axes in its columns.
 */
function affineOf(spacing: number[], origin: number[], direction: number[]): number[] {
  const column = (axis: number) => [0, 1, 2].map((row) => (direction[3 * row + axis] ?? 0) * (spacing[axis] ?? 1));
  return [...[0, 1, 2].flatMap((axis) => [...column(axis), 0]), ...[0, 1, 2].map((axis) => origin[axis] ?? 0), 1];
}
