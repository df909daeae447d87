import type { LabelArray } from '../../engine/labels';
import { context2d } from '../../kit/dom';
import type { SliceOrientation } from '../../scene/anatomy';
import { pictureSize } from '../../scene/slicing';
import type { Vec3 } from './protocol';

/** Colours of labels: red, green, blue, 0..255. */
export type LabelColors = ReadonlyMap<number, readonly [number, number, number]>;

/** Content that is drawn over the slices: the labels, and the voxels that a threshold brush paints. */
export interface Overlays {
  dims: Vec3;
  voxels: LabelArray;
  /** Colours of the visible labels. */
  colors: LabelColors;
  /** Names of all labels, for descriptions. */
  names: ReadonlyMap<number, string>;
  /** 0..1; 0 hides the labels. */
  opacity: number;
  /** Colour of the label that the tools paint. */
  paint: readonly [number, number, number];
  /** Not 0 for the voxels that the threshold brush paints; undefined while another tool is in use. */
  mask: Uint8Array | undefined;
}

/** Opacity (0..255) of the tint of background voxels that the threshold brush paints. */
const TINT = 70;
/** Share of white in the colour of the labelled voxels that it paints. */
const LIGHTER = 0.45;

/** The image of the labels of one slice, one pixel a voxel, with the background transparent. */
export class LabelPicture {
  readonly canvas = document.createElement('canvas');
  readonly #orientation: SliceOrientation;
  readonly #pixels: ImageData;

  constructor(dims: Vec3, orientation: SliceOrientation) {
    const { width, height } = pictureSize({ dims }, orientation);
    Object.assign(this.canvas, { width, height });
    this.#orientation = orientation;
    this.#pixels = new ImageData(width, height);
  }

  /** Paints the slice with the given index; returns the number of voxels of each label in it. */
  paint({ dims, voxels, colors, opacity, paint, mask }: Overlays, index: number): Map<number, number> {
    const { axis, horizontal, vertical } = this.#orientation;
    const { width, height } = this.canvas;
    const strides = [1, dims[0], dims[0] * dims[1]] as const;
    const out = new Uint32Array(this.#pixels.data.buffer);
    const shades = shadesOf({ colors, opacity, paint });
    const counts = new Map<number, number>();
    // Neighbours mostly have the same label.
    let [last, count] = [0, 0];
    let { plain, painted } = shades(0);
    for (let j = 0; j < height; j++) {
      const row = index * strides[axis] + (vertical.flip ? height - 1 - j : j) * strides[vertical.axis];
      for (let i = 0; i < width; i++) {
        const voxel = row + (horizontal.flip ? width - 1 - i : i) * strides[horizontal.axis];
        const label = voxels[voxel] ?? 0;
        if (label !== last) {
          counts.set(last, (counts.get(last) ?? 0) + count);
          [last, count] = [label, 0];
          ({ plain, painted } = shades(label));
        }
        count += 1;
        out[j * width + i] = mask !== undefined && mask[voxel] !== 0 ? painted : plain;
      }
    }
    counts.set(last, (counts.get(last) ?? 0) + count);
    counts.delete(0);
    context2d(this.canvas)?.putImageData(this.#pixels, 0, 0);
    return counts;
  }
}

/** The pixels of a label, as numbers. */
interface Shades {
  plain: number;
  /** In the mask of the threshold brush. */
  painted: number;
}

/** Returns a function that returns the pixels of a label. */
function shadesOf({
  colors,
  opacity,
  paint,
}: Pick<Overlays, 'colors' | 'opacity' | 'paint'>): (label: number) => Shades {
  const alpha = Math.round(255 * opacity);
  const known = new Map<number, Shades>();
  const background = { plain: 0, painted: pixel(paint, TINT) };
  return (label) => {
    const color = label === 0 || alpha === 0 ? undefined : colors.get(label);
    if (!color) return background;
    const shades = known.get(label) ?? { plain: pixel(color, alpha), painted: pixel(lighter(color), alpha) };
    known.set(label, shades);
    return shades;
  };
}

function lighter([red, green, blue]: readonly [number, number, number]): [number, number, number] {
  const mix = (value: number) => value + LIGHTER * (255 - value);
  return [mix(red), mix(green), mix(blue)];
}

/** Returns a pixel of image data as one number. */
function pixel(color: readonly [number, number, number], alpha: number): number {
  return new Uint32Array(Uint8ClampedArray.of(...color, alpha).buffer)[0] ?? 0;
}
