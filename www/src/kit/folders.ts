import { text } from '../texts';

/** Files at the top of an OME-Zarr image, of the versions of the format. */
const ZARR = ['zarr.json', '.zattrs', '.zgroup', '.zarray'];

/** Names of sets of files for display, where these are not the names of the files. */
const titles = new WeakMap<readonly File[], string>();

/** Returns a name for one or several files that were opened together, for display. */
export function nameOf(files: readonly File[]): string {
  const title = titles.get(files);
  if (title !== undefined) return title;
  const [first, second] = files.map(({ name }) => name);
  if (files.length === 2) return text('controls.twoFiles', { first: first ?? '', second: second ?? '' });
  return files.length > 1 ? text('controls.moreFiles', { first: first ?? '', more: files.length - 1 }) : (first ?? '');
}

/** Whether a set of files has a name besides those of its files. */
export const hasName = (files: readonly File[]) => titles.has(files);

/** Gives a set of files a name for display. */
export function setName(files: readonly File[], name: string): void {
  titles.set(files, name);
}

/** A dropped folder: an OME-Zarr image, as a handle of the folder, or any other, as the files in it. */
export type Dropped = { zarr: FileSystemDirectoryHandle } | { files: File[] };

/** An item that was dropped, in browsers that have handles of folders. */
type DroppedItem = DataTransferItem & { getAsFileSystemHandle?: () => Promise<FileSystemDirectoryHandle> };

/**
 * Reads the folders that were dropped, with the folders in them, and files beside them; undefined if no folder was. An
 * OME-Zarr image is not read with `asZarr`. May be called during the event only.
 */
export function readFolders(data: DataTransfer | null, asZarr: boolean): Promise<Dropped> | undefined {
  const items: DroppedItem[] = [...(data?.items ?? [])];
  const entries = items.flatMap((item) => item.webkitGetAsEntry() ?? []);
  const folder = entries.find(({ isDirectory }) => isDirectory);
  if (!folder) return undefined;
  const dropped = items.find((item) => item.webkitGetAsEntry()?.isDirectory);
  const handle = asZarr ? dropped?.getAsFileSystemHandle?.() : undefined;
  return opened(folder as FileSystemDirectoryEntry, entries, handle);
}

async function opened(
  folder: FileSystemDirectoryEntry,
  entries: FileSystemEntry[],
  handle: Promise<FileSystemDirectoryHandle> | undefined,
): Promise<Dropped> {
  const isZarr = (await entriesOf(folder)).some(({ name }) => ZARR.includes(name));
  if (isZarr && handle) return { zarr: await handle };
  const files = (await Promise.all(entries.map(filesIn))).flat();
  titles.set(files, folder.name);
  return { files };
}

async function filesIn(entry: FileSystemEntry): Promise<File[]> {
  if (entry.isDirectory)
    return (await Promise.all((await entriesOf(entry as FileSystemDirectoryEntry)).map(filesIn))).flat();
  return [await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject))];
}

async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const all: FileSystemEntry[] = [];
  for (;;) {
    // Browsers return some entries at a time.
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return all;
    all.push(...some);
  }
}
