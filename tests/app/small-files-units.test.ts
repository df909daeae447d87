// Bounds of data in small files, which may come from anyone.
import { expect, test } from 'vitest';
import { isOfSmall, SMALL } from '../../www/src/engine/small-files';
import { checkPlanes, checkSmallImage } from '../../www/src/engine/volumes';
import type { Session } from '../../www/src/lab/session/check';

type Dims = [number, number, number];

const file = (size: number) => ({ name: 'x.nii', bytes: new Uint8Array(size) });

test('data are small if their files are, all together, or the session that has them', () => {
  expect(isOfSmall(undefined, [file(SMALL)])).toBe(true);
  expect(isOfSmall(undefined, [file(SMALL), file(1)])).toBe(false);
  expect(isOfSmall(undefined, [new Blob([new Uint8Array(SMALL + 1)])])).toBe(false);
  expect(isOfSmall(undefined, undefined)).toBe(false);
  // Decoded from small files of another program.
  expect(isOfSmall(undefined, [{ ...file(2 * SMALL), isOfSmall: true }])).toBe(true);
  expect(isOfSmall(undefined, [{ ...file(2 * SMALL), isOfSmall: true }, file(SMALL + 1)])).toBe(false);
  const session = (content: Uint8Array | undefined, isSmall: boolean) =>
    ({ isSmall, source: { name: 'x', files: [{ name: 'x.nii', sha256: '', content }] } }) as unknown as Session;
  const large = [file(2 * SMALL)];
  expect(isOfSmall(session(new Uint8Array(1), true), large)).toBe(true);
  // The user's own files, whatever the session is.
  expect(isOfSmall(session(undefined, true), large)).toBe(false);
  expect(isOfSmall(session(new Uint8Array(1), false), large)).toBe(false);
});

test('planes through an image in small files have at most four million pixels', () => {
  const message = 'have 88 million pixels; those of images in files of at most 128 KiB may have 4 million';
  const [flat, upright, across] = [[9400, 9400, 1] as Dims, [1, 9400, 9400] as Dims, [9400, 1, 9400] as Dims];
  for (const dims of [flat, upright, across]) expect(() => checkPlanes({ dims })).toThrow(message);
  for (const dims of [[2048, 2048, 23] as Dims, [100_000, 30, 30] as Dims]) checkPlanes({ dims });
});

test('images in small files have at most 48 MiB of voxels, all frames together', () => {
  const [bytes, floats] = [new Uint8Array(), new Float32Array()];
  for (const dims of [[464, 464, 464] as Dims, [256, 256, 256, 4] as [...Dims, number]])
    expect(() => checkSmallImage({ dims, data: bytes })).toThrow(
      /million voxels; one of 8 bits a voxel in files of at most 128 KiB may have 50 million/,
    );
  expect(() => checkSmallImage({ dims: [256, 256, 193], data: floats })).toThrow(
    'The image has 13 million voxels; one of 32 bits a voxel in files of at most 128 KiB may have 13 million',
  );
  for (const dims of [[512, 512, 192] as Dims, [256, 256, 256, 3] as [...Dims, number]])
    checkSmallImage({ dims, data: bytes });
  checkSmallImage({ dims: [256, 256, 192], data: floats });
});
