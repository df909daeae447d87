// A stack that was opened, and the reading of its voxels.
import { checkProperties, integer, invalid } from '../check.js';
import type { LengthUnit, Vec3, VolumeInit, VoxelArray } from '../data.js';
import { type Pause, withPause } from '../pause.js';
import { shortened } from '../short-text.js';
import { isSmall, noted, unpackingProblem } from '../small-files.js';
import { checkListener, checkSignal } from '../stepper.js';
import type { Warning } from '../warning.js';
import { decodedBytes, numberBytes } from './blocks.js';
import { badTiff, tooLarge } from './error.js';
import { arrayOf, type Format, formatOf } from './format.js';
import type { Channel, Layout } from './layout.js';
import { type Listener, type Plane, readPlane, WEIGHTS } from './planes.js';
import type { Source } from './source.js';

/** Options of reading a stack. */
export interface TiffOptions {
  /** Index of the channel to read; default 0. */
  channel?: number;
  /** Aborts the reading, which then rejects with `signal.reason`. */
  signal?: AbortSignal;
  /**
   * Called repeatedly with the fraction that has been read, up to 1. If it throws, the reading ends with that error.
   */
  onProgress?: (share: number) => void;
}

/** A channel of a stack. */
export interface TiffChannel {
  /** Its name in the file, or else its number. */
  readonly name: string;
}

/** Largest number of bytes of a volume: what fits into the memory of a WebAssembly module. */
const LARGEST = 2 ** 32;

/** Bytes that a small file may stand for, whatever its size. */
const SMALL = 2 ** 16;

/** Times that the bytes of a file may be read for a volume: some writers store equal tiles once. */
const MOST_TIMES = 16;

const OPTIONS = ['channel', 'signal', 'onProgress'];

/** Returns the options of reading once they are checked; throws `invalid-argument` for an unknown or wrong one. */
export function checkedOptions(given: TiffOptions | undefined): TiffOptions {
  const options = checkProperties<TiffOptions>('options', given, OPTIONS);
  if (options.channel !== undefined) integer('channel', options.channel);
  checkSignal(options.signal);
  checkListener('onProgress', options.onProgress);
  return options;
}

/** A stack of TIFF images, whose voxels are read channel by channel. */
export class TiffStack {
  /** The channels, in the order of their index. */
  readonly channels: readonly TiffChannel[];
  /** Number of voxels along x, y and z. */
  readonly dims: Vec3;
  /** Number of frames. */
  readonly frames: number;
  /** Voxel size along x, y and z, in `unit`; 1 where none is stated. */
  readonly spacing: Vec3;
  /** Length of a unit of `spacing`; undefined if it is not stated. */
  readonly unit: LengthUnit | undefined;
  /** Seconds from one frame to the next; undefined if not stated, or there is one frame. */
  readonly frameSeconds: number | undefined;
  /** Findings of the reader: assumptions that it made, and parts that it leaves out. */
  readonly warnings: readonly Warning[];
  /** Facts that do not affect the voxels, such as channels in files that were not opened. */
  readonly remarks: readonly string[];
  readonly #layout: Layout;
  readonly #sources: Source[];

  /** @internal */
  constructor(layout: Layout, [width, height]: [number, number], sources: Source[]) {
    this.channels = layout.channels.map(({ name }) => ({ name: shortened(name) }));
    this.dims = [width, height, layout.slices];
    this.frames = layout.frames;
    this.spacing = [...layout.spacing];
    this.unit = layout.unit;
    this.frameSeconds = layout.frames > 1 ? layout.frameSeconds : undefined;
    this.warnings = layout.warnings.map(warning);
    this.remarks = (layout.remarks ?? []).map((remark) => shortened(remark, LONGEST_TEXT));
    this.#layout = layout;
    this.#sources = sources;
  }

