/** The paper's figures of one slice, or of one line through time, side by side under the view of the Track lab. */
import { signal } from '@preact/signals';
import type { Vec3, VolumeView } from '../../engine/protocol';
import { context2d, h, token } from '../../kit/dom';
import { invert, sliceOrientations } from '../../scene/anatomy';
import { intersectionsWithRow } from '../../scene/cross-section';
import { greysOf, slicePicture } from '../../scene/slicing';
import { type CannySettings, canny } from './canny';
import { boundaryImage, hasBoundary, twoMeans, windowAt } from './clusters';
import type { BoundaryVotes, InterpolatedSlice } from './protocol';
import { frameOf } from './scene';
import { votesIn } from './votes';

/** Length of an image's longer side in canvas pixels; sharp on high-resolution screens, too. */
const IMAGE_SIZE = 560;

/** An image with a caption, as one of the pictures of a figure. */
export class FigureImage {
  readonly canvas: HTMLCanvasElement;
  readonly caption = signal('');

  constructor(label: string) {
    this.canvas = h('canvas', { role: 'img', 'aria-label': label });
  }

  /**
   * Returns the position of a mouse event as fractions, 0 to 1, of the image's width and height; margins of the canvas
   * around the image are taken into account.
   */
  fractionsAt({ offsetX, offsetY }: MouseEvent): [number, number] {
    const { width, height, clientWidth, clientHeight } = this.canvas;
    const fit = Math.min(clientWidth / width, clientHeight / height);
    const fraction = (at: number, available: number, size: number) =>
      Math.min(1 - 1e-6, Math.max(0, (at - (available - fit * size) / 2) / (fit * size)));
    return [fraction(offsetX, clientWidth, width), fraction(offsetY, clientHeight, height)];
  }

  /**
   * Draws the canvas `small` magnified, so that its longer side becomes {@link IMAGE_SIZE}; its pixels have the
   * proportions `wide` : `high`. `over` draws on top: a position in pixels of `small`, times the scales, is the
   * position on the canvas.
   */
  paint(
    small: HTMLCanvasElement,
    [wide, high]: [number, number],
    over: (context: CanvasRenderingContext2D, scaleX: number, scaleY: number) => void = () => undefined,
  ): void {
    const fit = IMAGE_SIZE / Math.max(small.width * wide, small.height * high);
    this.canvas.width = Math.round(small.width * wide * fit);
    this.canvas.height = Math.round(small.height * high * fit);
    const context = context2d(this.canvas);
    if (!context) return;
    context.imageSmoothingEnabled = false;
    context.drawImage(small, 0, 0, this.canvas.width, this.canvas.height);
    over(context, wide * fit, high * fit);
  }
}

/** The subject of the figures: the frame and the voxel at the crosshair. */
export interface Subject {
  volume: VolumeView;
  frame: number;
  voxel: Vec3;
}

/** Voxel axis perpendicular to the slices that the figures show: the third, as acquired by the scanner. */
const ACROSS = 2;
/**
 * Width and height, in pixels, of the section of a slice that is shown around the crosshair; less if the slice is
 * smaller.
 */
const SECTION_SIZE = 28;

/**
 * Paints a section of the slice at the crosshair, `voxel`, and outlines the pixels of the window of half width
 * `halfWidth` (pixels) around it: green if classified as bright, red if dark, as in figure 4 a of the paper. Returns
 * whether the window contains a boundary: both clusters are large enough, and their means differ by more than the
 * threshold (in intensity units).
 */
export function paintWindow(
  picture: FigureImage,
  { volume, frame, voxel }: Subject,
  halfWidth: number,
  threshold: number,
): boolean {
  const side = sliceSide(volume);
  const shown = frameOf(volume, frame);
  const small = slicePicture(shown, side, voxel[ACROSS]);
  const { width, height } = small;
  const values = greysOf(shown, side, voxel[ACROSS]);
  const [x, y] = [placeIn(side.horizontal, voxel, volume.dims), placeIn(side.vertical, voxel, volume.dims)];
  const window = windowAt({ width, height, values }, x, y, halfWidth);
  const found = twoMeans(window.map((i) => values[i] ?? 0));
  const [low, high] = volume.window;
  const split = hasBoundary(found, (threshold * 255) / (high - low || 1));
  const [left, top] = cornerOf(volume, side, voxel);
  const section = document.createElement('canvas');
  [section.width, section.height] = [Math.min(SECTION_SIZE, width), Math.min(SECTION_SIZE, height)];
  context2d(section)?.drawImage(small, -left, -top);
  picture.paint(section, pixelOfSide(volume, side), (context, scaleX, scaleY) => {
    context.lineWidth = 3;
    for (const bright of [0, 1]) {
      context.strokeStyle = bright ? '#2ecc5a' : '#ff5a4d';
      for (const [k, i] of window.entries()) {
        const [column, row] = [(i % width) - left, Math.floor(i / width) - top];
        if (found.bright[k] === bright)
          context.strokeRect(column * scaleX + 2, row * scaleY + 2, scaleX - 4, scaleY - 4);
      }
    }
  });
  return split;
}

/**
 * Paints the boundary votes in the slice at the crosshair, summed per pixel by {@link boundaryImage}: figure 4 b of the
 * paper.
 */
