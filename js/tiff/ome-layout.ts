// Which pages of an OME-TIFF, of one or several files, are which slices.

import type { Pause } from '../pause.js';
import { shortened } from '../short-text.js';
import type { Page } from './directory.js';
import { badTiff } from './error.js';
import { type Format, formatOf, PHOTOMETRIC } from './format.js';
import {
  allSamples,
  type Channel,
  type Components,
  checkChannels,
  componentsOf,
  type Layout,
  orientationOf,
  type Sizes,
} from './layout.js';
import { spacingOf } from './lengths.js';
import type { Ome, OmeImage, TiffData } from './ome.js';
import { Finder, type OmeFile } from './ome-files.js';
import type { Part } from './planes.js';

/** Photometric interpretations whose samples may be channels. */
const CHANNELS: number[] = [PHOTOMETRIC.whiteIsZero, PHOTOMETRIC.blackIsZero, PHOTOMETRIC.rgb];

/** Most characters of the name of a channel, to which the number of a sample may be added. */
const LONGEST_CHANNEL = 180;

/** Position of a page. */
type Place = { z: number; c: number; t: number };

/** Returns the stack of the first image of a description that has a page in the files. */
export async function omeStack(main: OmeFile, ome: Ome, files: OmeFile[], pause: Pause): Promise<Layout> {
  const finder = new Finder(main, ome, files);
  for (const [k, image] of ome.images.entries()) {
    const placing = await Placing.of(main, image, finder);
    if (!placing) continue;
    await placing.place(pause);
    if (placing.isEmpty) continue;
    const others = ome.images.length - 1;
    const name = image.name ? ` ("${shortened(image.name)}")` : '';
    const several = others > 0 ? [`the file has ${others + 1} images: number ${k + 1}${name} is read`] : [];
    return placing.layout([...several, ...(others > 0 ? [] : placing.unplaced())]);
  }
  throw badTiff(main.source.name, 'its OME description places no page of the files that were opened');
}

/** The pages of one image of a description. */
class Placing {
  readonly #main: OmeFile;
  readonly #image: OmeImage;
  readonly #finder: Finder;
  readonly #components: Components;
  readonly #sizes: Sizes;
  /** Number of channels of a page. */
  readonly #perPage: number;
  readonly #pages = new Map<number, Page>();
  readonly #placeOf = new Map<Page, number>();
  readonly #used = new Set<OmeFile>();
  /** Names of files that were not opened, by their channel. */
  readonly #absent = new Map<number, string>();
  /** Number of pages of each frame of each channel. */
  readonly #channels = new Map<number, Map<number, number>>();
  #repeated = 0;
  #end = { z: 0, t: 0 };