  /**
   * Reads the voxels of a channel, as options of a `Volume`.
   *
   * @throws `VesicleError` `bad-file`: truncated, damaged, or stored in a way that is not supported; `too-large`: more
   *   than 4 GB, or more than files of this size can hold; `invalid-argument` naming the option. `signal.reason` when
   *   aborted.
   */
  async read(given?: TiffOptions): Promise<VolumeInit> {
    const { channel, signal, onProgress } = checkedOptions(given);
    const chosen = this.#layout.channels[channel ?? 0];
    if (!chosen) throw invalid('channel', `must be an integer from 0 to ${this.channels.length - 1}, got ${channel}`);
    if (chosen.missing) throw badTiff(this.#sources[0]?.name ?? '', chosen.missing);
    const warnings = [...this.warnings];
    const lost = new Set<string>();
    const data = await withPause(signal, async (pause) => {
      const formats = await this.#formats(chosen, pause);
      return this.#voxels(chosen, formats, { pause, onProgress, lost });
    });
    if (lost.size > 0)
      warnings.push(warning(`${[...lost][0]}: parts of the image are not stored in the file: they are 0`));
    return this.#init(data, warnings);
  }

  #init(data: VoxelArray, warnings: Warning[]): VolumeInit {
    return {
      data,
      dims: this.frames > 1 ? [...this.dims, this.frames] : [...this.dims],
      spacing: [...this.spacing],
      ...(this.unit && { unit: this.unit }),
      ...(this.frameSeconds && { frameSeconds: this.frameSeconds }),
      ...this.#layout.calibration,
      ...(warnings.length > 0 && { warnings }),
    };
  }

  /** Returns the slices of a channel, frame after frame. */
  *#planes({ planeAt }: Channel): Generator<Plane> {
    for (let frame = 0; frame < this.frames; frame++)
      for (let slice = 0; slice < this.#layout.slices; slice++) yield planeAt(slice, frame);
  }

