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

/** Measures of what is drawn over a picture. */
export interface Drawn {
  /** Fraction of the pixels that are not drawn on and not reached from the border. */
  enclosed: number;
  /** Side of the largest square, in pixels, of which all is drawn on. */
  thickest: number;
}

/** Compares two PNGs, of which the second has lines in addition; the pages are as wide as `width` pixels. */
export async function drawn(page: Page, before: Buffer, after: Buffer, width: number): Promise<Drawn> {
  const mask = `const mask = Array.from({ length: a.length / 4 }, (_, i) =>
    [0, 1, 2].some((k) => Math.abs(a[4 * i + k] - b[4 * i + k]) > 24));
    const near = (i) => [i % width > 0 ? i - 1 : -1, i % width < width - 1 ? i + 1 : -1, i - width, i + width]
      .filter((j) => j >= 0 && j < mask.length);`;
  const enclosed = await told(
    page,
    [before, after],
    `(a, b) => { const width = ${width}; ${mask}
      const reached = new Uint8Array(mask.length);
      const pending = [...mask.keys()].filter((i) => near(i).length < 4);
      while (pending.length > 0) {
        const i = pending.pop();
        if (mask[i] || reached[i]) continue;
        reached[i] = 1;
        pending.push(...near(i));
      }
      return mask.filter((one, i) => !one && !reached[i]).length / mask.length; }`,
  );
  const thickest = await told(
    page,
    [before, after],
    `(a, b) => { const width = ${width}; ${mask}
      const side = new Uint16Array(mask.length);
      let most = 0;
      for (let i = width + 1; i < mask.length; i++) {
        if (mask[i] && i % width > 0) side[i] = 1 + Math.min(side[i - 1], side[i - width], side[i - width - 1]);
        most = Math.max(most, side[i]);
      }
      return most; }`,
  );
  return { enclosed, thickest };
}
