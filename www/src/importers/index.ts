/**
 * Lets files in: those of formats that only other programs read, DICOM and TIFF, are written as files that all labs read,
 * after the user has chosen the volume if there are several. Nothing of DICOM but voxels, geometry and the description of
 * the series gets further than this.
 */

import { groupFiles, isVolumeFile } from '../engine/file-groups';
import type { FileNotes } from '../engine/protocol';
import { areSmall } from '../engine/small-files';
import { hasName, setName } from '../kit/folders';
import { text } from '../texts';
import { connectImport } from './client';
import type { Candidate, Listing } from './protocol';
import { HEAD, isDicom, isTiff } from './recognise';
import { isNamedSession } from './sessions';
import { type Chosen, VolumeChoice } from './volume-choice';

/** Which files a lab opens together: one volume, one with its label map, the frames of one, or any. */
export type Admission = 'volume' | 'labelled' | 'frames' | 'any';

/** Notes on files that were written here, or came with a session. */
const notes = new WeakMap<File, FileNotes>();

/** Returns the notes on a file, which it does not contain itself. */
export const notesOf = (file: File): FileNotes | undefined => notes.get(file);

/** Files that were written here from small ones. */
const ofSmall = new WeakSet<File>();

/** Returns whether a file was written here from files that are small, all together. */
export const isOfSmallFiles = (file: File): boolean => ofSmall.has(file);

/** Returns a file with notes. */
export function noted(file: File, known: FileNotes | undefined): File {
  if (known) notes.set(file, known);
  return file;
}

/**
 * Returns the files to open for files of the user; undefined if the user cancels. Files that cannot be read are returned as
 * they are: opening them says why.
 */
export async function admitted(files: File[], admission: Admission): Promise<File[] | undefined> {
  // Data beside a session are its own.
  if (admission === 'any' || files.length === 0 || files.some(isNamedSession)) return files;
  const foreign = await foreignAmong(files).catch(() => []);
  if (foreign.length > 0) return imported(files, foreign, admission);
  return admission === 'volume' ? oneOf(files) : files;
}

/** Whether files are of a format that only other programs read. */
export const anyForeign = async (files: File[]) => files.length > 0 && (await foreignAmong(files)).length > 0;

/** Returns the files that are DICOM or, if none is, all if all are TIFF. */
async function foreignAmong(files: File[]): Promise<File[]> {
  const heads = await Promise.all(files.map(async (file) => new Uint8Array(await file.slice(0, HEAD).arrayBuffer())));
  const dicom = files.filter((file, k) => isDicom(heads[k] ?? new Uint8Array(), file.name));
  return dicom.length > 0 || !heads.every(isTiff) ? dicom : files;
}

/** Returns the files of one volume among several; asks which one. Files of other kinds beside it are left out. */
async function oneOf(files: File[]): Promise<File[] | undefined> {
  if (!files.some(isVolumeFile)) return files;
  const groups = groupFiles(files);
  const [only] = groups;
  // A folder's name stays, if nothing of it is left out.
  if (groups.length === 1) return only?.length === files.length && hasName(files) ? files : only;
  const candidates = groups.map(([first], id) => nativeCandidate(first?.name ?? '', id));
  const chosen = await new VolumeChoice(text('importing.oneOfFiles')).choose({ candidates, skipped: [] });
  return chosen && groups[chosen.ids[0] ?? 0];
}

function nativeCandidate(name: string, id: number): Candidate {
  const unknown = {
    title: name,
    patient: '',
    modality: '',
    date: '',
    unit: '',
    images: 0,
    warnings: [],
    remarks: [],
    uneven: undefined,
  };
  return { id, kind: 'image', name, dims: [0, 0, 0], spacing: [0, 0, 0], frames: 1, ...unknown };
}

async function imported(files: File[], foreign: File[], admission: Admission): Promise<File[] | undefined> {
  const choice = new VolumeChoice(text('importing.severalVolumes'));
  const client = connectImport((progress) => choice.progress(progress));
  try {
    // Files that are none of a series may be its damaged slices.
    const listing = await choice.during(client.request('list', { files: foreign.length > 1 ? files : foreign }));
    if (!listing) return undefined;
    if (listing.candidates.length === 0) throw new Error(reasonsOf(listing));
    const chosen = isPlain(listing, admission)
      ? plain(listing)
      : await choice.choose(listing, admission === 'labelled');
    if (!chosen) return undefined;
    const read = await choice.during(client.request('read', chosen));
    if (!read) return undefined;
    const opened = read.map(({ name, bytes, notes }) => noted(new File([bytes as BlobPart], name), notes));
    if (areSmall(files)) for (const file of opened) ofSmall.add(file);
    const titles = listing.candidates.filter(({ id }) => chosen.ids.includes(id)).map(({ title }) => title);
    setName(opened, titles.join(' + '));
    return opened;
  } finally {
    choice.close();
    client.close();
  }
}

/** Whether there is nothing to ask: one volume, and with it at most the labels that belong to it. */
function isPlain({ candidates }: Listing, admission: Admission): boolean {
  const images = candidates.filter(({ kind }) => kind === 'image');
  const labels = candidates.length - images.length;
  const isOne = candidates.length === 1 || (admission === 'labelled' && images.length === 1 && labels === 1);
  return isOne && candidates.every(({ uneven }) => uneven === undefined);
}

const plain = ({ candidates }: Listing): Chosen => ({ ids: candidates.map(({ id }) => id), resample: false });

function reasonsOf({ skipped }: Listing): string {
  const reasons = [...new Set(skipped.map(({ reason }) => reason))];
  return text('importing.nothing', { reasons: reasons.slice(0, 4).join('; ') });
}
