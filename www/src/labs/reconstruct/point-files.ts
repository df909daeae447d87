/** Reads points, cameras and photographs for the Reconstruct lab, from an example or from the user's files. */

import { readFiles } from '../../importers/files';
import { dataUrl, fetched } from '../../lab/downloads';
import { text } from '../../texts';
import type { CloudExample } from './examples';
import { type Photograph, readPhotographs } from './photographs';
import type { CloudSource, NamedBytes } from './protocol';

/** File extensions that the Reconstruct lab opens, for the browser's file dialog. */
export const ACCEPT = '.ply,.obj,.xyz,.pts,.csv,.txt,.json,.png,.jpg,.jpeg,.webp';

/** Points, and cameras with photographs, read from files that were opened together. */
export interface PointFiles {
  /** Source of the points; undefined if only cameras were opened, which belong to the points already open. */
  source?: CloudSource;
  photographs: Photograph[];
  /** The user's files that these were read from. */
  files?: NamedBytes[];
}

export async function fromExample({ source, photographs }: CloudExample): Promise<PointFiles> {
  const [points, pictures] = await Promise.all([
    'shape' in source ? source : fetchPoints(source.file),
    photographs === undefined ? [] : fetchPhotographs(photographs),
  ]);
  return { source: points, photographs: pictures };
}

async function fetchPoints(file: string): Promise<CloudSource> {
  const bytes = new Uint8Array(await (await fetched(dataUrl(file))).arrayBuffer());
  return { file: { name: file, bytes } };
}

async function fetchPhotographs(folder: string): Promise<Photograph[]> {
  const list = await (await fetched(dataUrl(`${folder}/cameras.json`))).text();
  return readPhotographs(list, async (name) => (await fetched(dataUrl(`${folder}/${name}`))).blob());
}

/**
 * Reads points from one file, and a list of cameras with the photographs it names. Throws if there are several files
 * with points, photographs without a list of cameras, or a list that {@link readPhotographs} rejects.
 */
export async function fromFiles(files: File[]): Promise<PointFiles> {
  const lists = files.filter(({ name }) => /\.json$/i.test(name));
  const pictures = files.filter(({ name, type }) => type.startsWith('image/') || /\.(png|jpe?g|webp)$/i.test(name));
  const [points, ...more] = files.filter((file) => !lists.includes(file) && !pictures.includes(file));
  if (more.length > 0) throw new Error(text('reconstruct.onePointFile'));
  if (!lists[0] && pictures.length > 0) throw new Error(text('reconstruct.photosNeedCameras'));
  const byName = new Map(pictures.map((file) => [file.name, file]));
  // A list may name photographs with their folder.
  const find = async (name: string) => byName.get(name.replace(/^.*[/\\]/, ''));
  const photographs = lists[0] ? await readPhotographs(await lists[0].text(), find) : [];
  const all = await readFiles(files);
  const file = points && all[files.indexOf(points)];
  return { photographs, files: all, ...(file && { source: { file } }) };
}
