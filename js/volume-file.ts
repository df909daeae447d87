// Checks the options of reading a volume file.
import { checkProperties, choice, invalid, typedArray } from './check.js';
import type { VolumeFileOptions } from './data.js';
import { checkedNamedFiles } from './input-file.js';

/** Arguments of the readers in the WebAssembly module: file, data, names and contents of the files beside it, space. */
export type ReaderArguments = [
  Uint8Array,
  Uint8Array | undefined,
  string[] | undefined,
  Uint8Array[],
  string | undefined,
];

/** Returns the number of bytes of all files that are read. */
export function bytesOf([bytes, data, , beside]: ReaderArguments): number {
  return beside.reduce((sum, { length }) => sum + length, bytes.length + (data?.length ?? 0));
}

/** Returns the arguments for the readers; throws `invalid-argument` naming the option that is wrong. */
export function readerArguments(bytes: Uint8Array, options: VolumeFileOptions | undefined): ReaderArguments {
  const { data, files, space } = checkProperties<VolumeFileOptions>('options', options, ['data', 'files', 'space']);
  typedArray('bytes', bytes, Uint8Array);
  if (data !== undefined) typedArray('data', data, Uint8Array);
  if (space !== undefined) choice('space', space, ['RAS', 'LPS']);
  if (data !== undefined && files !== undefined) throw invalid('files', 'give either data or files');
  const beside = files && checkedNamedFiles('files', files);
  return [bytes, data, beside?.map(({ name }) => name), beside?.map(({ bytes }) => bytes) ?? [], space];
}
