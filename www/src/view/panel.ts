import type { Attractor, LevelView, UncoveredRegion, Vec3, VolumeView } from '../protocol';
import { text } from '../texts';
import { context2d, h, token, uniqueId } from '../ui/dom';
import { SLICE_NAMES, type SliceOrientation } from './anatomy';
import { ballSection, paintLevel, paintSlice, pictureSize, projectSegments } from './slicing';

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

/** A slice as an image with the surface's outline over it, its crosshair, and a slider. */
export class SlicePanel {
  readonly element: HTMLElement;
  /** The slice image alone, one pixel a voxel; also the texture of the slice in the 3D view. */
  readonly picture = document.createElement('canvas');
  readonly orientation: SliceOrientation;
  /** Draws additional content over the slice image, such as the region of interest. */
  overlay: Overlay = () => undefined;
  readonly #volume: VolumeView;
  readonly #inverse: Float64Array;
  readonly #canvas: HTMLCanvasElement;
  readonly #slider: HTMLInputElement;
  readonly #output: HTMLOutputElement;
  readonly #pixels: ImageData;
  readonly #observer = new ResizeObserver(() => this.draw());
  #outline: Float32Array = new Float32Array(0);
  /** Description of the content over the slice, in place of that of the outline. */
  #content: string | undefined;
  #attractors: Attractor[] = [];
  #uncovered: readonly UncoveredRegion[] = [];
  /** Voxels shown instead of the volume's: those of a coarser pyramid level, or of one frame. */
  #level: LevelView | undefined;
  #crosshair: Vec3 = [0, 0, 0];
  #color = '#f80';

  constructor(volume: VolumeView, orientation: SliceOrientation, inverse: Float64Array, events: PanelEvents) {
    this.#volume = volume;
    this.orientation = orientation;
    this.#inverse = inverse;
    const { width, height } = pictureSize(volume, orientation);
    this.picture.width = width;
    this.picture.height = height;
    this.#pixels = new ImageData(width, height);
    const id = uniqueId('slice');
    const last = volume.dims[orientation.axis] - 1;
    this.#canvas = h('canvas', { role: 'img' });
    this.#slider = h('input', { type: 'range', id, min: 0, max: last, step: 1, value: last >> 1 });
    this.#slider.addEventListener('input', () => events.onIndex(this.#slider.valueAsNumber));
    // The slider announces its value already.
    this.#output = h('output', { for: id, 'aria-live': 'off' });
    this.element = this.#build(id);
    this.#followPointer(events);
    this.#observer.observe(this.#canvas);
  }

  /** Moves the crosshair, and repaints the image if it moves to another slice. */
  setCrosshair(index: Vec3): void {
    const { axis } = this.orientation;
    const moved = this.#crosshair[axis] !== index[axis] || this.#output.value === '';
    this.#crosshair = [...index];
    if (moved) this.#paint(index[axis]);
    this.draw();
  }

  /** Shows the cross-section of the surface with this slice, given as pairs of world points. */
  setOutline(segments: Float32Array): void {
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

  /**
   * Draws the slice image, the crosshair, the surface's outline and all overlays on the visible canvas, at the
   * resolution of the screen, but at most two pixels per CSS pixel.
   */
  draw(): void {
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
    const { x, y, scaleX, scaleY, fit } = this.#placement(width, height);
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
    return fit;
  }

  dispose(): void {
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
      paintLevel(this.#volume, this.#level, this.orientation, index, this.picture);
    } else {
      paintSlice(this.#volume, this.orientation, index, this.#pixels.data);
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

  /**
   * Returns the position of the slice image in the canvas and the voxel size there, in CSS pixels; voxels have their
   * true proportions.
   */
  #placement(clientWidth = this.#canvas.clientWidth, clientHeight = this.#canvas.clientHeight) {
    const { width, height } = this.picture;
    const { spacing } = this.#volume;
    const across = spacing[this.orientation.horizontal.axis];
    const down = spacing[this.orientation.vertical.axis];
    const fit = Math.min(clientWidth / (width * across), clientHeight / (height * down));
    const [scaleX, scaleY] = [fit * across, fit * down];
    return { x: (clientWidth - width * scaleX) / 2, y: (clientHeight - height * scaleY) / 2, scaleX, scaleY, fit };
  }

  #drawCrosshair(context: CanvasRenderingContext2D, scaleX: number, scaleY: number): void {
    const { horizontal, vertical } = this.orientation;
    const { width, height } = this.picture;
    const at = ({ axis, flip }: SliceOrientation['horizontal']) => {
      const index = this.#crosshair[axis];
      return (flip ? this.#volume.dims[axis] - 1 - index : index) + 0.5;
    };
    const x = at(horizontal) * scaleX;
    const y = at(vertical) * scaleY;
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
    let grip: Grip | undefined;
    const report = (event: PointerEvent) =>
      onPoint(this.#voxelAt(event.offsetX, event.offsetY), event.type === 'pointerdown');
    this.#canvas.addEventListener('pointerdown', (event) => {
      this.#canvas.setPointerCapture(event.pointerId);
      grip = grab?.(this.#placeAt(event.offsetX, event.offsetY), this.#slack());
      if (!grip) report(event);
    });
    this.#canvas.addEventListener('pointerleave', () => onHover?.(undefined));
    this.#canvas.addEventListener('pointermove', (event) => {
      onHover?.(this.#placeAt(event.offsetX, event.offsetY));
      if (grip) grip.move(this.#placeAt(event.offsetX, event.offsetY));
      else if (event.buttons & 1) report(event);
    });
    for (const end of ['pointerup', 'pointercancel'] as const)
      this.#canvas.addEventListener(end, () => {
        grip?.drop();
        grip = undefined;
      });
  }

  /**
   * Returns the tolerance for grabbing an object on the slice, in voxels along the two sides of the image; 0 across it.
   */
  #slack(): Vec3 {
    const { scaleX, scaleY } = this.#placement();
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
    const { x, y, scaleX, scaleY } = this.#placement();
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
    const place = this.#placeAt(canvasX, canvasY);
    return place.map((at, axis) => Math.min((this.#volume.dims[axis] ?? 1) - 1, Math.max(0, Math.round(at)))) as Vec3;
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
