/** Unpacks ZIP archives, which may come from anywhere. */
import { unzipSync } from 'three/addons/libs/fflate.module.js';

/** Largest number of files that are unpacked. */
export const MOST_FILES = 1000;

/** Error for an archive beyond its limits. */
export class ArchiveTooLarge extends Error {}

/**
 * Returns the files of an archive by name, those that are wanted. Throws an {@link ArchiveTooLarge} with the message
 * `refusal` before more than {@link MOST_FILES} files or `mostBytes` bytes are unpacked, and another error if the
 * archive is damaged: also if its files have more bytes together than it has itself, so that they share some.
 */
export function unpack(
  archive: Uint8Array,
  mostBytes: number,
  refusal: string,
  isWanted: (name: string) => boolean = () => true,
): Record<string, Uint8Array> {
  let [count, total, packed] = [0, 0, 0];
  const filter = ({ name, size, originalSize }: { name: string; size: number; originalSize: number }) => {
    if (!isWanted(name)) return false;
    count += 1;
    total += Math.max(size, originalSize);
    if (count > MOST_FILES || !(total <= mostBytes)) throw new ArchiveTooLarge(refusal);
    packed += size;
    if (!(packed <= archive.length)) throw new RangeError('files of the archive share bytes');
    return true;
  };
  return unzipSync(archive, { filter });
}
