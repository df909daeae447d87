// Checks the options of reading a volume file.
import { checkProperties, choice, denseCopy, invalid, typedArray } from './check.js';
import type { NamedFile, VolumeFileOptions } from './data.js';

/** Arguments of the readers in the WebAssembly module: file, data, names and contents of the files beside it, space. */
export type ReaderArguments = [
  Uint8Array,
  Uint8Array | undefined,
  string[] | undefined,
  Uint8Array[],
  string | undefined,
];

/** Returns the arguments for the readers; throws `invalid-argument` naming the option that is wrong. */
export function readerArguments(bytes: Uint8Array, options: VolumeFileOptions | undefined): ReaderArguments {
  const { data, files, space } = checkProperties<VolumeFileOptions>('options', options, ['data', 'files', 'space']);
  typedArray('bytes', bytes, Uint8Array);
  if (data !== undefined) typedArray('data', data, Uint8Array);
  if (space !== undefined) choice('space', space, ['RAS', 'LPS']);
  if (data !== undefined && files !== undefined) throw invalid('files', 'give either data or files');
  const beside = files && denseCopy('files', files).map((file, index) => checkedFile(`files[${index}]`, file));
  return [bytes, data, beside?.map(({ name }) => name), beside?.map(({ bytes }) => bytes) ?? [], space];
}

function checkedFile(parameter: string, file: NamedFile): NamedFile {
  const { name, bytes } = checkProperties(parameter, file ?? null, ['name', 'bytes']);
  if (typeof name !== 'string') throw invalid(`${parameter}.name`, 'must be a string');
  return { name, bytes: typedArray(`${parameter}.bytes`, bytes, Uint8Array) };
}
