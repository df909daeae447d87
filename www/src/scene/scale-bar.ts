import { token } from '../kit/dom';
import { figure } from '../kit/format';
import { plural } from '../texts';

/** Largest length of a scale bar, as a fraction of the picture's width. */
const MOST = 0.25;
/** Distance of the bar from the left and lower edges of the picture, and its thickness. */
const [MARGIN, THICKNESS] = [16, 4];

/** Colours of texts over a picture, and of their contour. */
export interface Inks {
  fill: string;
  contour: string;
}
export const ON_BLACK: Inks = { fill: '#fff', contour: '#000' };

/** Returns the colours of texts over the page's background. */
export function pageInks(): Inks {
  return { fill: token('--ink'), contour: token('--panel') };
}

/** Returns the largest of the lengths 1, 2 or 5 times a power of ten up to `most`. */
export function barLength(most: number): number {
  const power = 10 ** Math.floor(Math.log10(most));
  const factor = [5, 2, 1].find((one) => one * power <= most) ?? 1;
  return Number((factor * power).toPrecision(1));
}

/** Draws a scale bar with its length into the lower left corner of a picture; `perUnit` is the length of a unit there. */
export function paintScaleBar(
  context: CanvasRenderingContext2D,
  [width, height]: readonly [number, number],
  perUnit: number,
  unit: string,
  inks: Inks,
): void {
  const length = barLength((MOST * width) / perUnit);
  const [left, bottom] = [MARGIN, height - MARGIN];
  const bar = [left, bottom - THICKNESS, length * perUnit, THICKNESS] as const;
  const label = unit ? `${figure(length)} ${unit}` : plural('view.units', length, { count: figure(length) });
  paintText(context, label, left, bottom - THICKNESS - 6, 'left', inks);
  context.strokeRect(...bar);
  context.fillRect(...bar);
}

/** Draws a text with a contour, so that it is legible on any background. */
export function paintText(
  context: CanvasRenderingContext2D,
  text: string,
  x: number,
  y: number,
  align: CanvasTextAlign,
  { fill, contour }: Inks,
): void {
  context.fillStyle = fill;
  context.strokeStyle = contour;
  context.lineWidth = 3;
  context.lineJoin = 'round';
  context.textAlign = align;
  context.strokeText(text, x, y);
  context.fillText(text, x, y);
}
