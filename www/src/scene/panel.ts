import type { Attractor, LevelView, PointArray, UncoveredRegion, Vec3, VolumeView } from '../engine/protocol';
import { context2d, h, token, uniqueId } from '../kit/dom';
import { text } from '../texts';
import { nearestVoxel, SLICE_NAMES, type SliceOrientation } from './anatomy';
import { type Extent, SliceCamera } from './slice-camera';
import { type Drag, SliceGestures } from './slice-gestures';
import { ballSection, type DisplayWindow, paintLevel, paintSlice, pictureSize, projectSegments } from './slicing';

/** Names of the style tokens (CSS variables) with the colours of the slices across the three voxel axes. */
export const AXIS_TOKENS = ['--axis-x', '--axis-y', '--axis-z'] as const;

export interface PanelEvents {
  /** Called with the index of the slice that the slider moves to. */
  onIndex: (index: number) => void;
  /**
   * Called when the slice image is clicked or dragged on, with the index of the voxel there. `pressed`: whether the
   * pointer was just pressed.
   */
  onPoint: (index: Vec3, pressed: boolean) => void;
  /**
   * Called when the slice image is pressed, with the position of the pointer and the tolerance for grabbing an object
   * there, both in voxels. A returned grip follows the pointer until it is released, and `onPoint` is not called.
   */
  grab?: (index: Vec3, slack: Vec3) => Grip | undefined;
  /** Called with the position of the pointer over the slice image, in voxels; undefined when it has left. */
  onHover?: (index: Vec3 | undefined) => void;
}

/** The common part of all slices of a volume, besides the crosshair. */
export interface PanelHost {
  /** Called with the voxel under the pointer; undefined when it has left the slice image. */
  onProbe: (voxel: Vec3 | undefined) => void;
  /** Called when the zoom may have changed. */
  onZoom: () => void;
  /** Returns the drag that changes the displayed intensities. */
  adjustWindow: (event: PointerEvent) => Drag;
  /** Whether drags with the main button change the displayed intensities. */
  isAdjusting: () => boolean;
}

/** Handle of an object on a slice while it is dragged; positions are in voxels, also between and outside them. */
export interface Grip {
  move: (index: Vec3) => void;
  drop: () => void;
}

/**
 * Function that draws over a slice image: a position in pixels of the image, times the scales, is the position on the
 * canvas.
 */
export type Overlay = (context: CanvasRenderingContext2D, scaleX: number, scaleY: number) => void;

/** Distance within which the pointer can grab a side of the region of interest, CSS pixels. */
const SLACK = 7;

/** Magnification by one press of the + key. */
const KEY_ZOOM = 1.25;
/** Distance by which an arrow key pans, as a fraction of the canvas. */
const KEY_PAN = 0.1;

/** A slice as an image with the surface's outline over it, its crosshair, and a slider. */
export class SlicePanel {
  readonly element: HTMLElement;
  /** The slice image alone, one pixel a voxel; also the texture of the slice in the 3D view. */
  readonly picture = document.createElement('canvas');
  readonly orientation: SliceOrientation;
  /** Draws additional content over the slice image, such as the region of interest. */
  overlay: Overlay = () => undefined;
  host: PanelHost | undefined;
  readonly #volume: VolumeView;
  readonly #inverse: Float64Array;
  readonly #canvas: HTMLCanvasElement;
  readonly #slider: HTMLInputElement;
  readonly #output: HTMLOutputElement;
  readonly #pixels: ImageData;
  readonly #observer = new ResizeObserver(() => this.draw());
  readonly #camera: SliceCamera;
  #outline: Float32Array = new Float32Array(0);
  /** Description of the content over the slice, in place of that of the outline. */
  #content: string | undefined;
  #attractors: Attractor[] = [];
  #uncovered: readonly UncoveredRegion[] = [];
  /** Voxels shown instead of the volume's: those of a coarser pyramid level, or of one frame. */
  #level: LevelView | undefined;
  #window: DisplayWindow;
  #crosshair: Vec3 = [0, 0, 0];
  #color = '#f80';
  /** The animation frame in which it is drawn; 0 if it is up to date. */
  #frame = 0;

