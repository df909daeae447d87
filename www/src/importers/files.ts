import type { NamedBytes } from '../engine/protocol';
import { areSmall } from '../engine/small-files';
import { type Dropped, readFolders } from '../kit/folders';
import { type Admission, admitted, isOfSmallFiles, notesOf } from '.';

export { nameOf } from '../kit/folders';

/** Options of accepting files that are dropped. */
interface DropOptions {
  admission?: Admission;
  /** Takes a folder that is an OME-Zarr image. */
  onFolder?: ((folder: FileSystemDirectoryHandle) => void) | undefined;
}

/**
 * Accepts files dropped anywhere on the page, until `signal` is aborted; `onOver` is told whether files are dragged
 * over the page or folders are read. All files in a folder are passed on, or of other programs' formats the volume that the
 * user chooses; a folder that is an OME-Zarr image is passed to `onFolder`, if given, in browsers that have handles of folders.
 */
export function acceptDrops(
  onOver: (isOver: boolean) => void,
  onFiles: (files: File[]) => void,
  signal: AbortSignal,
  { admission = 'volume', onFolder }: DropOptions = {},
): void {
  const hasFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
  window.addEventListener(
    'dragover',
    (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      onOver(true);
    },
    { signal },
  );
  window.addEventListener(
    'dragleave',
    (event) => {
      if (!event.relatedTarget) onOver(false);
    },
    { signal },
  );
  let drops = 0;
  const open = async (folders: Promise<Dropped> | undefined, files: File[]) => {
    const drop = ++drops;
    // If a folder cannot be read, opening it as a file gives the error message.
    const dropped = (await folders?.catch(() => undefined)) ?? { files };
    if (drop !== drops || signal.aborted) return;
    onOver(false);
    if ('zarr' in dropped) return onFolder?.(dropped.zarr);
    const opened = await letIn(dropped.files, admission);
    if (drop === drops && !signal.aborted && opened) onFiles(opened);
  };
  window.addEventListener(
    'drop',
    (event) => {
      onOver(false);
      if (!hasFiles(event)) return;
      event.preventDefault();
      const folders = readFolders(event.dataTransfer, onFolder !== undefined);
      onOver(folders !== undefined);
      void open(folders, [...(event.dataTransfer?.files ?? [])]);
    },
    { signal },
  );
}

/**
 * Passes what is dropped on an element to `onDrop`, before the page opens it as data of the lab. `onDrop` has to read it
 * during the event.
 */
export function acceptDropsOn(element: HTMLElement, onDrop: (data: DataTransfer | null) => void): void {
  for (const type of ['dragover', 'drop'] as const)
    element.addEventListener(type, (event) => {
      event.preventDefault();
      event.stopPropagation();
      // Hides what the page shows while files are dragged.
      window.dispatchEvent(new DragEvent('dragleave'));
      if (type === 'drop') onDrop(event.dataTransfer);
    });
}

/** Files that could not be let in, and why: opening them says it. */
const refused = new WeakMap<readonly File[], Error>();

/** Returns the files to open; undefined if the user cancels. */
export async function letIn(files: File[], admission: Admission): Promise<File[] | undefined> {
  try {
    return await admitted(files, admission);
  } catch (error) {
    refused.set(files, error as Error);
    return files;
  }
}

/** Reads files whole; throws why they were not let in, if so. */
export async function readFiles(files: File[]): Promise<NamedBytes[]> {
  const reason = refused.get(files);
  if (reason) throw reason;
  return Promise.all(files.map(readFile));
}

/** How files are read each time that they are opened: small ones are kept, so that they can be although they are gone. */
export function reading(files: File[]): { load: () => Promise<{ files: NamedBytes[] }>; isKept: boolean } {
  const isKept = areSmall(files);
  let kept: NamedBytes[] | undefined;
  const load = async () => {
    const read = kept ?? (await readFiles(files));
    if (!isKept) return { files: read };
    kept = read;
    // Copies, as they may be given to a worker.
    return { files: read.map((file) => ({ ...file, bytes: file.bytes.slice() })) };
  };
  return { load, isKept };
}

async function readFile(file: File): Promise<NamedBytes> {
  const notes = notesOf(file);
  const isOfSmall = isOfSmallFiles(file);
  const bytes = new Uint8Array(await file.arrayBuffer());
  return { name: file.name, bytes, ...(notes && { notes }), ...(isOfSmall && { isOfSmall }) };
}
