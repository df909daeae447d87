// Options of reading mesh files, and of what is stated in written ones.
import { checkProperties, choice, invalid } from './check.js';
import type { LengthUnit, MeshExtra, MeshFileOptions, MeshTexture, NamedFile, Space, SpaceOptions } from './data.js';
import { VesicleError } from './error.js';
import { checkedNamedFiles } from './input-file.js';
import { checkTexture } from './texture.js';
import type { Warning } from './warning.js';

const SPACES: readonly Space[] = ['RAS', 'LPS'];
const UNITS: readonly LengthUnit[] = ['m', 'mm', 'um'];

/** The known space and unit of positions. */
export type MeshFrame = Pick<MeshExtra, 'space' | 'unit'>;

/** Returns the known space and unit of positions in the world of a volume or mesh; none for undefined. */
export function frameOf(
  one: { readonly space: Space | undefined; readonly unit: LengthUnit | undefined } | undefined,
): MeshFrame {
  return { ...(one?.space && { space: one.space }), ...(one?.unit && { unit: one.unit }) };
}

/** Names of the {@link SpaceOptions}. */
export const SPACE_OPTIONS = ['space', 'as', 'unit'] as const;

/**
 * Returns space, space in the file, and unit for the WebAssembly module, empty for none; those of `known` by default. A glb
 * is turned by default only if it can be in metres, as glTF wants it: volumes made from numbers alone have a space, too.
 */
export function checkedSpaceOptions(
  given: SpaceOptions,
  known: MeshFrame,
  isGlb: boolean,
): [space: string, as: string, unit: string] {
  const { as } = given;
  const unit = given.unit === null ? undefined : (given.unit ?? known.unit);
  const isKept = isGlb && unit === undefined && as === undefined;
  const space = given.space === null ? undefined : (given.space ?? (isKept ? undefined : known.space));
  checkStated({ ...(space && { space }), ...(unit && { unit }) });
  if (as === undefined) return [space ?? '', '', unit ?? ''];
  choice('as', as, SPACES);
  if (space === undefined) throw invalid('as', 'needs space as well, that of the mesh, which is not known');
  return [space, as, unit ?? ''];
}

/** Throws `invalid-argument` for a space or unit that there is not. */
export function checkStated({ space, unit }: MeshFrame): void {
  if (space !== undefined) choice('space', space, SPACES);
  if (unit !== undefined) choice('unit', unit, UNITS);
}

/** Calls a function that reads a mesh; an error about compressed glTF also says what decompresses it. */
export function sayingHow<T>(read: () => T): T {
  try {
    return read();
  } catch (error) {
    if (!(error instanceof VesicleError && /without Draco or meshopt/.test(error.message))) throw error;
    throw new VesicleError(error.code, `${error.message}, or decompress it before by decompressGltf of vesicle/gltf`);
  }
}

/** Returns the options of reading a mesh file; throws `invalid-argument` naming the one that is wrong. */
export function checkedFileOptions(options: MeshFileOptions | undefined): {
  texture: MeshTexture | undefined;
  files: NamedFile[];
} {
  const { texture, files = [] } = checkProperties('options', options, ['texture', 'files']);
  checkTexture(texture);
  return { texture, files: checkedNamedFiles('files', files) };
}

/** Returns what a file states besides its mesh, with only those properties that it has. */
export function stated(file: {
  space(): string;
  unit(): string;
  warnings(): unknown;
}): Pick<MeshExtra, 'space' | 'unit' | 'warnings'> {
  const [space, unit, warnings] = [file.space(), file.unit(), file.warnings() as Warning[]];
  return {
    ...(space !== '' && { space: space as Space }),
    ...(unit !== '' && { unit: unit as LengthUnit }),
    ...(warnings.length > 0 && { warnings }),
  };
}
