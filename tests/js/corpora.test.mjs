/** The reader of test files of other projects: it answers each line, and goes on after files that it refuses. */
import { spawn } from 'node:child_process';
import { createInterface } from 'node:readline';
import { afterAll, expect, test } from 'vitest';

const reader = spawn(process.execPath, ['scripts/corpora-reader.mjs'], { stdio: ['pipe', 'pipe', 'inherit'] });
const lines = createInterface({ input: reader.stdout })[Symbol.asyncIterator]();

afterAll(() => reader.stdin.end());

async function ask(path, kind) {
  reader.stdin.write(`${JSON.stringify({ path: `tests/data/${path}`, kind })}\n`);
  return JSON.parse((await lines.next()).value);
}

test.each([
  ['meshes/knot.ply', 'mesh', 'read'],
  ['meshes/suzi_draco.glb', 'mesh', 'refused'],
  ['volumes/made/detached.nhdr', 'volume', 'read'],
  ['dicom/rle.dcm', 'dicom', 'read'],
  ['tiff/i2-le-packbits.tif', 'tiff', 'read'],
  ['no-such-file.nii', 'volume', 'crash'],
])('%s', async (path, kind, status) => {
  const found = await ask(path, kind);
  expect(found.status).toBe(status);
  if (status === 'read') expect(Object.values(found.facts).flat().every(Number.isFinite)).toBe(true);
  else expect(found.reason).not.toBe('');
});
