/** Small DICOM and TIFF files for the tests. */

import { dicomFile, type Elements, type Grid, sliceElements } from '../js/dicom-files';

/** A file in the form that Playwright passes to an input. */
export interface Given {
  name: string;
  mimeType: string;
  buffer: Buffer;
}

/** A grid, and its voxels, x fastest. */
export type Volume = Grid & { data: Uint16Array };

/** Series of the files: the last number of its identifier, and its description. */
export interface SeriesName {
  number: number;
  description: string;
}

/**
 * Returns a series of CT files in an order other than that of the slices, with stored values 1000 above the intensities,
 * and with elements that `change` adds to a slice.
 */
export function dicomSeries(
  { data, ...grid }: Volume,
  { number, description }: SeriesName = { number: 6, description: '' },
  change: (z: number) => Elements = () => ({}),
): Given[] {
  const count = grid.dims[0] * grid.dims[1];
  const order = Array.from({ length: grid.dims[2] }, (_, z) => (z * 7) % grid.dims[2]);
  return order.map((z, k) => {
    const elements: Elements = {
      ...sliceElements(grid, z, data.slice(z * count, (z + 1) * count)),
      '0008103e': ['LO', description],
      // A sequence of undefined length that names another series.
      '00081115': ['SQ', [{ '0020000e': ['UI', '9.9.9'] }]],
      '0020000e': ['UI', `1.2.3.${number}`],
      '00281052': ['DS', '-1000'],
      '00281053': ['DS', '1'],
      ...change(z),
    };
    return { name: `IM${k}`, mimeType: 'application/dicom', buffer: dicomFile(elements) };
  });
}

/** Returns 8-bit pages as a little-endian TIFF file, with a description on the first page. */
export function tiffStack(pages: Uint8Array[], [wide, high]: [number, number], description: string): Buffer {
  const text = Buffer.from(`${description}\0`, 'utf8');
  const parts: Uint8Array[] = [Buffer.from([0x49, 0x49, 42, 0, 0, 0, 0, 0]), text];
  let end = 8 + text.length;
  const directories = pages.map((page, k) => {
    parts.push(Buffer.from(page));
    const entries = [
      ...[
        entry(256, 4, 1, wide),
        entry(257, 4, 1, high),
        entry(258, 3, 1, 8),
        entry(259, 3, 1, 1),
        entry(262, 3, 1, 1),
      ],
      ...(k === 0 ? [entry(270, 2, text.length, 8)] : []),
      ...[entry(273, 4, 1, end), entry(277, 3, 1, 1), entry(278, 4, 1, high), entry(279, 4, 1, page.length)],
    ];
    end += page.length;
    return entries;
  });
  // The offset of each directory is at the end of the previous one, that of the first in the file header.
  const written = directories.map((entries) => {
    const at = end;
    end += 2 + 12 * entries.length + 4;
    return { at, entries };
  });
  for (const [k, { entries }] of written.entries()) {
    const count = Buffer.from(Uint16Array.of(entries.length).buffer);
    parts.push(count, ...entries, Buffer.from(Uint32Array.of(written[k + 1]?.at ?? 0).buffer));
  }
  const file = Buffer.concat(parts);
  file.writeUInt32LE(written[0]?.at ?? 0, 4);
  return file;
}

function entry(tag: number, kind: number, count: number, value: number): Buffer {
  const bytes = Buffer.alloc(12);
  bytes.writeUInt16LE(tag, 0);
  bytes.writeUInt16LE(kind, 2);
  bytes.writeUInt32LE(count, 4);
  bytes.writeUInt32LE(value, 8);
  return bytes;
}
