/** Size and position of a slice image in its canvas: its top left corner, and its voxel size, CSS pixels. */
export interface Placement {
  x: number;
  y: number;
  scaleX: number;
  scaleY: number;
}

/** Extent of a canvas in CSS pixels, or of an image in voxels. */
export interface Extent {
  width: number;
  height: number;
}

/** Largest magnification, relative to an image that fits its canvas. */
const MOST_ZOOM = 40;

/** Zoom and pan of a slice image in its canvas. Voxels keep their true proportions. */
export class SliceCamera {
  readonly #image: Extent;
  /** Width and height of a voxel, world units. */
  readonly #voxel: Extent;
  #zoom = 1;
  /** Point of the image, in voxels, in the middle of the canvas. */
  #center: { x: number; y: number };

  constructor(image: Extent, voxel: Extent) {
    this.#image = image;
    this.#voxel = voxel;
    this.#center = { x: image.width / 2, y: image.height / 2 };
  }

  /** Magnification; 1 if the image fits the canvas. */
  get zoom(): number {
    return this.#zoom;
  }

  placement({ width, height }: Extent): Placement {
    const fit = Math.min(
      width / (this.#image.width * this.#voxel.width),
      height / (this.#image.height * this.#voxel.height),
    );
    const [scaleX, scaleY] = [fit * this.#zoom * this.#voxel.width, fit * this.#zoom * this.#voxel.height];
    return { x: width / 2 - this.#center.x * scaleX, y: height / 2 - this.#center.y * scaleY, scaleX, scaleY };
  }

  /** Magnifies the image by a factor about a position of the canvas, where the same point of the image stays. */
  zoomAt(factor: number, x: number, y: number, canvas: Extent): void {
    const before = this.placement(canvas);
    const point = { x: (x - before.x) / before.scaleX, y: (y - before.y) / before.scaleY };
    this.#zoom = Math.min(MOST_ZOOM, Math.max(1, this.#zoom * factor));
    const { scaleX, scaleY } = this.placement(canvas);
    this.#moveTo(point.x - (x - canvas.width / 2) / scaleX, point.y - (y - canvas.height / 2) / scaleY);
  }

  /** Moves the image by CSS pixels. */
  pan(x: number, y: number, canvas: Extent): void {
    const { scaleX, scaleY } = this.placement(canvas);
    this.#moveTo(this.#center.x - x / scaleX, this.#center.y - y / scaleY);
  }

  /** Moves the image, if it is magnified, so that a point of it, in voxels, is visible. */
  reveal(x: number, y: number, canvas: Extent): void {
    const place = this.placement(canvas);
    const [left, top] = [place.x + x * place.scaleX, place.y + y * place.scaleY];
    if (left < 0 || top < 0 || left > canvas.width || top > canvas.height) this.#moveTo(x, y);
  }

  /** Fits the image into the canvas again. */
  reset(): void {
    this.#zoom = 1;
    this.#moveTo(0, 0);
  }

  /** Moves a point of the image to the middle of the canvas. An image that fits stays centred. */
  #moveTo(x: number, y: number): void {
    const { width, height } = this.#image;
    const fits = this.#zoom === 1;
    this.#center = {
      x: fits ? width / 2 : Math.min(width, Math.max(0, x)),
      y: fits ? height / 2 : Math.min(height, Math.max(0, y)),
    };
  }
}
