/** Parses the description of the stack in a TIFF file: OME's XML, or the lines of ImageJ. */

export interface Stack {
  /**
   * Indices of the pages of the file, or files, that make up the volume: all slices of the first frame, then those of
   * the next.
   */
  pages: number[];
  frames: number;
  /** Voxel sizes along x, y and z in the description's unit of length; undefined where it has none. */
  spacing: [number | undefined, number | undefined, number | undefined];
  /**
   * Whether the pages' resolution tags count pixels per unit of length of the description, as in ImageJ; else they are
   * not used.
   */
  perUnit: boolean;
}

/**
 * Parses the description of a stack of `count` pages; if it is neither OME's nor ImageJ's, all pages are slices of one
 * frame.
 */
export function describedIn(text: string, count: number): Stack {
  if (/<OME[\s>]/.test(text)) return fromOme(text, count);
  if (text.startsWith('ImageJ=')) return fromImageJ(text, count);
  return { pages: range(count), frames: 1, spacing: [undefined, undefined, undefined], perUnit: false };
}

const range = (count: number) => Array.from({ length: count }, (_, k) => k);

/** Parses a number above 0 in a description; undefined for anything else. */
function positive(text: string | undefined): number | undefined {
  const value = Number(text);
  return text !== undefined && Number.isFinite(value) && value > 0 ? value : undefined;
}

function fromOme(text: string, count: number): Stack {
  const pixels = /<Pixels\b[^>]*>/.exec(text)?.[0] ?? '';
  const attribute = (name: string) => new RegExp(`\\b${name}\\s*=\\s*["']([^"']*)["']`).exec(pixels)?.[1];
  const size = (name: string) => Math.max(1, Math.floor(positive(attribute(name)) ?? 1));
  const sizes = { Z: size('SizeZ'), C: size('SizeC'), T: size('SizeT') };
  const order = /^XY([ZCT]{3})$/.exec(attribute('DimensionOrder') ?? '')?.[1] ?? 'ZCT';
  const spacing = ['PhysicalSizeX', 'PhysicalSizeY', 'PhysicalSizeZ'].map((name) => positive(attribute(name)));
  return { ...ordered(sizes, order, count), spacing: spacing as Stack['spacing'], perUnit: false };
}

function fromImageJ(text: string, count: number): Stack {
  const lines = new Map(text.split('\n').map((line) => line.split('=', 2) as [string, string | undefined]));
  const size = (name: string) => Math.max(1, Math.floor(positive(lines.get(name)) ?? 1));
  const [channels, frames] = [size('channels'), size('frames')];
  const slices = lines.has('slices') ? size('slices') : Math.floor(count / (channels * frames));
  const spacing: Stack['spacing'] = [undefined, undefined, positive(lines.get('spacing'))];
  return { ...ordered({ Z: slices, C: channels, T: frames }, 'CZT', count), spacing, perUnit: true };
}

/**
 * Returns the pages of the first channel, frame after frame, from a file that stores slices (Z), channels (C) and
 * frames (T) in `order`, the fastest first. If `count`, the number of pages of the file, is too small for that, all
 * pages are slices of one frame.
 */
function ordered(sizes: Record<string, number>, order: string, count: number): Pick<Stack, 'pages' | 'frames'> {
  const { Z = 1, T = 1 } = sizes;
  const stride = (letter: string) => {
    const before = [...order].slice(0, order.indexOf(letter));
    return before.reduce((product, other) => product * (sizes[other] ?? 1), 1);
  };
  const pages = range(T).flatMap((t) => range(Z).map((z) => z * stride('Z') + t * stride('T')));
  // A description that does not fit the pages is ignored.
  const fits = pages.every((page) => page < count);
  return fits ? { pages, frames: T } : { pages: range(count), frames: 1 };
}
