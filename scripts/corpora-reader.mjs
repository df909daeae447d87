// Reads one file for each line of its input, `{ path, kind }`, and answers with what it found, for `corpora.mjs`.
import { openAsBlob } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { basename } from 'node:path';
import { createInterface } from 'node:readline';
import { readDicom } from '../pkg/dicom/index.js';
import init, { Mesh, parsePoints, VesicleError, Volume } from '../pkg/index.js';
import { readTiff } from '../pkg/tiff/index.js';
import { filesBeside } from './beside.mjs';

const bytesOf = async (path) => new Uint8Array(await readFile(path));

function volumeFacts(volume) {
  const { dims, frames, spacing, range } = volume;
  let sum = 0;
  for (const value of volume.intensities()) if (Number.isFinite(value)) sum += value;
  return { dims: [...dims], frames, spacing: [...spacing], range, mean: sum / (dims[0] * dims[1] * dims[2]) };
}

async function readVolume(path) {
  const bytes = await bytesOf(path);
  // Of the files beside a header of Analyze or NIfTI, only those with its name.
  const stem = basename(path).replace(/\.hdr$/i, '');
  const isPair = /\.hdr$/i.test(path);
  const isHeader = isPair || /\.(nhdr|mhd)$/i.test(path) || /\.mha$/i.test(path);
  const files = isHeader
    ? (await filesBeside(path)).filter(({ name }) => !isPair || /^\.img(\.gz)?$/i.test(name.slice(stem.length)))
    : undefined;
  return inVolume(Volume.parse(bytes, files && { files }));
}

function inVolume(volume) {
  const found = { facts: volumeFacts(volume), warnings: volume.warnings.length };
  volume.free();
  return found;
}

async function readMesh(path) {
  const files = /\.gltf$/i.test(path) ? await filesBeside(path) : [];
  const mesh = Mesh.parse(await bytesOf(path), { files });
  const { area, volume } = mesh.info();
  const found = {
    facts: { triangles: mesh.triangleCount, area, ...(mesh.check().closed && { volume }) },
    warnings: mesh.warnings.length,
  };
  mesh.free();
  return found;
}

async function readPoints(path) {
  const { points, warnings = [] } = parsePoints(await bytesOf(path));
  return { facts: { points: points.length / 3 }, warnings: warnings.length };
}

const file = async (path) => ({ name: basename(path), bytes: await openAsBlob(path) });

/** Readers by class; a DICOM file with one image is no volume, and counts as refused. */
const READERS = {
  volume: readVolume,
  mesh: readMesh,
  points: readPoints,
  tiff: async (path) => inVolume(new Volume(await readTiff(await file(path)))),
  dicom: async (path) => inVolume(new Volume(await readDicom([await file(path)]))),
};

async function answer({ path, kind }) {
  try {
    return { status: 'read', ...(await READERS[kind](path)) };
  } catch (error) {
    if (error instanceof VesicleError) return { status: 'refused', reason: error.message };
    return { status: 'crash', reason: String(error?.stack ?? error).slice(0, 400) };
  }
}

await init();
for await (const line of createInterface({ input: process.stdin }))
  process.stdout.write(`${JSON.stringify(await answer(JSON.parse(line)))}\n`);
