// What is to be seen in a picture. The browser that took it takes it apart, too.
import type { Page } from 'playwright-core';

/** In the page: red, green, blue and alpha of each pixel. */
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
 * How many pixels of a PNG are as asked; `ground` is the red of the one in the upper left corner.
 * `isOne` runs in the page: it cannot use anything from outside of itself.
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

/** How many colours a PNG has. */
export function countColors(page: Page, picture: Buffer): Promise<number> {
  return told(page, [picture], '(data) => new Set(new Uint32Array(data.buffer)).size');
}

/** Share of the pixels that differ clearly between two PNGs. */
export function difference(page: Page, before: Buffer, after: Buffer): Promise<number> {
  return told(
    page,
    [before, after],
    `(a, b) => {
      let count = 0;
      for (let i = 0; i < a.length; i += 4)
        if ([0, 1, 2].some((k) => Math.abs(a[i + k] - b[i + k]) > 24)) count += 1;
      return (4 * count) / a.length;
    }`,
  );
}
