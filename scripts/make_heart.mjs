// Makes the beating heart of the Track lab in www/public/data: node scripts/make_heart.mjs <ep_sax_cine_crop128.nii.gz>
// Pixels are binned 2 × 2, which is about the measured resolution: the scanner interpolated them. Needs pkg/.
import { readFile, writeFile } from 'node:fs/promises';
import { gzipSync } from 'node:zlib';
import init, { Volume } from '../pkg/index.js';
import { at, say, script } from './shell.mjs';

await script(async () => {
  await init();
  const cine = Volume.parse(new Uint8Array(await readFile(process.argv[2])));
  const binned = cine.binned([2, 2, 1]);
  const bytes = gzipSync(binned.toNifti(), { level: 9 });
  await writeFile(at('www/public/data/heart.nii.gz'), bytes);
  say('heart.nii.gz', `${binned.dims.join(' × ')} × ${binned.frames}, ${(bytes.length / 1e6).toFixed(2)} MB`);
});
