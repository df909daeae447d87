// Options of reading mesh files, and of what is stated in written ones.
import { checkProperties, choice, invalid } from './check.js';
import type { LengthUnit, MeshExtra, MeshFileOptions, MeshTexture, NamedFile, Space, SpaceOptions } from './data.js';
import { checkedNamedFiles } from './input-file.js';
import { checkTexture } from './texture.js';
import type { Warning } from './warning.js';

const SPACES: readonly Space[] = ['RAS', 'LPS'];
const UNITS: readonly LengthUnit[] = ['m', 'mm', 'um'];

/** Names of the {@link SpaceOptions}. */
export const SPACE_OPTIONS = ['space', 'as', 'unit'] as const;

/** Returns space, space in the file, and unit for the WebAssembly module, empty where they are not given. */
export function checkedSpaceOptions({ space, as, unit }: SpaceOptions): [space: string, as: string, unit: string] {
  checkStated({ ...(space && { space }), ...(unit && { unit }) });
  if (as === undefined) return [space ?? '', '', unit ?? ''];
  choice('as', as, SPACES);
  if (space === undefined) throw invalid('as', 'needs space as well, that of the mesh');
  return [space, as, unit ?? ''];
}

/** Throws `invalid-argument` for a space or unit that there is not. */
export function checkStated({ space, unit }: Pick<MeshExtra, 'space' | 'unit'>): void {
  if (space !== undefined) choice('space', space, SPACES);
  if (unit !== undefined) choice('unit', unit, UNITS);
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