  private constructor(
    main: OmeFile,
    image: OmeImage,
    finder: Finder,
    page: Page,
    samples: number,
    components: Components,
  ) {
    [this.#main, this.#image, this.#finder] = [main, image, finder];
    const { Z, C, T } = image.sizes;
    // All samples of a page count as channels.
    this.#perPage = samples > 1 && C % samples === 0 ? samples : 1;
    this.#components = components;
    this.#sizes = { Z, C: C / this.#perPage, T };
    if (Z * C * T > Number.MAX_SAFE_INTEGER)
      throw badTiff(page.label, `SizeZ, SizeC, SizeT ${Z}, ${C}, ${T} are too large`);
  }

  /** Returns the pages of an image before they are placed; undefined if none was opened. */
  static async of(main: OmeFile, image: OmeImage, finder: Finder): Promise<Placing | undefined> {
    if (image.tiffData.length === 0) image.tiffData.push({ ifd: 0, count: undefined, first: { Z: 0, C: 0, T: 0 } });
    for (const { file, ifd } of image.tiffData) {
      const page = finder.find(file)?.pages[ifd];
      if (!page) continue;
      const format = await formatOf(page);
      const isSplit = image.sizes.C % format.samples === 0 && CHANNELS.includes(format.photometric);
      const { parts, warnings } = isSplit ? allSamples(format.samples) : await componentsOf(page, format);
      const all = [...warnings, ...contradictions(image, format), ...(await orientationOf(page))];
      return new Placing(main, image, finder, page, format.samples, { parts, warnings: all });
    }
    return undefined;
  }

  get isEmpty(): boolean {
    return this.#pages.size === 0;
  }

  /** Places all pages. */
  async place(pause: Pause): Promise<void> {
    for (const data of this.#image.tiffData) {
      const first = { ...data.first, C: Math.floor(data.first.C / this.#perPage) };
      const file = this.#finder.find(data.file);
      if (file) this.#placeRun(file, data, first);
      else if (!this.#absent.has(first.C)) this.#absent.set(first.C, data.file?.name ?? data.file?.uuid ?? '');
      await pause.turn();
    }
  }

  /** Places pages that follow each other. */
  #placeRun(file: OmeFile, { ifd, count = Infinity }: TiffData, first: Sizes): void {
    const outside = (['Z', 'C', 'T'] as const).find((axis) => first[axis] >= this.#sizes[axis]);
    if (outside) {
      const problem = `TiffData: First${outside} is ${first[outside]}, Size${outside} ${this.#image.sizes[outside]}`;
      throw badTiff(this.#main.source.name, problem);
    }
    this.#used.add(file);
    let place: Place | undefined = { z: first.Z, c: first.C, t: first.T };
    for (let k = ifd; k < Math.min(ifd + count, file.pages.length) && place; k++) {
      const page = file.pages[k];
      if (page) this.#add(page, place);
      place = this.#next(place);
    }
  }

  #add(page: Page, { z, c, t }: Place): void {
    const key = this.#key(z, c, t);
    const [before, other] = [this.#placeOf.get(page), this.#pages.get(key)];
    if (before === key) {
      this.#repeat(page);
      return;
    }
    const place = `slice ${z + 1}, channel ${c + 1}, frame ${t + 1}`;
    if (before !== undefined) throw badTiff(page.label, `TiffData: the page is at ${place}, and at another place`);
    if (other) throw badTiff(page.label, `TiffData: ${place} is this page, and another one`);
    this.#pages.set(key, page);
    this.#placeOf.set(page, key);
    const frames = this.#channels.get(c) ?? new Map<number, number>();
    this.#channels.set(c, frames.set(t, (frames.get(t) ?? 0) + 1));
    this.#end = { z: Math.max(this.#end.z, z + 1), t: Math.max(this.#end.t, t + 1) };
  }

  /** Lets a page be placed again where it is, but not so often that it takes long. */
  #repeat(page: Page): void {
    this.#repeated += 1;
    if (this.#repeated <= 1000 + 10 * this.#pages.size) return;
    throw badTiff(page.label, 'TiffData: pages are placed again and again');
  }

  #key(z: number, c: number, t: number): number {
    return (t * this.#sizes.C + c) * this.#sizes.Z + z;
  }

  /** Returns the place after another one in the order of the image; undefined after the last. */
  #next(place: Place): Place | undefined {
    const next = { ...place };
    for (const axis of this.#image.order.toLowerCase() as Iterable<keyof Place>) {
      next[axis] += 1;
      if (next[axis] < this.#sizes[axis.toUpperCase() as keyof Sizes]) return next;
      next[axis] = 0;
    }
    return undefined;
  }

  /** Returns a warning about pages of the files that have no place. */
  unplaced(): string[] {
    const pages = [...this.#used].reduce((sum, file) => sum + file.pages.length, 0);
    const left = pages - this.#pages.size;
    return left > 0 ? [`${left} pages have no place in the OME description and are left out`] : [];
  }

  /** Returns the stack. */
  layout(warnings: string[]): Layout {
    const { axes, frameSeconds } = this.#image;
    const found = [...this.#channels].sort(([a], [b]) => a - b);
    const complete = found.map(([c, counts]) => ({ c, frames: this.#completeFrames(counts) }));
    // Recordings may have been stopped early.
    const frames = complete.reduce((least, one) => (one.frames > 0 ? Math.min(least, one.frames) : least), this.#end.t);
    const { spacing, unit, assumed } = spacingOf(axes, this.#end.z);
    checkChannels(this.#main.source.name, found.length * this.#components.parts.length);
    return {
      channels: complete.flatMap((one) => this.#channel(one.c, one.frames < frames)),
      ...{ slices: this.#end.z, frames, spacing, unit, frameSeconds },
      warnings: [...warnings, ...this.#fewer(frames), ...assumed, ...this.#components.warnings],
      remarks: this.#left(),
    };
  }

  /** Returns the number of frames of a channel that are complete, if no later one has pages; else 0. */
  #completeFrames(counts: Map<number, number>): number {
    let complete = 0;
    while (counts.get(complete) === this.#end.z) complete += 1;
    return [...counts.keys()].some((frame) => frame > complete) ? 0 : complete;
  }

  #channel(c: number, isMissing: boolean): Channel[] {
    const name = this.#nameOf(c);
    const planeAt = (z: number, t: number, part: Part) => {
      const page = this.#pages.get(this.#key(z, c, t));
      if (page) return { page, part, after: 0 };
      throw badTiff(this.#main.source.name, this.#missing(c, z, t));
    };
    const missing = isMissing ? this.#firstMissing(c) : undefined;
    return this.#components.parts.map((one) => ({
      name: this.#components.parts.length > 1 ? `${name} ${one.name}` : name,
      planeAt: (z: number, t: number) => planeAt(z, t, one.part),
      ...(missing && { missing }),
    }));
  }

  #nameOf(c: number): string {
    const name = this.#image.channels[this.#image.channels.length === this.#sizes.C ? c : -1];
    return name ? shortened(name, LONGEST_CHANNEL) : `channel ${c + 1}`;
  }

  #firstMissing(c: number): string {
    let k = 0;
    while (this.#pages.has(this.#key(k % this.#end.z, c, Math.floor(k / this.#end.z)))) k += 1;
    return this.#missing(c, k % this.#end.z, Math.floor(k / this.#end.z));
  }

  #missing(c: number, z: number, t: number): string {
    const file = this.#absent.get(c);
    const hint = file ? `: the file "${shortened(file)}" of the data set was not opened` : '';
    return `slice ${z + 1} of frame ${t + 1} of ${this.#nameOf(c)} is missing${hint}`;
  }

  /** Returns a warning about slices and frames that are described, but not there. */
  #fewer(frames: number): string[] {
    const { Z, T } = this.#sizes;
    const counts: [string, number, number][] = [
      ['slices', this.#end.z, Z],
      ['frames', frames, T],
    ];
    const fewer = counts.filter(([, found, described]) => found < described);
    return fewer.map(
      ([name, found, described]) => `${described} ${name} are described, but only ${found} are complete`,
    );
  }

  /** Returns a remark about channels that have no pages. */
  #left(): string[] {
    const { C } = this.#sizes;
    if (this.#channels.size === C) return [];
    const names: string[] = [];
    for (let c = 0; c < C && names.length < 10; c++) {
      const file = this.#absent.get(c);
      if (!this.#channels.has(c)) names.push(`${this.#nameOf(c)}${file ? ` (in "${shortened(file, 50)}")` : ''}`);
    }
    return [`${C - this.#channels.size} of ${C} channels are not in the files that were opened: ${names.join(', ')}`];
  }
}

/** Names of the types in OME's XML. */
const KINDS = new Map<string, Format['type']['kind']>([
  ['int', 'signed'],
  ['uint', 'unsigned'],
  ['float', 'float'],
  ['double', 'float'],
]);

/** Returns warnings about what pages are, and the description says otherwise. */
function contradictions({ sizes, type }: OmeImage, format: Format): string[] {
  const found: string[] = [];
  const isOther = sizes.X !== format.width || sizes.Y !== format.height;
  if (isOther && sizes.X > 0 && sizes.Y > 0) {
    const described = `${sizes.X} × ${sizes.Y} pixels are described`;
    found.push(`${described}, the pages have ${format.width} × ${format.height}: voxel sizes may be wrong`);
  }
  const kind = KINDS.get(/^[a-z]+/.exec(type)?.[0] ?? '');
  if (kind && kind !== format.type.kind)
    found.push(
      `the described type is ${shortened(type, 50)}, but samples are read as ${format.type.kind}, as the pages say`,
    );
  return found;
}
