/** Worker that reads formats of other programs (DICOM, TIFF) and writes them as files that all labs read. */
import init, { Volume, type VolumeInit } from 'vesicle';
import { send, VesicleError, withTransfer } from 'vesicle/channel';
import { type Decoders, type DicomVolume, openDicom } from 'vesicle/dicom';
import { openTiff } from 'vesicle/tiff';
import { type Label, newLabel } from '../engine/labels';
import type { FileNotes, NamedBytes } from '../engine/protocol';
import { type Handlers, serve } from '../engine/serving';
import { withLabels } from '../engine/slicer';
import { text } from '../texts';
import type { Candidate, Listing, ProgressEvent, Requests } from './protocol';
import { HEAD, isTiff } from './recognise';

/** A volume of the last list: how the page shows it, and how it is read. */
interface Listed {
  candidate: Omit<Candidate, 'id'>;
  read: (resample: boolean) => Promise<NamedBytes>;
}

let listed: Listed[] = [];

const beside = (file: string) => new URL(`./dicom/${file}`, pageAddress());

/** Decoders of compressed DICOM images, each loaded with the first image that needs it. */
const decoders: Decoders = {
  jpeg: {
    load: () => import('@cornerstonejs/codec-libjpeg-turbo-8bit/decodewasmjs'),
    wasm: beside('libjpegturbowasm_decode.wasm'),
  },
  jpegLossless: { load: () => import('@cornerstonejs/jpeg-lossless-decoder-js') },
  jpegLs: { load: () => import('@cornerstonejs/codec-charls/decodewasmjs'), wasm: beside('charlswasm_decode.wasm') },
  jpeg2000: {
    load: () => import('@cornerstonejs/codec-openjpeg/decodewasmjs'),
    wasm: beside('openjpegwasm_decode.wasm'),
  },
  htj2k: { load: () => import('@cornerstonejs/codec-openjph/wasmjs'), wasm: beside('openjphjs.wasm') },
};

/** Returns the address of the page: the worker's own file is in a subfolder of the built page. */
function pageAddress(): string {
  return new URL(import.meta.env.DEV ? import.meta.env.BASE_URL : '../', self.location.href).href;
}

const tell =
  (stage: ProgressEvent['stage']) =>
  ({ done, total }: { done: number; total: number }) =>
    send<ProgressEvent>({ event: 'progress', stage, done, total });

async function list({ files }: { files: File[] }): Promise<Listing> {
  const heads = await Promise.all(files.map(async (file) => new Uint8Array(await file.slice(0, HEAD).arrayBuffer())));
  const { candidates, skipped } = heads.every(isTiff) ? await listTiff(files) : await listDicom(files);
  listed = candidates;
  return { candidates: listed.map(({ candidate }, id) => ({ ...candidate, id })), skipped };
}

async function listTiff(files: File[]): Promise<Found> {
  const stack = await openTiff(files);
  const { dims, spacing, frames, unit = '', warnings, remarks, channels } = stack;
  if (dims[2] === 1) throw new VesicleError('bad-file', text('files.singleSlice', { format: 'TIFF' }));
  const stem = files[0]?.name.replace(/(\.ome)?\.tiff?$/i, '') ?? '';
  const known = { kind: 'image', patient: '', modality: '', date: '', uneven: undefined, remarks: [] } as const;
  const candidates = channels.map(({ name }, channel): Listed => {
    const label = /^channel\b/i.test(name) ? name : text('importing.channel', { name });
    const own = channels.length > 1 ? `${stem}, ${label}` : stem;
    const title = files.length === 1 ? (files[0]?.name ?? own) : own;
    const shown = {
      ...known,
      name: own,
      title: channels.length > 1 ? `${title}, ${name}` : title,
      dims,
      spacing,
      frames,
      images: dims[2] * frames,
      unit: unit === 'um' ? 'µm' : unit,
    };
    const onProgress = (share: number) =>
      tell('images')({ done: Math.round(share * shown.images), total: shown.images });
    return {
      candidate: { ...shown, remarks: [...remarks], warnings: warnings.map(({ text }) => text) },
      read: async () => written(own, await stack.read({ channel, onProgress }), { remarks: [...remarks] }),
    };
  });
  return { candidates, skipped: [] };
}

interface Found {
  candidates: Listed[];
  skipped: Listing['skipped'];
}

async function listDicom(files: File[]): Promise<Found> {
  const { volumes, skipped } = await openDicom(files, { onProgress: tell('headers') });
  return {
    candidates: volumes.map((volume) => ({
      candidate: dicomCandidate(volume),
      read: (resample) => readDicom(volume, resample),
    })),
    skipped: skipped.map(({ name, reason }) => ({ name, reason })),
  };
}

function dicomCandidate(volume: DicomVolume): Omit<Candidate, 'id'> {
  const { kind, name, patient, modality, date, dims, spacing, frames, images, remarks, uneven } = volume;
  const known = { kind, name, title: name, patient, modality, date, dims, spacing, frames, images, uneven };
  return { ...known, unit: 'mm', warnings: volume.warnings.map(({ text }) => text), remarks: [...remarks] };
}

async function readDicom(volume: DicomVolume, resample: boolean): Promise<NamedBytes> {
  const uneven = resample ? 'resample' : 'refuse';
  const init = await volume.read({ uneven, decoders, onProgress: tell('images') });
  const { name, inverted, remarks, segments } = volume;
  const notes = { remarks: [...remarks], ...(inverted && { inverted }) };
  if (volume.kind === 'image') return written(name, init, notes);
  const labels = segments.map(({ value, ...known }) => newLabel(value, known));
  return written(name, init, notes, labels);
}

async function read({ ids, resample }: Requests['read']['body']): Promise<NamedBytes[]> {
  await init();
  const files: NamedBytes[] = [];
  for (const id of ids) {
    const volume = listed[id];
    if (!volume) throw new VesicleError('invalid-argument', text('importing.noVolume'));
    files.push(await volume.read(resample));
  }
  return withTransfer(
    files,
    files.map(({ bytes }) => bytes),
  );
}

/** Returns a volume as a file: labels as NRRD with their names and colours, intensities as NIfTI. */
function written(name: string, init: VolumeInit, known: Omit<FileNotes, 'warnings'>, labels?: Label[]): NamedBytes {
  const { warnings = [], ...voxels } = init;
  const volume = new Volume(voxels);
  try {
    const stem =
      name
        .replace(/[\\/:*?"<>|\p{Cc}]+/gu, ' ')
        .trim()
        .slice(0, 80) || 'volume';
    const notes: FileNotes = { ...known, warnings };
    if (labels)
      return { name: `${stem}.seg.nrrd`, bytes: withLabels(volume.toBytes('nrrd'), labels, volume.dims), notes };
    // NIfTI is always in RAS.
    return {
      name: `${stem}.nii`,
      bytes: volume.toNifti(),
      notes: { ...notes, ...(init.space === 'LPS' && { space: 'LPS' }) },
    };
  } finally {
    volume.free();
  }
}

serve({ list, read } satisfies Handlers<Requests>);
