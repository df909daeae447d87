import type { NamedBytes } from '../protocol';
import { text } from '../texts';
import { h, uniqueId } from './dom';

/** Endings of files of volumes. */
export const VOLUME_FILES = '.nii,.gz,.nrrd,.nhdr,.mha,.mhd,.raw,.zraw,.dcm,.tif,.tiff';

/**
 * Creates a button with the given label that chooses one file, or several that belong together, of the endings in `accept`,
 * by default those of volumes, or a session.
 */
export function fileChooser(
  onFiles: (files: File[]) => void,
  accept = VOLUME_FILES,
  label = text('controls.openFile'),
): HTMLElement {
  const id = uniqueId('file');
  const input = h('input', { type: 'file', id, multiple: true, accept: `${accept},.zip`, class: 'visually-hidden' });
  input.addEventListener('change', () => {
    const files = [...(input.files ?? [])];
    // Makes choosing the same file again a change.
    input.value = '';
    if (files.length > 0) onFiles(files);
  });
  return h('span', { class: 'chooser' }, input, h('label', { for: id, class: 'button' }, label));
}

/**
 * Accepts files dropped anywhere on the page, until `signal` is aborted, and shows `overlay` while files are dragged
 * over the page. A folder is passed to `onFolder`, if given, in browsers that have handles of folders; otherwise it
 * counts as a file.
 */
export function acceptDrops(
  overlay: HTMLElement,
  onFiles: (files: File[]) => void,
  signal: AbortSignal,
  onFolder?: (folder: FileSystemDirectoryHandle) => void,
): void {
  const hasFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
  window.addEventListener(
    'dragover',
    (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      overlay.hidden = false;
    },
    { signal },
  );
  window.addEventListener(
    'dragleave',
    (event) => {
      if (!event.relatedTarget) overlay.hidden = true;
    },
    { signal },
  );
  window.addEventListener(
    'drop',
    (event) => {
      overlay.hidden = true;
      if (!hasFiles(event)) return;
      event.preventDefault();
      const files = [...(event.dataTransfer?.files ?? [])];
      const folder = onFolder && folderIn(event.dataTransfer);
      if (!folder) return onFiles(files);
      // If it cannot be read, opening it as a file gives the error message.
      folder.then(onFolder, () => onFiles(files));
    },
    { signal },
  );
}

/** An item that was dropped, in browsers that have handles of folders. */
type DroppedItem = DataTransferItem & { getAsFileSystemHandle?: () => Promise<FileSystemDirectoryHandle> };

/** Returns the handle of a folder that was dropped, undefined if none was; may be called during the event only. */
function folderIn(data: DataTransfer | null): Promise<FileSystemDirectoryHandle> | undefined {
  const items: DroppedItem[] = [...(data?.items ?? [])];
  const folder = items.find((item) => item.webkitGetAsEntry()?.isDirectory);
  return folder?.getAsFileSystemHandle?.();
}

/** Returns a name for one or several files that were opened together, for display. */
export function nameOf(files: File[]): string {
  const [first, second] = files.map(({ name }) => name);
  if (files.length === 2) return text('controls.twoFiles', { first: first ?? '', second: second ?? '' });
  return files.length > 1 ? text('controls.moreFiles', { first: first ?? '', more: files.length - 1 }) : (first ?? '');
}

export async function readFiles(files: File[]): Promise<NamedBytes[]> {
  return Promise.all(files.map(async (file) => ({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) })));
}

/** Downloads bytes as a file with the given name and media type. */
export function download(name: string, bytes: Uint8Array, type: string): void {
  const url = URL.createObjectURL(new Blob([bytes as Uint8Array<ArrayBuffer>], { type }));
  const link = h('a', { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  // The browser has read the blob once the click is handled; the delay is a safety margin.
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
