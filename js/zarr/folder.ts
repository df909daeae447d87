// Stores of files on the user's machine: a folder, the files of one, or a ZIP.
import type { AsyncReadable, RangeQuery } from '@zarrita/storage';
import { invalid } from '../check.js';
import { badZarr } from './error.js';
import { checkLength, type FileOptions } from './requests.js';

/** Returns the file of a path relative to the folder, or undefined if there is none. */
type FindFile = (path: string) => Promise<Blob | undefined>;

/** Returns a store of the files that `find` finds. */
function fileStore(find: FindFile): AsyncReadable {
  const read = async (key: string, part: (file: Blob) => Blob) => {
    const file = await find(key.slice(1));
    return file && new Uint8Array(await part(file).arrayBuffer());
  };
  const whole =
    (key: string, { mostBytes = Infinity }: FileOptions) =>
    (file: Blob) => {
      checkLength(key, file.size, mostBytes);
      return file;
    };
  return {
    get: (key, options = {}) => read(key, whole(key, options)),
    getRange: (key, range) => read(key, (file) => slice(file, range)),
  };
}

function slice(file: Blob, range: RangeQuery): Blob {
  if ('suffixLength' in range) return file.slice(Math.max(0, file.size - range.suffixLength));
  return file.slice(range.offset, range.offset + range.length);
}

/** Returns the store of a folder that the user picked with `showDirectoryPicker`, or dropped. */
export function handleStore(folder: FileSystemDirectoryHandle): AsyncReadable {
  return fileStore(async (path) => {
    const parts = path.split('/');
    const name = parts.pop() as string;
    try {
      let inner = folder;
      for (const part of parts) inner = await inner.getDirectoryHandle(part);
      return await (await inner.getFileHandle(name)).getFile();
    } catch (error) {
      return undefinedIfMissing(error);
    }
  });
}

/** Returns the store of a folder that the user dropped: `webkitGetAsEntry()` of an item of the drop. */
export function entryStore(folder: FileSystemDirectoryEntry): AsyncReadable {
  const entryOf = (path: string) =>
    new Promise<FileSystemEntry>((resolve, reject) => folder.getFile(path, {}, resolve, reject));
  const fileOf = (entry: FileSystemEntry) =>
    new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
  return fileStore((path) => entryOf(path).then(fileOf).catch(undefinedIfMissing));
}

function undefinedIfMissing(error: unknown): undefined {
  const { name } = Object(error) as { name?: string };
  if (name === 'NotFoundError' || name === 'TypeMismatchError') return undefined;
  throw error;
}

/** Returns the store of the files of a directory input; paths are relative to the folder that was picked. */
export function filesStore(files: ArrayLike<File>): AsyncReadable {
  const byPath = new Map(Array.from(files, (file) => [pathOf(file), file]));
  return fileStore(async (path) => byPath.get(path));
}

function pathOf(file: File): string {
  if (!(file instanceof Blob)) throw invalid('source', 'must be files, if it is a list');
  const { webkitRelativePath } = file;
  // Without the name of the folder.
  if (webkitRelativePath?.includes('/')) return webkitRelativePath.slice(webkitRelativePath.indexOf('/') + 1);
  throw invalid('source', `files must be those of a directory input, with webkitRelativePath; "${file.name}" has none`);
}

/** Returns the store of a ZIP; if all of it is in one folder, paths are relative to that. */
export async function zipStore(zip: Blob): Promise<AsyncReadable> {
  const { default: ZipFileStore } = await import('@zarrita/storage/zip');
  const store = ZipFileStore.fromBlob(zip, { transformEntries: withoutFolder });
  // Reads the directory of the ZIP.
  await store.has('/').catch((error: Error) => {
    throw badZarr('ZIP', error.message);
  });
  return store;
}

function withoutFolder<T>(all: Record<string, T>): Record<string, T> {
  // Without the files that macOS adds beside the folder.
  const entries = Object.fromEntries(Object.entries(all).filter(([name]) => !name.startsWith('__MACOSX/')));
  const names = Object.keys(entries);
  const folder = `${names[0]?.split('/')[0]}/`;
  const isWhole = ['zarr.json', '.zgroup'].some((name) => name in entries);
  if (isWhole || !names.every((name) => name.startsWith(folder))) return entries;
  return Object.fromEntries(Object.entries(entries).map(([name, entry]) => [name.slice(folder.length), entry]));
}
