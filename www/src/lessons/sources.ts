/** Where lessons come from: the app's own, an address, or files of the user. */

import { readFolders } from '../kit/folders';
import { text } from '../texts';
import { filesOf, type LessonFiles } from './lesson';

/** Most bytes of a lesson's archive or file; a larger one is no lesson. */
const MOST_BYTES = 4_000_000;

/** Address of a lesson that was opened from files; the session keeps its content under this key. */
export const OPENED_FILES = 'opened-files';

const OWN = new URL('lessons/', document.baseURI);

/** Returns the ids of the lessons that are served with the app, in the order in which they are listed. */
export async function ownLessons(): Promise<string[]> {
  return JSON.parse(await fetchText(new URL('index.json', OWN)));
}

/**
 * Fetches a lesson by its id or, for one that is elsewhere, by the address of its folder or ZIP archive; only the text
 * in `language` is fetched from a folder.
 */
export async function fetchLesson(address: string, language: string): Promise<LessonFiles> {
  const opened = address === OPENED_FILES && sessionStorage.getItem(OPENED_FILES);
  if (opened) return JSON.parse(opened);
  const own = /^[\w-]+$/.test(address);
  const url = own ? new URL(`${address}/`, OWN) : new URL(address, document.baseURI);
  if (/\.zip$/i.test(url.pathname)) return unpacked(await (await fetchFile(url)).blob());
  const folder = url.href.replace(/(lesson\.json|\/)?$/, '/');
  const data = await fetchText(new URL('lesson.json', folder));
  const names = filesOf(data, language);
  const files = await Promise.all(names.map(async (name) => [name, await fetchText(new URL(name, folder))]));
  return Object.fromEntries(files);
}

/** Reads the files of a lesson that were opened together: `lesson.json` and its texts, or a ZIP archive of them. */
export async function readLessonFiles(files: File[]): Promise<LessonFiles> {
  const [first] = files;
  if (files.length === 1 && first && /\.zip$/i.test(first.name)) return unpacked(first);
  const known = files.filter(({ name, size }) => isLessonFile(name) && size <= MOST_BYTES);
  return Object.fromEntries(await Promise.all(known.map(async (file) => [file.name, await file.text()])));
}

/** Returns the files of a drop, or those in a folder that was dropped; may be called during the event only. */
export async function filesIn(data: DataTransfer | null): Promise<File[]> {
  const files = [...(data?.files ?? [])];
  const dropped = await readFolders(data, false);
  return dropped && 'files' in dropped ? dropped.files : files;
}

const isLessonFile = (name: string) => /(^|\/)(lesson\.json|text\.[\w-]+\.md)$/.test(name);

async function unpacked(archive: Blob): Promise<LessonFiles> {
  if (archive.size > MOST_BYTES) throw new Error(text('lessons.archiveTooLarge'));
  const { unpack } = await import('../kit/archive');
  const bytes = new Uint8Array(await archive.arrayBuffer());
  const entries = unpack(bytes, MOST_BYTES, text('lessons.archiveTooLarge'), isLessonFile);
  const read = ([name, file]: [string, Uint8Array]) => [name.replace(/^.*\//, ''), new TextDecoder().decode(file)];
  return Object.fromEntries(Object.entries(entries).map(read));
}

async function fetchText(url: URL): Promise<string> {
  return (await fetchFile(url)).text();
}

async function fetchFile(url: URL): Promise<Response> {
  const response = await fetch(url).catch(() => undefined);
  if (!response) throw new Error(text('lessons.unreachable', { url: url.href }));
  if (!response.ok) throw new Error(text('labs.serverAnswered', { status: response.status, url: url.href }));
  return response;
}
