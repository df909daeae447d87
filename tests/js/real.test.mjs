// The deformable model at its defaults on the volumes that the project includes; `npm run real` takes any folder.
import { readFile } from 'node:fs/promises';
import { beforeAll, expect, test } from 'vitest';
import init, * as library from '../../pkg/index.js';
import { isComplete, measured, valleys } from '../../scripts/real.mjs';
import { at } from '../../scripts/shell.mjs';

beforeAll(() => init());

const VOLUMES = [
  { name: 'tooth.nrrd' },
  { name: 'heart.nii.gz' },
  { name: 'ovule.nrrd', tags: ['long'] },
  { name: 'visible-human-head.nii.gz', tags: ['long'] },
];

const volumeOf = async (name) => library.Volume.parse(new Uint8Array(await readFile(at('www/public/data', name))));

for (const { name, ...options } of VOLUMES) {
  test(`the whole contour of ${name} is found, and nothing else`, options, () => findsContour(name));
}

async function findsContour(name) {
  const volume = await volumeOf(name);
  for (const iso of valleys(volume.histogram({ bins: 256 }), volume.range, 2)) {
    const row = await measured(library, volume, iso, 0);
    expect(row, `at ${iso}`).toSatisfy(isComplete);
    expect(row).toMatchObject({ intersections: 0 });
    expect(row.share, `vertices of marching cubes' at ${iso}`).toBeLessThan(0.6);
  }
  volume.free();
}

test('coarse to fine, too', async () => {
  const volume = await volumeOf('tooth.nrrd');
  const [iso = 0] = valleys(volume.histogram({ bins: 256 }), volume.range, 1);
  expect(await measured(library, volume, iso, 2)).toSatisfy(isComplete);
  volume.free();
});