  constructor(volume: VolumeView, orientation: SliceOrientation, inverse: Float64Array, events: PanelEvents) {
    this.#volume = volume;
    this.#window = volume.window;
    this.orientation = orientation;
    this.#inverse = inverse;
    const { width, height } = pictureSize(volume, orientation);
    this.picture.width = width;
    this.picture.height = height;
    this.#pixels = new ImageData(width, height);
    const { horizontal, vertical } = orientation;
    this.#camera = new SliceCamera(
      { width, height },
      { width: volume.spacing[horizontal.axis], height: volume.spacing[vertical.axis] },
    );
    const id = uniqueId('slice');
    const last = volume.dims[orientation.axis] - 1;
    this.#canvas = h('canvas', { role: 'img' });
    this.#slider = h('input', { type: 'range', id, min: 0, max: last, step: 1, value: last >> 1 });
    this.#slider.addEventListener('input', () => events.onIndex(this.#slider.valueAsNumber));
    // The slider announces its value already.
    this.#output = h('output', { for: id, 'aria-live': 'off' });
    this.element = this.#build(id);
    this.#followPointer(events);
    this.element.addEventListener('keydown', (event) => this.#onKey(event));
    this.#observer.observe(this.#canvas);
  }

  /** Moves the crosshair, and repaints the image if it moves to another slice. */
  setCrosshair(index: Vec3): void {
    const { axis } = this.orientation;
    const moved = this.#crosshair[axis] !== index[axis] || this.#output.value === '';
    this.#crosshair = [...index];
    this.#camera.reveal(...this.#crosshairPoint(), this.#extent);
    if (moved) this.#paint(index[axis]);
    this.draw();
  }

  /** Shows the cross-section of the surface with this slice, given as pairs of world points. */
  setOutline(segments: PointArray): void {
    this.#outline = projectSegments(segments, this.#inverse, this.#volume, this.orientation);
    this.draw();
    this.#describe();
  }

  /**
   * Shows the voxels of a coarser pyramid level or of one frame in place of the volume's; undefined returns to the
   * volume.
   */
  setLevel(level: LevelView | undefined): void {
    this.#level = level;
    this.#paint(this.#crosshair[this.orientation.axis]);
    this.draw();
  }

  /** Intensities that are displayed as black and as white. */
  set window(window: DisplayWindow) {
    this.#window = window;
    this.#paint(this.#crosshair[this.orientation.axis]);
    this.draw();
  }

  /** Whether the slice image is magnified. */
  get isZoomed(): boolean {
    return this.#camera.zoom > 1;
  }

  /** Fits the slice image into the canvas again. */
  resetZoom(): void {
    this.#camera.reset();
    this.draw();
    this.host?.onZoom();
  }

  /** Text for the slider, which a screen reader says with its number. */
  set spoken(text: string) {
    this.#slider.setAttribute('aria-valuetext', text);
  }

  /** Describes the content over the slice, for screen readers, where it is not the outline of a surface. */
  set content(text: string) {
    this.#content = text;
    this.#describe();
  }

  setAttractors(attractors: Attractor[]): void {
    this.#attractors = attractors;
    this.draw();
  }

  setUncovered(parts: readonly UncoveredRegion[]): void {
    this.#uncovered = parts;
    this.draw();
  }