export function paintBoundary(picture: FigureImage, { volume, voxel }: Subject, votes: BoundaryVotes): void {
  const side = sliceSide(volume);
  const [width, height] = [volume.dims[side.horizontal.axis], volume.dims[side.vertical.axis]];
  const inverse = invert(volume.affine);
  const faces = votesIn(votes, { volume, inverse, orientation: side, slice: voxel[ACROSS] });
  // Votes lie on pixel faces: x is an integer for a face to the right, and y a half. Subtracting less than a pixel
  // assigns both kinds to their pixel.
  const sum = boundaryImage(
    { width, height },
    faces.map(({ x, y, weight }) => ({ x: x - 0.25, y: y - 0.25, weight })),
  );
  picture.paint(
    inGrey(width, height, (i) => 127.5 * (sum[i] ?? 0)),
    pixelOfSide(volume, side),
  );
}

/** Paints the edges that Canny's detector finds in the slice at the crosshair: figure 4 c of the paper. */
export function paintCanny(picture: FigureImage, { volume, frame, voxel }: Subject, settings: CannySettings): void {
  const side = sliceSide(volume);
  const shown = frameOf(volume, frame);
  const [width, height] = [volume.dims[side.horizontal.axis], volume.dims[side.vertical.axis]];
  const edges = canny({ width, height, values: greysOf(shown, side, voxel[ACROSS]) }, settings);
  picture.paint(
    inGrey(width, height, (i) => 255 * (edges[i] ?? 0)),
    pixelOfSide(volume, side),
  );
}

/**
 * Paints the row of pixels through the crosshair in all frames, one column per frame, and marks the frame shown and the
 * intersections of the row with the outlines of the surface, given by frame as `outlines`. Returns the number of
 * intersections.
 */
export function paintTime(
  picture: FigureImage,
  { volume, frame, voxel }: Subject,
  outlines: readonly (Float32Array | undefined)[],
): number {
  const side = sliceSide(volume);
  const { frames } = volume;
  const length = volume.dims[side.horizontal.axis];
  const row = placeIn(side.vertical, voxel, volume.dims);
  const lines = Array.from({ length: frames }, (_, t) => {
    const shown = frameOf(volume, t);
    return greysOf(shown, side, voxel[ACROSS]).subarray(row * length, (row + 1) * length);
  });
  const small = inGrey(frames, length, (i) => lines[i % frames]?.[Math.floor(i / frames)] ?? 0);
  let count = 0;
  picture.paint(small, [(3.6 * length) / frames, 1], (context, scaleX, scaleY) => {
    context.fillStyle = token('--outline');
    for (const [t, outline] of outlines.entries())
      for (const x of outline ? intersectionsWithRow(outline, row + 0.5) : []) {
        count += 1;
        context.beginPath();
        context.arc((t + 0.5) * scaleX, x * scaleY, 3.4, 0, 2 * Math.PI);
        context.fill();
      }
    context.strokeStyle = '#ffffff';
    context.globalAlpha = 0.7;
    context.strokeRect(frame * scaleX, 0, scaleX, small.height * scaleY);
  });
  return count;
}

/**
 * Paints figure 5 of the paper, one image each: the slice before a measured one, the slice interpolated by optical
 * flow, the measured slice, the slice interpolated linearly, and the slice after.
 */
export function paintBetween(
  pictures: readonly FigureImage[],
  volume: VolumeView,
  { width, height, before, flow, measured, linear, after }: InterpolatedSlice,
): void {
  const side = sliceSide(volume);
  const pixel = pixelOfSide(volume, side);
  for (const [i, voxels] of [before, flow, measured, linear, after].entries())
    pictures[i]?.paint(slicePicture({ dims: [width, height, 1], voxels, window: [0, 255] }, side, 0), pixel);
}

/**
 * Returns the voxel at a position in the section of a slice that {@link paintWindow} shows around `voxel`; `across` and
 * `down` are fractions from 0 to 1. Used for clicks.
 */
export function voxelIn(volume: VolumeView, voxel: Vec3, across: number, down: number): Vec3 {
  const side = sliceSide(volume);
  const out: Vec3 = [...voxel];
  const [left, top] = cornerOf(volume, side, voxel);
  for (const [{ axis, flip }, from, part] of [
    [side.horizontal, left, across],
    [side.vertical, top, down],
  ] as const) {
    const last = volume.dims[axis] - 1;
    const at = Math.max(0, Math.min(last, from + Math.floor(part * Math.min(SECTION_SIZE, last + 1))));
    out[axis] = flip ? last - at : at;
  }
  return out;
}

/**
 * Returns the upper left corner, in pixels of the slice, of the section of {@link SECTION_SIZE} centred on the
 * crosshair, `voxel`; the section is moved to lie within the slice.
 */
function cornerOf({ dims }: VolumeView, { horizontal, vertical }: Side, voxel: Vec3): [number, number] {
  const from = (side: Side['horizontal']) =>
    Math.max(0, Math.min(dims[side.axis] - SECTION_SIZE, placeIn(side, voxel, dims) - (SECTION_SIZE >> 1)));
  return [from(horizontal), from(vertical)];
}

function sliceSide(volume: VolumeView) {
  const side = sliceOrientations(volume)[ACROSS];
  if (!side) throw new Error('a volume has three axes');
  return side;
}

type Side = ReturnType<typeof sliceSide>;

function placeIn({ axis, flip }: Side['horizontal'], voxel: Vec3, dims: Vec3): number {
  return flip ? dims[axis] - 1 - voxel[axis] : voxel[axis];
}

function pixelOfSide({ spacing }: VolumeView, side: Side): [number, number] {
  return [spacing[side.horizontal.axis], spacing[side.vertical.axis]];
}

function inGrey(width: number, height: number, grey: (i: number) => number): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const pixels = new ImageData(width, height);
  for (let i = 0; i < width * height; i++) {
    const value = grey(i);
    pixels.data.set([value, value, value, 255], 4 * i);
  }
  context2d(canvas)?.putImageData(pixels, 0, 0);
  return canvas;
}
