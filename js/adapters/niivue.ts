/**
 * Adapter for NiiVue, 0.69 and 1.0-rc: converts its volumes, shows a surface in its view that follows a mesh, and shows
 * the surfaces of what is drawn in it.
 *
 * Nothing of NiiVue is imported: the caller passes its classes.
 *
 * @module vesicle/niivue
 */
import { invalid } from '../check.js';
import type { VolumeInit } from '../data.js';
import { affineOf, voxels } from './source.js';

export { type DrawingOptions, type FollowedDrawing, followDrawing } from './niivue-drawing.js';
export { type Niivue, NiivueSurface, type NiivueSurfaceOptions, type NVMeshClass } from './niivue-surface.js';
export type { AnyMesh, MeshSource, RemoteMeshSource } from './source.js';

/** The properties of a NiiVue volume, such as `nv.volumes[0]`, that {@link volumeFromNiivue} reads. */
export interface NiivueVolume {
  /** Voxels in the order of the file. */
  img?: unknown;
  hdr: {
    dims: number[];
    pixDims: number[];
    datatypeCode: number;
    xyzt_units: number;
    scl_slope: number;
    scl_inter: number;
    /** Rows of the transform from voxel index to world. */
    affine: number[][];
  } | null;
}

/**
 * Names of the NIfTI datatype codes with more than one number per voxel (colours and complex numbers), which are
 * rejected.
 */
const SEVERAL_NUMBERS: Record<number, string> = { 32: 'complex64', 128: 'RGB', 1792: 'complex128', 2304: 'RGBA' };

/** Seconds per unit of each NIfTI time unit code; 0, unknown, counts as seconds. */
const SECONDS: Record<number, number> = { 0: 1, 8: 1, 16: 1e-3, 24: 1e-6 };

/**
 * Converts a volume of NiiVue to the options of a `Volume`: `new Volume(volumeFromNiivue(nv.volumes[0]))`. World space
 * is NiiVue's: RAS, whatever the file says. All frames that NiiVue has loaded are included.
 *
 * @throws `VesicleError` `invalid-argument`: a volume that is not loaded, several numbers a voxel, or a voxel type that
 *   a `Volume` does not store.
 */
export function volumeFromNiivue(volume: NiivueVolume | undefined): VolumeInit {
  const { hdr, img } = Object(volume) as NiivueVolume;
  if (!hdr?.affine || !img) throw invalid('volume', 'must be a loaded volume of NiiVue, such as nv.volumes[0]');
  const several = SEVERAL_NUMBERS[hdr.datatypeCode];
  if (several) throw invalid('volume', `${several}; only one number per voxel is supported`);
  const grid = voxels(
    img,
    hdr.dims.slice(1, 4).map((count) => Math.max(1, count)),
  );
  const columns = [0, 1, 2, 3].map((column) => [0, 1, 2].map((row) => Number(hdr.affine[row]?.[column])));
  return {
    ...grid,
    affine: affineOf(columns, columns[3] ?? []),
    // NIfTI: a slope of 0 means no scaling.
    slope: hdr.scl_slope || 1,
    intercept: hdr.scl_inter || 0,
    space: 'RAS',
    ...secondsBetween(hdr, grid.dims[3] ?? 1),
  };
}

function secondsBetween(hdr: { pixDims: number[]; xyzt_units: number }, frames: number): { frameSeconds?: number } {
  const seconds = Number(hdr.pixDims[4]) * (SECONDS[hdr.xyzt_units & 0x38] ?? 0);
  return frames > 1 && seconds > 0 && Number.isFinite(seconds) ? { frameSeconds: seconds } : {};
}
