// Measures pictures. They are decoded by the browser that took them.
import type { Page } from 'playwright-core';
import { expect } from 'vitest';

/** Runs in the page: returns red, green, blue and alpha of each pixel. */
const PIXELS = `async (base64) => {
  const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
  const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
  const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height).data;
}`;

// As text, which no policy of the page forbids.
function told(page: Page, pictures: Buffer[], teller: string): Promise<number> {
  const list = JSON.stringify(pictures.map((one) => one.toString('base64')));
  return page.evaluate(`(async () => (${teller})(...(await Promise.all(${list}.map(${PIXELS})))))()`);
}

/**
 * Returns the number of pixels of a PNG for which `isOne` is true; `ground` is the red value of the upper left pixel.
 * `isOne` runs in the page and must be self-contained.
 */
export function countPixels(
  page: Page,
  picture: Buffer,
  isOne: (r: number, g: number, b: number, ground: number) => boolean,
): Promise<number> {
  return told(
    page,
    [picture],
    `(data) => {
      const isOne = ${isOne};
      let count = 0;
      for (let i = 0; i < data.length; i += 4) if (isOne(data[i], data[i + 1], data[i + 2], data[0])) count += 1;
      return count;
    }`,
  );
}

/** Returns the number of colours of a PNG. */
export function countColors(page: Page, picture: Buffer): Promise<number> {
  return told(page, [picture], '(data) => new Set(new Uint32Array(data.buffer)).size');
}

/** Returns the fraction of pixels that clearly differ between two PNGs; 1 if their sizes differ. */
export function difference(page: Page, before: Buffer, after: Buffer): Promise<number> {
  return told(
    page,
    [before, after],
    `(a, b) => {
      if (a.length !== b.length) return 1;
      const differs = (i) => Math.abs(a[i] - b[i]) > 24;
      let count = 0;
      for (let i = 0; i < a.length; i += 4) if (differs(i) || differs(i + 1) || differs(i + 2)) count += 1;
      return (4 * count) / a.length;
    }`,
  );
}

/** Largest fraction of clearly differing pixels in two pictures of the same. */
const SAME = 0.0002;

/** Waits until `take` gives a picture of the same as `picture`. */
export async function showsAgain(
  page: Page,
  picture: Buffer,
  take: () => Promise<Buffer>,
  message = '',
): Promise<void> {
  await expect.poll(async () => difference(page, picture, await take()), { message }).toBeLessThanOrEqual(SAME);
}

/** Waits until at least the fraction `part` of the pixels of the picture that `take` gives differ from `picture`. */
export async function changes(
  page: Page,
  picture: Buffer,
  take: () => Promise<Buffer>,
  part: number,
  message = '',
): Promise<void> {
  await expect.poll(async () => difference(page, picture, await take()), { message }).toBeGreaterThanOrEqual(part);
}
