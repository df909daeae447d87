/** Recognises lessons, without what reads them. */

/** Bytes at the end of an archive that are searched for its table of contents; that of a lesson is far smaller. */
const TABLE = 2 ** 16;
/** Beginning of an entry of the table. The length of its name is 24 bytes after it, the name 42. */
const ENTRY = 'PK\x01\x02';
const NAME = /(?:^|\/)lesson\.json$/;

/** Returns whether files are those of a lesson, or a ZIP archive of them. */
export async function isLesson(files: File[]): Promise<boolean> {
  const [first] = files;
  const isArchive = files.length === 1 && first && /\.zip$/i.test(first.name);
  const names = isArchive ? await namesIn(first) : files.map(({ name }) => name);
  return names.some((name) => NAME.test(name));
}

async function namesIn(archive: File): Promise<string[]> {
  const end = await archive.slice(Math.max(0, archive.size - TABLE)).arrayBuffer();
  const [, ...entries] = new TextDecoder('latin1').decode(end).split(ENTRY);
  return entries.map((entry) => entry.slice(42, 42 + entry.charCodeAt(24)));
}
