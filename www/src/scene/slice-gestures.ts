/** Actions of the gestures on a slice image; positions and distances are in CSS pixels. */
export interface GestureTarget {
  /** Returns the drag that a press of the main button, or of one finger, starts. */
  press: (event: PointerEvent) => Drag;
  zoom: (factor: number, x: number, y: number) => void;
  pan: (x: number, y: number) => void;
  /** Returns the drag that changes the displayed intensities. */
  adjustWindow: (event: PointerEvent) => Drag;
  /** Whether drags with the main button change the displayed intensities. */
  isAdjusting: () => boolean;
  /** Whether the image is magnified. */
  isZoomed: () => boolean;
  reset: () => void;
}

/** A drag of the pointer; `end` is called when it is released. */
export interface Drag {
  move: (event: PointerEvent) => void;
  end?: () => void;
  /** Whether a double click belongs to what is dragged, and does not reset the zoom. */
  takesClicks?: boolean;
}

/** Magnification for a pixel that the wheel scrolls. */
const WHEEL_ZOOM = 1.0025;
/** Pixels for a line that the wheel scrolls, in browsers that count lines. */
const LINE = 18;
/** Distance in CSS pixels by which a finger has to move before it drags: a second one may follow, to zoom. */
const TOUCH_TOLERANCE = 4;

/**
 * Follows mouse, pen and fingers on a slice image: the wheel or two fingers zoom at the pointer, dragging with the
 * middle button or Shift pans, with the right one changes the displayed intensities, and a double click resets the
 * zoom. Other presses are those of the lab.
 */
export class SliceGestures {
  readonly #canvas: HTMLCanvasElement;
  readonly #target: GestureTarget;
  readonly #pointers = new Map<number, PointerEvent>();
  #drag: Drag | undefined;
  /** The first finger, while it is not known whether a second one follows. */
  #pending: PointerEvent | undefined;
  #takesClicks = false;

  constructor(canvas: HTMLCanvasElement, target: GestureTarget) {
    this.#canvas = canvas;
    this.#target = target;
    canvas.addEventListener('pointerdown', (event) => this.#press(event));
    canvas.addEventListener('pointermove', (event) => this.#move(event));
    for (const end of ['pointerup', 'pointercancel'] as const)
      canvas.addEventListener(end, (event) => this.#release(event));
    canvas.addEventListener('wheel', (event) => this.#turn(event), { passive: false });
    canvas.addEventListener('dblclick', () => {
      if (!this.#takesClicks) target.reset();
    });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  #press(event: PointerEvent): void {
    this.#canvas.setPointerCapture(event.pointerId);
    // Otherwise the middle button scrolls the page in some browsers.
    if (event.button === 1) event.preventDefault();
    this.#pointers.set(event.pointerId, event);
    if (this.#pointers.size > 1) this.#pinch();
    else if (event.pointerType === 'touch') this.#pending = event;
    else this.#begin(event);
  }

  #begin(event: PointerEvent): void {
    this.#drag = this.#dragFor(event);
    this.#takesClicks = this.#drag.takesClicks ?? false;
  }

  #dragFor(event: PointerEvent): Drag {
    const { press, adjustWindow, isAdjusting } = this.#target;
    if (event.button === 2) return adjustWindow(event);
    if (event.button === 1 || event.shiftKey) return this.#panning(event);
    return isAdjusting() ? adjustWindow(event) : press(event);
  }

  #panning(from: PointerEvent): Drag {
    let last = from;
    const move = (event: PointerEvent) => {
      this.#target.pan(event.offsetX - last.offsetX, event.offsetY - last.offsetY);
      last = event;
    };
    return { move };
  }

  /** Zooms and pans with the first two fingers. */
  #pinch(): void {
    this.#drag?.end?.();
    this.#pending = undefined;
    let before = this.#fingers();
    const move = () => {
      const now = this.#fingers();
      this.#target.zoom(now.distance / before.distance, before.x, before.y);
      this.#target.pan(now.x - before.x, now.y - before.y);
      before = now;
    };
    this.#drag = { move };
  }

  /** Middle between the first two fingers, and their distance. */
  #fingers(): { x: number; y: number; distance: number } {
    const [one, other = one] = [...this.#pointers.values()];
    const at = (event?: PointerEvent) => [event?.offsetX ?? 0, event?.offsetY ?? 0] as const;
    const [[x, y], [otherX, otherY]] = [at(one), at(other)];
    const distance = Math.max(1, Math.hypot(otherX - x, otherY - y));
    return { x: (x + otherX) / 2, y: (y + otherY) / 2, distance };
  }

  #move(event: PointerEvent): void {
    if (!this.#pointers.has(event.pointerId)) return;
    this.#pointers.set(event.pointerId, event);
    const from = this.#pending;
    if (from && Math.hypot(event.offsetX - from.offsetX, event.offsetY - from.offsetY) < TOUCH_TOLERANCE) return;
    this.#flush();
    this.#drag?.move(event);
  }

  #release(event: PointerEvent): void {
    if (event.type === 'pointerup') this.#flush();
    this.#pending = undefined;
    this.#pointers.delete(event.pointerId);
    this.#drag?.end?.();
    this.#drag = undefined;
  }

  /** Starts the drag of a finger that no second one has followed. */
  #flush(): void {
    const event = this.#pending;
    this.#pending = undefined;
    if (event) this.#begin(event);
  }

  #turn(event: WheelEvent): void {
    const pixels = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * LINE;
    // The page scrolls on where there is nothing to zoom out of.
    if (pixels > 0 && !this.#target.isZoomed()) return;
    event.preventDefault();
    this.#target.zoom(WHEEL_ZOOM ** -pixels, event.offsetX, event.offsetY);
  }
}
