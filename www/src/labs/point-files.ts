/** Points, cameras and photographs from an example or from files of the user's. */
import { type CloudExample, dataUrl } from '../reconstruct/examples';
import type { CloudSource } from '../reconstruct/protocol';
import { readFiles } from '../ui/files';
import { fetched } from './downloads';
import { type Photograph, readPhotographs } from './photographs';

export const ACCEPT = '.ply,.obj,.xyz,.pts,.csv,.txt,.json,.png,.jpg,.jpeg,.webp';

/** What is opened together. */
export interface Opened {
  /** Nothing where only cameras were given, for the points that are there. */
  source?: CloudSource;
  photographs: Photograph[];
}

export async function fromExample({ source, photographs }: CloudExample): Promise<Opened> {
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

/** Points in one file; a list of cameras and the photographs it names. */
export async function fromFiles(files: File[]): Promise<Opened> {
  const lists = files.filter(({ name }) => /\.json$/i.test(name));
  const pictures = files.filter(({ name, type }) => type.startsWith('image/') || /\.(png|jpe?g|webp)$/i.test(name));
  const [points, ...more] = files.filter((file) => !lists.includes(file) && !pictures.includes(file));
  if (more.length > 0) throw new Error('One file with points at a time, please.');
  if (!lists[0] && pictures.length > 0)
    throw new Error(
      'Photographs need a cameras.json with the projection of each, chosen or dropped together with them.',
    );
  const byName = new Map(pictures.map((file) => [file.name, file]));
  // A list may name them with a folder.
  const find = async (name: string) => byName.get(name.replace(/^.*[/\\]/, ''));
  const photographs = lists[0] ? await readPhotographs(await lists[0].text(), find) : [];
  if (!points) return { photographs };
  const [file] = await readFiles([points]);
  return { photographs, ...(file && { source: { file } }) };
}
