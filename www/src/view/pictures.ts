/** The paper's pictures of one slice, or of one line through time, beside each other under the view. */
import type { Vec3, VolumeView } from '../protocol';
import { type CannySettings, canny } from '../track/canny';
import { boundaryPicture, isSplit, twoMeans, windowAt } from '../track/clusters';
import { crossings } from '../track/cut';
import type { Between, Votes } from '../track/protocol';
import { h, pen, token } from '../ui/dom';
import { invert, sliceFrames } from './anatomy';
import { voxelsOfFrame } from './beating';
import { greysOf, slicePicture } from './slicing';
import { votesIn } from './votes';

/** Pixels of a picture's longer side: sharp on fine screens, too. */
const FINE = 560;

/** A picture with what stands under it. */
export class Picture {
  readonly element: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly #caption = h('figcaption');

  constructor(label: string) {
    this.canvas = h('canvas', { role: 'img', 'aria-label': label });
    this.element = h('figure', { class: 'still' }, this.canvas, this.#caption);
  }

  set caption(text: string) {
    if (this.#caption.textContent !== text) this.#caption.textContent = text;
  }

  /** How far across and down the picture, 0 to 1, something happened: it may not fill its canvas. */
  partsAt({ offsetX, offsetY }: MouseEvent): [number, number] {
    const { width, height, clientWidth, clientHeight } = this.canvas;
    const fit = Math.min(clientWidth / width, clientHeight / height);
    const part = (at: number, room: number, size: number) =>
      Math.min(1 - 1e-6, Math.max(0, (at - (room - fit * size) / 2) / (fit * size)));
    return [part(offsetX, clientWidth, width), part(offsetY, clientHeight, height)];
  }

  /** Draws a small picture pixel by pixel, each so wide and high; `over` draws in its pixels. */
  paint(
    small: HTMLCanvasElement,
    [wide, high]: [number, number],
    over: (context: CanvasRenderingContext2D, scaleX: number, scaleY: number) => void = () => undefined,
  ): void {
    const fit = FINE / Math.max(small.width * wide, small.height * high);
    this.canvas.width = Math.round(small.width * wide * fit);
    this.canvas.height = Math.round(small.height * high * fit);
    const context = pen(this.canvas);
    if (!context) return;
    context.imageSmoothingEnabled = false;
    context.drawImage(small, 0, 0, this.canvas.width, this.canvas.height);
    over(context, wide * fit, high * fit);
  }
}

/** What the pictures are of. */
export interface Subject {
  volume: VolumeView;
  frame: number;
  voxel: Vec3;
}

/** The voxel axis that slices lie across, as scanners number them. */
const ACROSS = 2;
/** Pixels across and down of the part of a slice that shows a window. */
const CUT = 28;

/** The part of the slice about the crosshair, the window there sorted into bright and dark: green and red, as in figure 4 a. */
export function paintWindow(
  picture: Picture,
  { volume, frame, voxel }: Subject,
  reach: number,
  threshold: number,
): boolean {
  const side = sliceSide(volume);
  const shown = { dims: volume.dims, voxels: voxelsOfFrame(volume, frame) };
  const small = slicePicture(shown, side, voxel[ACROSS]);
  const { width, height } = small;
  const values = greysOf(shown, side, voxel[ACROSS]);
  const [x, y] = [placeIn(side.horizontal, voxel, volume.dims), placeIn(side.vertical, voxel, volume.dims)];
  const window = windowAt({ width, height, values }, x, y, reach);
  const found = twoMeans(window.map((i) => values[i] ?? 0));
  const [low, high] = volume.window;
  const split = isSplit(found, (threshold * 255) / (high - low || 1));
  const [left, top] = cornerOf(volume, side, voxel);
  const cut = document.createElement('canvas');
  [cut.width, cut.height] = [Math.min(CUT, width), Math.min(CUT, height)];
  pen(cut)?.drawImage(small, -left, -top);
  picture.paint(cut, pixelOfSide(volume, side), (context, scaleX, scaleY) => {
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

/** Votes of the windows, brought together on pixels: figure 4 b. */
export function paintBoundary(picture: Picture, { volume, voxel }: Subject, votes: Votes): void {
  const side = sliceSide(volume);
  const [width, height] = [volume.dims[side.horizontal.axis], volume.dims[side.vertical.axis]];
  const inverse = invert(volume.affine);
  const faces = votesIn(votes, { volume, inverse, frame: side, slice: voxel[ACROSS] });
  // A face to the right lies on a whole number across and at a half down; less than a pixel back both are in theirs.
  const sum = boundaryPicture(
    { width, height },
    faces.map(({ x, y, weight }) => ({ x: x - 0.25, y: y - 0.25, weight })),
  );
  picture.paint(
    inGrey(width, height, (i) => 127.5 * (sum[i] ?? 0)),
    pixelOfSide(volume, side),
  );
}

/** Canny's edges of the same slice: figure 4 c. */
export function paintCanny(picture: Picture, { volume, frame, voxel }: Subject, settings: CannySettings): void {
  const side = sliceSide(volume);
  const shown = { dims: volume.dims, voxels: voxelsOfFrame(volume, frame) };
  const [width, height] = [volume.dims[side.horizontal.axis], volume.dims[side.vertical.axis]];
  const edges = canny({ width, height, values: greysOf(shown, side, voxel[ACROSS]) }, settings);
  picture.paint(
    inGrey(width, height, (i) => 255 * (edges[i] ?? 0)),
    pixelOfSide(volume, side),
  );
}

/** One line of the slice in all frames, time to the right, with where the surfaces cross it: `outlines` by frame. */
export function paintTime(
  picture: Picture,
  { volume, frame, voxel }: Subject,
  outlines: readonly (Float32Array | undefined)[],
): number {
  const side = sliceSide(volume);
  const { frames } = volume;
  const length = volume.dims[side.horizontal.axis];
  const row = placeIn(side.vertical, voxel, volume.dims);
  const lines = Array.from({ length: frames }, (_, t) => {
    const shown = { dims: volume.dims, voxels: voxelsOfFrame(volume, t) };
    return greysOf(shown, side, voxel[ACROSS]).subarray(row * length, (row + 1) * length);
  });
  const small = inGrey(frames, length, (i) => lines[i % frames]?.[Math.floor(i / frames)] ?? 0);
  let count = 0;
  picture.paint(small, [(3.6 * length) / frames, 1], (context, scaleX, scaleY) => {
    context.fillStyle = token('--outline');
    for (const [t, outline] of outlines.entries())
      for (const x of outline ? crossings(outline, row + 0.5) : []) {
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

/** Figure 5: a slice, its neighbours, and what is made of them in its place. */
export function paintBetween(
  pictures: readonly Picture[],
  volume: VolumeView,
  { width, height, before, flow, measured, linear, after }: Between,
): void {
  const side = sliceSide(volume);
  const pixel = pixelOfSide(volume, side);
  for (const [i, voxels] of [before, flow, measured, linear, after].entries())
    pictures[i]?.paint(slicePicture({ dims: [width, height, 1], voxels }, side, 0), pixel);
}

/** What a click on the part of the slice means, 0 to 1 across and down: the voxel there. */
export function voxelIn(volume: VolumeView, voxel: Vec3, across: number, down: number): Vec3 {
  const side = sliceSide(volume);
  const out: Vec3 = [...voxel];
  const [left, top] = cornerOf(volume, side, voxel);
  for (const [{ axis, flip }, from, part] of [
    [side.horizontal, left, across],
    [side.vertical, top, down],
  ] as const) {
    const last = volume.dims[axis] - 1;
    const at = Math.max(0, Math.min(last, from + Math.floor(part * Math.min(CUT, last + 1))));
    out[axis] = flip ? last - at : at;
  }
  return out;
}

/** Where the part of the slice begins that the crosshair is in the middle of. */
function cornerOf({ dims }: VolumeView, { horizontal, vertical }: Side, voxel: Vec3): [number, number] {
  const from = (side: Side['horizontal']) =>
    Math.max(0, Math.min(dims[side.axis] - CUT, placeIn(side, voxel, dims) - (CUT >> 1)));
  return [from(horizontal), from(vertical)];
}

function sliceSide(volume: VolumeView) {
  const side = sliceFrames(volume)[ACROSS];
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
  pen(canvas)?.putImageData(pixels, 0, 0);
  return canvas;
}
