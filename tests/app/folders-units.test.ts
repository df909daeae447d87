/** Choosing files from folders. */
import { expect, test } from 'vitest';
import { seriesOf } from '../../www/src/importers/dicom-header';
import { largestSeries, nameOf } from '../../www/src/ui/folders';
import { dicomSeries, type SeriesName } from './pictures';

const series = (slices: number, name: SeriesName) =>
  dicomSeries(
    {
      data: new Uint16Array(4 * slices),
      dims: [2, 2, slices],
      spacing: [1, 1, 1],
      origin: [0, 0, 0],
      along: [1, 0, 0, 0, 1, 0],
    },
    name,
  ).map(({ name: file, buffer }) => new File([new Uint8Array(buffer)], `${name.number}-${file}`));

const bytesOf = async (file?: File) => new Uint8Array((await file?.arrayBuffer()) ?? new ArrayBuffer(0));

test('the series of a DICOM file is its own, not one that a sequence in it refers to', async () => {
  const [file] = series(2, { number: 7, description: 'Head 1.0' });
  expect(seriesOf(await bytesOf(file))).toEqual({ uid: '1.2.3.7', description: 'Head 1.0' });
});

test('bytes that are no DICOM, and a file that is cut off, have no series', async () => {
  const [file] = series(2, { number: 7, description: 'Head' });
  const bytes = await bytesOf(file);
  for (let length = 0; length < bytes.length; length += 7) {
    const { uid } = seriesOf(bytes.slice(0, length));
    expect('1.2.3.7'.startsWith(uid)).toBe(true);
  }
  const noise = Uint8Array.from({ length: 4000 }, (_, i) => (i * i * 31 + 7 * i) % 256);
  expect(seriesOf(noise).uid).toBe('');
});

test('of several series the largest is chosen, and its name says so; other files are left out', async () => {
  const scout = series(2, { number: 1, description: 'Scout' });
  const head = series(5, { number: 2, description: 'Head' });
  const notes = new File(['text'], 'DICOMDIR.txt');
  const chosen = await largestSeries([...scout, notes, ...head]);
  expect(chosen).toEqual(head);
  expect(nameOf(chosen)).toMatch(/: Head, the largest of 2 series$/);
});

test('one series keeps its name, and files that are no DICOM are all kept', async () => {
  const head = series(3, { number: 2, description: 'Head' });
  const chosen = await largestSeries([new File(['text'], 'index'), ...head]);
  expect(chosen).toEqual(head);
  expect(nameOf(chosen)).toBe('2-IM0 + 2');
  const others = [new File(['a'], 'a.mhd'), new File(['b'], 'a.raw')];
  expect(await largestSeries(others)).toBe(others);
});