  /** Draws in the next animation frame, once, however often it is called before. */
  draw(): void {
    this.#frame ||= requestAnimationFrame(() => {
      this.#frame = 0;
      this.#drawNow();
    });
  }

  /**
   * Draws the slice image, the crosshair, the surface's outline and all overlays on the visible canvas, at the
   * resolution of the screen, but at most two pixels per CSS pixel.
   */
  #drawNow(): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const context = context2d(this.#canvas);
    if (!context || clientWidth === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.#canvas.width = Math.round(clientWidth * ratio);
    this.#canvas.height = Math.round(clientHeight * ratio);
    context.scale(ratio, ratio);
    this.paint(context, clientWidth, clientHeight);
  }

  /**
   * Draws as on the visible canvas, into an area of the given size; returns the length of a unit of world space there.
   */
  paint(context: CanvasRenderingContext2D, width: number, height: number): number {
    const { x, y, scaleX, scaleY } = this.#camera.placement({ width, height });
    context.save();
    context.translate(x, y);
    context.save();
    context.scale(scaleX, scaleY);
    context.imageSmoothingQuality = 'high';
    context.drawImage(this.picture, 0, 0);
    context.restore();
    this.#drawCrosshair(context, scaleX, scaleY);
    this.#drawOutline(context, scaleX, scaleY);
    this.#drawAttractors(context, scaleX, scaleY);
    this.#drawUncovered(context, scaleX, scaleY);
    this.overlay(context, scaleX, scaleY);
    context.restore();
    return scaleX / this.#volume.spacing[this.orientation.horizontal.axis];
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    this.#observer.disconnect();
    this.element.remove();
  }

  #build(id: string): HTMLElement {
    const { labels, name, axis } = this.orientation;
    const letters = Object.entries(labels).map(([side, letter]) =>
      h('span', { class: `direction ${side}`, 'aria-hidden': 'true' }, letter),
    );
    const swatch = h('span', { class: `swatch axis-${axis}`, 'aria-hidden': 'true' });
    const label = h('label', { for: id }, swatch, SLICE_NAMES[name]);
    return h(
      'div',
      { class: 'slice' },
      h('div', { class: 'picture' }, this.#canvas, ...letters),
      h('div', { class: 'slice-control' }, label, this.#slider, this.#output),
    );
  }

  #paint(index: number): void {
    if (this.#level) {
      paintLevel(this.#volume, this.#level, this.orientation, index, this.picture, this.#window);
    } else {
      paintSlice(this.#volume, this.orientation, index, this.#pixels.data, this.#window);
      context2d(this.picture)?.putImageData(this.#pixels, 0, 0);
    }
    this.#slider.valueAsNumber = index;
    this.#output.value = String(index);
    this.#color = token('--outline');
    this.#describe();
  }

  /** Describes the visible content in the canvas's label, for screen readers. */
  #describe(): void {
    const { name, axis } = this.orientation;
    const where = text('view.sliceOf', {
      name: SLICE_NAMES[name],
      slice: this.#crosshair[axis],
      last: this.#volume.dims[axis] - 1,
    });
    this.#canvas.setAttribute(
      'aria-label',
      text('view.sliceWith', {
        slice: where,
        outline: this.#content ?? describeOutline(this.#outline, this.picture),
      }),
    );
  }

  get #extent(): Extent {
    return { width: this.#canvas.clientWidth, height: this.#canvas.clientHeight };
  }

  /** Returns the position of the crosshair in the slice image, in voxels from its top left corner. */
  #crosshairPoint(): [number, number] {
    const { horizontal, vertical } = this.orientation;
    const at = ({ axis, flip }: SliceOrientation['horizontal']) => {
      const index = this.#crosshair[axis];
      return (flip ? this.#volume.dims[axis] - 1 - index : index) + 0.5;
    };
    return [at(horizontal), at(vertical)];
  }

  #drawCrosshair(context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    const { horizontal, vertical } = this.orientation;
    const { width, height } = this.picture;
    const [column, row] = this.#crosshairPoint();
    const [x, y] = [column * scaleX, row * scaleY];
    context.globalAlpha = 0.7;
    line(context, token(AXIS_TOKENS[horizontal.axis]), x, 0, x, height * scaleY);
    line(context, token(AXIS_TOKENS[vertical.axis]), 0, y, width * scaleX, y);
    context.globalAlpha = 1;
  }

  #drawOutline(context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    drawSegments(context, this.#outline, scaleX, scaleY, this.#color);
  }

  /**
   * Draws the circle in which each attractor's ball of influence intersects this slice, and a dot at its centre, larger
   * if the attractor lies within half a voxel of the slice.
   */
  #drawAttractors(context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    context.lineWidth = 1.5;
    context.strokeStyle = token('--attractor');
    context.fillStyle = token('--attractor');
    for (const attractor of this.#attractors) {
      const disc = ballSection(
        attractor,
        this.#crosshair[this.orientation.axis],
        this.#inverse,
        this.#volume,
        this.orientation,
      );
      if (!disc) continue;
      const at = [disc.x * scaleX, disc.y * scaleY] as const;
      context.beginPath();
      context.ellipse(...at, disc.radiusX * scaleX, disc.radiusY * scaleY, 0, 0, 2 * Math.PI);
      context.stroke();
      context.beginPath();
      context.arc(...at, disc.near ? 3.5 : 1.5, 0, 2 * Math.PI);
      context.fill();
    }
  }

  /**
   * Marks the uncovered regions within half a voxel of this slice: a dot where a part of the object lies outside the
   * surface, a ring where background lies inside it.
   */
  #drawUncovered(context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    context.lineWidth = 1.5;
    for (const { position, kind } of this.#uncovered) {
      const point = { point: position, radius: Math.max(...this.#volume.spacing) };
      const disc = ballSection(
        point,
        this.#crosshair[this.orientation.axis],
        this.#inverse,
        this.#volume,
        this.orientation,
      );
      if (!disc?.near) continue;
      context.beginPath();
      context.arc(disc.x * scaleX, disc.y * scaleY, 4, 0, 2 * Math.PI);
      context.strokeStyle = context.fillStyle = token(kind === 'matter' ? '--matter' : '--cavity');
      if (kind === 'matter') context.fill();
      else context.stroke();
    }
  }

  #followPointer({ onPoint, grab, onHover }: PanelEvents): void {
    const hover = (event: PointerEvent | undefined) => {
      const at = event && this.#placeAt(event.offsetX, event.offsetY);
      onHover?.(at);
      this.host?.onProbe(at && this.#voxelIn(at));
    };
    new SliceGestures(this.#canvas, {
      press: (event) => this.#press(event, onPoint, grab),
      zoom: (factor, x, y) => this.#zoomAt(factor, x, y),
      pan: (x, y) => this.#pan(x, y),
      adjustWindow: (event) => this.host?.adjustWindow(event) ?? { move: () => undefined },
      isAdjusting: () => this.host?.isAdjusting() ?? false,
      isZoomed: () => this.isZoomed,
      reset: () => this.resetZoom(),
    });
    // After the gestures, which may move the image.
    this.#canvas.addEventListener('pointermove', hover);
    this.#canvas.addEventListener('pointerleave', () => hover(undefined));
    // The keys of the slice work after a click on it.
    this.#canvas.addEventListener('pointerdown', () => this.#slider.focus({ preventScroll: true }));
  }

  /** Starts to drag the object at the pointer, or else the crosshair. */
  #press(event: PointerEvent, onPoint: PanelEvents['onPoint'], grab: PanelEvents['grab']): Drag {
    const grip = grab?.(this.#placeAt(event.offsetX, event.offsetY), this.#slack());
    if (grip) {
      const move = (to: PointerEvent) => grip.move(this.#placeAt(to.offsetX, to.offsetY));
      return { move, end: () => grip.drop(), takesClicks: true };
    }
    onPoint(this.#voxelAt(event.offsetX, event.offsetY), true);
    return { move: (to) => onPoint(this.#voxelAt(to.offsetX, to.offsetY), false) };
  }

  #zoomAt(factor: number, x: number, y: number): void {
    this.#camera.zoomAt(factor, x, y, this.#extent);
    this.draw();
    this.host?.onZoom();
  }

  #pan(x: number, y: number): void {
    this.#camera.pan(x, y, this.#extent);
    this.draw();
  }

  #onKey(event: KeyboardEvent): void {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const { width, height } = this.#extent;
    const zoom = (factor: number) => {
      const { x, y, scaleX, scaleY } = this.#camera.placement(this.#extent);
      const [column, row] = this.#crosshairPoint();
      this.#zoomAt(factor, x + column * scaleX, y + row * scaleY);
    };
    const moves: Record<string, () => void> = {
      '+': () => zoom(KEY_ZOOM),
      '=': () => zoom(KEY_ZOOM),
      '-': () => zoom(1 / KEY_ZOOM),
      '0': () => this.resetZoom(),
    };
    const pans: Record<string, () => void> = {
      ArrowLeft: () => this.#pan(KEY_PAN * width, 0),
      ArrowRight: () => this.#pan(-KEY_PAN * width, 0),
      ArrowUp: () => this.#pan(0, KEY_PAN * height),
      ArrowDown: () => this.#pan(0, -KEY_PAN * height),
    };
    const act = moves[event.key] ?? (event.shiftKey ? pans[event.key] : undefined);
    if (!act) return;
    event.preventDefault();
    event.stopPropagation();
    act();
  }

  /**
   * Returns the tolerance for grabbing an object on the slice, in voxels along the two sides of the image; 0 across it.
   */
  #slack(): Vec3 {
    const { scaleX, scaleY } = this.#camera.placement(this.#extent);
    const slack: Vec3 = [0, 0, 0];
    slack[this.orientation.horizontal.axis] = SLACK / scaleX;
    slack[this.orientation.vertical.axis] = SLACK / scaleY;
    return slack;
  }

  /**
   * Converts a position on the canvas in CSS pixels, also outside the slice image, to voxel coordinates, not rounded;
   * the centre of the first voxel is at 0.
   */
  #placeAt(canvasX: number, canvasY: number): Vec3 {
    const { x, y, scaleX, scaleY } = this.#camera.placement(this.#extent);
    const place: Vec3 = [...this.#crosshair];
    for (const [{ axis, flip }, position] of [
      [this.orientation.horizontal, (canvasX - x) / scaleX],
      [this.orientation.vertical, (canvasY - y) / scaleY],
    ] as const)
      place[axis] = (flip ? this.#volume.dims[axis] - position : position) - 0.5;
    return place;
  }

  /** Returns the index of the voxel in the slice image nearest to a position on the canvas in CSS pixels. */
  #voxelAt(canvasX: number, canvasY: number): Vec3 {
    return nearestVoxel(this.#placeAt(canvasX, canvasY), this.#volume.dims);
  }

  /** Returns the voxel that contains a position, in voxels; undefined outside the slice image. */
  #voxelIn(place: Vec3): Vec3 | undefined {
    const voxel = place.map(Math.round) as Vec3;
    return voxel.every((at, axis) => at >= 0 && at < (this.#volume.dims[axis] ?? 0)) ? voxel : undefined;
  }
}

/** Draws an outline over a slice image; `points` are as returned by {@link projectSegments}. */
export function drawSegments(
  context: CanvasRenderingContext2D,
  points: Float32Array,
  scaleX: number,
  scaleY: number,
  color: string,
): void {
  if (points.length === 0) return;
  context.beginPath();
  for (let i = 0; i + 3 < points.length; i += 4) {
    context.moveTo((points[i] ?? 0) * scaleX, (points[i + 1] ?? 0) * scaleY);
    context.lineTo((points[i + 2] ?? 0) * scaleX, (points[i + 3] ?? 0) * scaleY);
  }
  context.lineCap = 'round';
  context.lineWidth = 1.4;
  context.strokeStyle = color;
  context.stroke();
}

/**
 * Describes width and height of the surface's cross-section with a slice, in voxels, for screen readers. `points` are
 * as returned by {@link projectSegments}, `width` and `height` those of the slice.
 */
function describeOutline(points: Float32Array, { width, height }: HTMLCanvasElement): string {
  if (points.length === 0) return text('view.noOutline');
  const side = (first: 0 | 1) => {
    let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
    for (let i = first; i < points.length; i += 2) {
      low = Math.min(low, points[i] ?? low);
      high = Math.max(high, points[i] ?? high);
    }
    return Math.round(high - low);
  };
  return text('view.outlineSize', { outlineWidth: side(0), outlineHeight: side(1), width, height });
}

function line(context: CanvasRenderingContext2D, color: string, x1: number, y1: number, x2: number, y2: number): void {
  context.beginPath();
  context.moveTo(x1, y1);
  context.lineTo(x2, y2);
  context.lineWidth = 1;
  context.strokeStyle = color;
  context.stroke();
}
