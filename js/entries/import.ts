/**
 * The readers of volume, mesh and point files in a small WebAssembly module of their own, for the entry points with one
 * method, which have none. Results are plain data: `new Volume(parseVolume(bytes))`.
 *
 * Each call runs in a new instance of the module, whose memory is given back after it.
 *
 * @module vesicle/import
 */
import { typedArray } from '../check.js';
import type {
  LengthUnit,
  MeshData,
  MeshFileOptions,
  PointArray,
  PointData,
  Space,
  VolumeFileOptions,
  VolumeInit,
  VoxelArray,
} from '../data.js';
import { MeshFile, NamedFile, VolumeFile } from '../files.js';
import { checkedFileOptions, sayingHow, stated } from '../mesh-file.js';
import { parsePoints as points } from '../points.js';
import { call, restart } from '../runtime.js';
import { noted } from '../small-files.js';
import { rawTexture, textureOf } from '../texture.js';
import { bytesOf, readerArguments } from '../volume-file.js';
import type { Warning } from '../warning.js';

export type {
  LengthUnit,
  MeshData,
  MeshExtra,
  MeshFileOptions,
  MeshTexture,
  NamedFile,
  PointData,
  Space,
  TextureType,
  Vec3,
  VolumeFileOptions,
  VolumeInit,
  VoxelArray,
} from '../data.js';
export { type ErrorCode, VesicleCrash, VesicleError } from '../error.js';
export { type InitInput, init as default, initSync, type ModuleOptions } from '../runtime.js';
export type { Warning, WarningCode } from '../warning.js';

/**
 * Parses a volume file like `Volume.parse` of `vesicle`, and returns what the constructor of `Volume` takes.
 *
 * @param options - `data`: the bytes of the file with the voxels, if `bytes` is a detached header. `files`: the files
 *   beside the header instead, among which those that it names are found. `space`: orientation of the world axes, for
 *   files that do not tell it.
 * @throws {@link VesicleError} `bad-file` naming the format and the field, or the files that are missing or of the wrong
 *   size; `too-large`.
 */
export function parseVolume(bytes: Uint8Array, options?: VolumeFileOptions): VolumeInit {
  const given = readerArguments(bytes, options);
  const volume = inOwnInstance(() => volumeData(VolumeFile.parse(...given)));
  noted(volume.data, bytesOf(given));
  return volume;
}

/**
 * Parses a mesh file like `Mesh.parse` of `vesicle`, and returns what `Mesh.fromArrays` takes:
 * `const { positions, indices, ...extra } = parseMesh(bytes)`.
 *
 * @param options - `texture`: the image of a file that has it in a separate file (obj, ply). `files`: buffers and images
 *   beside a gltf, found by their names.
 * @throws {@link VesicleError} `bad-file` naming the format and the field, or the file that is missing; `too-large`;
 *   `invalid-argument`.
 */
export function parseMesh(bytes: Uint8Array, options?: MeshFileOptions): MeshData {
  typedArray('bytes', bytes, Uint8Array);
  const { texture, files } = checkedFileOptions(options);
  return sayingHow(() =>
    inOwnInstance(() => {
      const beside = files.map(({ name, bytes }) => new NamedFile(name, bytes));
      return meshData(MeshFile.parse(bytes, rawTexture(texture), beside));
    }),
  );
}

/**
 * Parses a point file like `parsePoints` of `vesicle`.
 *
 * @throws {@link VesicleError} `bad-file` naming the format and the line or field.
 */
export function parsePoints(bytes: Uint8Array): PointData {
  return inOwnInstance(() => points(bytes));
}

/**
 * Calls `work` in a new instance, and gives back the memory it used, which is several times the size of the file. The
 * first instance is not used: the promise of {@link init} refers to it for good.
 */
function inOwnInstance<T>(work: () => T): T {
  restart();
  try {
    return call(work);
  } finally {
    restart();
  }
}

function volumeData(file: VolumeFile): VolumeInit {
  const [nx = 0, ny = 0, nz = 0] = file.dims();
  const [frames, frameSeconds, unit] = [file.frames(), file.frameSeconds(), file.unit()];
  const warnings = file.warnings() as Warning[];
  return {
    data: file.voxels() as VoxelArray,
    dims: frames > 1 ? [nx, ny, nz, frames] : [nx, ny, nz],
    affine: file.affine(),
    slope: file.slope(),
    intercept: file.intercept(),
    ...(frameSeconds > 0 && { frameSeconds }),
    space: file.space() as Space,
    ...(unit !== '' && { unit: unit as LengthUnit }),
    ...(warnings.length > 0 && { warnings }),
  };
}

function meshData(file: MeshFile): MeshData {
  const [normals, uvs, cornerUvs, colors] = [file.normals(), file.uvs(), file.cornerUvs(), file.colors()];
  const texture = file.texture();
  return {
    positions: file.positions() as PointArray,
    indices: file.indices(),
    ...(normals && { normals }),
    ...(uvs && { uvs }),
    ...(cornerUvs && { cornerUvs }),
    ...(colors && { colors }),
    ...(texture && { texture: textureOf(texture) }),
    ...stated(file),
  };
}
