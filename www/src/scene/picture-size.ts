/** How large pictures are before they are decoded: a few kilobytes can stand for gigabytes of equal pixels. */
import { areSmall, SMALL } from '../engine/small-files';
import { text } from '../texts';

/** The most pixels that pictures in small files may have. */
const MOST_OF_SMALL = 2 ** 24;

/** Throws if pictures in small files would have too many pixels. One that is used several times is counted as often. */
export async function checkPictures(uses: readonly Blob[]): Promise<void> {
  const files = [...new Set(uses)];
  if (!areSmall(files)) return;
  const pixels = new Map<Blob, number>();
  for (const file of files) pixels.set(file, await pixelsOf(file));
  const total = uses.reduce((sum, file) => sum + (pixels.get(file) ?? 0), 0);
  if (total <= MOST_OF_SMALL) return;
  throw new Error(
    text('files.picturesTooLarge', {
      millions: Math.ceil(total / 1e6),
      kilobytes: SMALL / 2 ** 10,
      most: Math.floor(MOST_OF_SMALL / 1e6),
    }),
  );
}

/** Returns the number of pixels that a picture states, without decoding it; 0 for what is no picture. */
async function pixelsOf(file: Blob): Promise<number> {
  const url = URL.createObjectURL(file);
  try {
    const image = new Image();
    await new Promise((resolve, reject) => {
      image.onload = resolve;
      image.onerror = reject;
      image.src = url;
    });
    return image.naturalWidth * image.naturalHeight;
  } catch {
    return 0;
  } finally {
    URL.revokeObjectURL(url);
  }
}
