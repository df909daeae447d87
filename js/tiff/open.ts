// Opens the files of a stack.

import type { Pause } from '../pause.js';
import { shortened } from '../short-text.js';
import { isTiff, readPages, TAG } from './directory.js';
import { badTiff } from './error.js';
import { type Channel, type Layout, type OpenFile, stackOf } from './layout.js';
import { warningOfNames } from './numbered.js';
import { isOme, parseOme } from './ome.js';
import { namedFiles, type OmeFile } from './ome-files.js';
import { omeStack } from './ome-layout.js';
import type { Source } from './source.js';

/** Largest number of bytes of a file that is only a description. */
const LARGEST_TEXT = 2 ** 28;

/** Most channels of all files that are joined. */
const MOST_JOINED = 2 ** 19;

/** Opens the stack in one or several files: those of one data set, or one or several slices a file. */
export async function openStack(sources: Source[], pause: Pause): Promise<Layout> {
  const files: OmeFile[] = [];
  for (const source of sources) files.push(await openFile(source, pause));
  const main = files.find(({ ome }) => ome && ome.images.length > 0);
  checkDescribed(files, main);
  if (!main?.ome) return joined(files, (file) => stackOf(file, pause));
  const named = namedFiles(main, main.ome, files);
  named.add(main);
  const others = files.filter((file) => !named.has(file));
  if (others.length === 0) return omeStack(main, main.ome, files, pause);
  if (named.size > 1 || main.pages.length === 0)
    throw badTiff(others[0]?.source.name ?? '', `not one of the files that "${shortened(main.source.name)}" describes`);
  // Files that describe only themselves.
  return joined(files, (file) => (file.ome ? omeStack(file, file.ome, [file], pause) : stackOf(file, pause)));
}

async function openFile(source: Source, pause: Pause): Promise<OmeFile> {
  const isImage = await isTiff(source);
  const text = isImage ? '' : await textOf(source);
  if (isOme(text)) return { source, pages: [], text, ome: parseOme(text) };
  const pages = await readPages(source, pause);
  const own = (await pages[0]?.text(TAG.description)) ?? '';
  return { source, pages, text: own, ome: isOme(own) ? parseOme(own) : undefined };
}

/** Returns a file as text, if it may be XML. */
async function textOf(source: Source): Promise<string> {
  const first = new TextDecoder().decode(await source.peek(0, Math.min(source.size, 1000)));
  const isXml = /^\uFEFF?\s*</.test(first) && source.size <= LARGEST_TEXT;
  return isXml ? new TextDecoder().decode(await source.read(0, source.size)) : '';
}

/** Throws `bad-file` if the description of a file is in one that was not opened. */
function checkDescribed(files: OmeFile[], main: OmeFile | undefined): void {
  if (main) return;
  const lost = files.find(({ ome }) => ome?.elsewhere !== undefined);
  if (lost)
    throw badTiff(
      lost.source.name,
      `described by the file "${shortened(lost.ome?.elsewhere ?? '')}", which has to be opened with it`,
    );
  const empty = files.find(({ ome }) => ome);
  if (empty) throw badTiff(empty.source.name, 'its OME description has no image');
}

/** Returns the stack of files whose slices follow each other, in their order. */
async function joined(files: OpenFile[], stackIn: (file: OpenFile & OmeFile) => Promise<Layout>): Promise<Layout> {
  const parts: Layout[] = [];
  let channels = 0;
  for (const file of files as OmeFile[]) {
    const part = await stackIn(file);
    parts.push(part);
    channels += part.channels.length;
    if (channels > MOST_JOINED) throw badTiff(file.source.name, 'too many channels in files that are joined');
  }
  const [first, ...others] = parts;
  if (!first) throw badTiff('', 'no files');
  if (others.length === 0) return first;
  for (const [k, part] of parts.entries()) {
    const name = files[k]?.source.name ?? '';
    const [own, wanted] = [part.channels.length, first.channels.length];
    if (own !== wanted) throw badTiff(name, `${own} channels, but the first file has ${wanted}`);
    if (part.frames > 1) throw badTiff(name, `${part.frames} frames: open one such file at a time`);
  }
  const slices = parts.reduce((sum, part) => sum + part.slices, 0);
  const warnings = new Set(parts.flatMap((part) => part.warnings));
  if (parts.some((part) => part.slices > 1))
    warnings.add(`slices of ${parts.length} files are joined along z, in the order of the names of the files`);
  const ofNames = warningOfNames(files.map(({ source }) => source.name));
  if (ofNames) warnings.add(ofNames);
  return { ...first, channels: first.channels.map((_, c) => joinedChannel(parts, c)), slices, warnings: [...warnings] };
}

function joinedChannel(parts: Layout[], c: number): Channel {
  const starts: number[] = [];
  let end = 0;
  for (const { slices } of parts) {
    starts.push(end);
    end += slices;
  }
  const missing = parts.map(({ channels }) => channels[c]?.missing).find(Boolean);
  const planeAt = (slice: number): ReturnType<Channel['planeAt']> => {
    const part = starts.findLastIndex((start) => start <= slice);
    const channel = parts[part]?.channels[c] as Channel;
    return channel.planeAt(slice - (starts[part] ?? 0), 0);
  };
  return { name: parts[0]?.channels[c]?.name ?? '', planeAt, ...(missing && { missing }) };
}