  /** Reads how the slices are stored, which must be of the same size and type, before memory is allocated for them. */
  async #formats(channel: Channel, pause: Pause): Promise<Map<Plane['page'], Format>> {
    const formats = new Map<Plane['page'], Format>();
    // Most pages are alike.
    const kinds = new Map<string, Format>();
    let [bytes, unpacked, ratio] = [0, 0, 1];
    for (const { page } of this.#planes(channel)) {
      const known = formats.get(page);
      const format = known ?? shared(kinds, await formatOf(page));
      formats.set(page, format);
      if (!known) this.#checkAlike(page.label, format, formats.values().next().value ?? format);
      bytes += decodedBytes(format);
      unpacked += numberBytes(format);
      ratio = Math.max(ratio, format.ratio);
      await pause.turn();
    }
    this.#checkSize(bytes, ratio);
    this.#checkMemory(channel, formats, unpacked);
    return formats;
  }

  #checkAlike(label: string, format: Format, first: Format): void {
    const shown = ({ width, height, type }: Format) => `${width} × ${height} pixels, ${type.kind}, ${type.bits} bits`;
    const [own, wanted] = [shown(format), shown(first)];
    if (own !== wanted) throw badTiff(label, `the image has ${own}, but the first one ${wanted}`);
    const [width, height] = this.dims;
    // Each channel may have its own type.
    if (format.width !== width || format.height !== height)
      throw badTiff(label, `the image has ${own}, but those of other channels ${width} × ${height} pixels`);
  }

  /** Throws `too-large` if the files cannot hold so many bytes, or a volume cannot. */
  #checkSize(bytes: number, ratio: number): void {
    const size = this.#size();
    const name = this.#sources[0]?.name ?? '';
    if (bytes <= Math.max(SMALL, ratio * size)) return;
    throw tooLarge(name, `the images have ${Math.round(bytes)} bytes, more than ${size} bytes of files can hold`);
  }

  /**
   * Throws `too-large` if the voxels take much memory for the size of the files, as those of masks without any object would.
   * Small files count with all their channels, which are mostly read one after the other, and with all that is unpacked
   * for one of them, `unpacked` bytes.
   */
  #checkMemory(channel: Channel, formats: Map<Plane['page'], Format>, unpacked: number): void {
    const [first] = formats.values();
    if (!first) return;
    const each = first.width * first.height * new (arrayOf(first.type))(0).BYTES_PER_ELEMENT;
    const isMixed = channel.planeAt(0, 0).part === 'luminance';
    const images = this.#layout.slices * this.frames;
    const size = this.#size();
    const channels = isSmall(size) ? this.#layout.channels.filter(({ missing }) => !missing).length : 1;
    const voxels = each * (images * channels + (isMixed ? WEIGHTS.length : 0));
    const bytes = isSmall(size) ? Math.max(voxels, unpacked) : voxels;
    const problem = unpackingProblem(bytes, size);
    if (problem) throw tooLarge(this.#sources[0]?.name ?? '', problem);
  }

  #size(): number {
    return this.#sources.reduce((sum, source) => sum + source.size, 0);
  }

  async #voxels(channel: Channel, formats: Map<Plane['page'], Format>, watch: Watch): Promise<VoxelArray> {
    const [first] = formats.values();
    if (!first) throw badTiff(this.#sources[0]?.name ?? '', 'no images');
    const [each, count] = [first.width * first.height, this.#layout.slices * this.frames];
    const data = this.#allocate(arrayOf(first.type), each * count);
    let done = 0;
    let left = MOST_TIMES * this.#size() + SMALL;
    const listener: Listener = {
      stored: (bytes, { label }) => {
        left -= bytes;
        if (left < 0)
          throw tooLarge(label, 'its strips or tiles share their bytes, and are more than the file can hold');
      },
      pause: watch.pause,
      progress: (share) => watch.onProgress?.((done + share) / count),
      missing: ({ label }) => watch.lost.add(label),
    };
    for (const plane of this.#planes(channel)) {
      const slice = data.subarray(done * each, (done + 1) * each) as VoxelArray;
      await readPlane(plane, formats.get(plane.page) ?? first, slice, listener);
      done += 1;
    }
    const narrow = first.type.bits === 64 && first.type.kind !== 'float' ? narrowed(data, first.type.kind) : data;
    return noted(narrow, this.#size());
  }

  #allocate(Kind: new (length: number) => VoxelArray, length: number): VoxelArray {
    const name = this.#sources[0]?.name ?? '';
    const bytes = length * new Kind(0).BYTES_PER_ELEMENT;
    if (bytes > LARGEST) throw tooLarge(name, `the volume has ${bytes} bytes; at most ${LARGEST} (4 GiB) are read`);
    try {
      return new Kind(length);
    } catch {
      throw tooLarge(name, `there is no memory for the ${bytes} bytes of the volume`);
    }
  }
}

interface Watch {
  pause: Pause;
  onProgress: TiffOptions['onProgress'];
  /** Names of pages parts of which are not stored. */
  lost: Set<string>;
}

/** Returns a format that was there before, if one is equal. */
function shared(kinds: Map<string, Format>, format: Format): Format {
  const key = JSON.stringify(format);
  const before = kinds.get(key) ?? format;
  kinds.set(key, before);
  return before;
}

/** Most characters of a warning or remark. */
const LONGEST_TEXT = 1000;

const warning = (text: string): Warning => ({ code: 'reader', text: shortened(`TIFF: ${text}`, LONGEST_TEXT) });

/** Returns 64-bit integers, as doubles, in 32 bits if all of them fit. */
function narrowed(data: VoxelArray, kind: 'signed' | 'unsigned'): VoxelArray {
  const [low, high] = kind === 'signed' ? [-(2 ** 31), 2 ** 31 - 1] : [0, 2 ** 32 - 1];
  if (!data.every((value) => value >= low && value <= high)) return data;
  return kind === 'signed' ? Int32Array.from(data) : Uint32Array.from(data);
}
