/** What a TIFF file says in words of the stack in it: OME’s XML, or the lines of ImageJ. */

export interface Stack {
  /** Pages of the volume, x and y within each, then z, then time. */
  pages: number[];
  frames: number;
  /** Sizes of a voxel that were told. */
  spacing: [number | undefined, number | undefined, number | undefined];
  /** The resolution of a page is in the unit of the stack. */
  perUnit: boolean;
}

/** The stack in a description; where there is none, all pages are slices. */
export function describedIn(text: string, count: number): Stack {
  if (/<OME[\s>]/.test(text)) return fromOme(text, count);
  if (text.startsWith('ImageJ=')) return fromImageJ(text, count);
  return { pages: range(count), frames: 1, spacing: [undefined, undefined, undefined], perUnit: false };
}

const range = (count: number) => Array.from({ length: count }, (_, k) => k);

/** A number above 0. */
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

/** Pages of the first channel, z before time, of a file in which they come in `order`, fastest first. */
function ordered(sizes: Record<string, number>, order: string, count: number): Pick<Stack, 'pages' | 'frames'> {
  const { Z = 1, T = 1 } = sizes;
  const stride = (letter: string) => {
    const before = [...order].slice(0, order.indexOf(letter));
    return before.reduce((product, other) => product * (sizes[other] ?? 1), 1);
  };
  const pages = range(T).flatMap((t) => range(Z).map((z) => z * stride('Z') + t * stride('T')));
  // Words that do not fit the pages are about something else.
  const fits = pages.every((page) => page < count);
  return fits ? { pages, frames: T } : { pages: range(count), frames: 1 };
}
