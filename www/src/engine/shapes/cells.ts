/**
 * Computed volumes of cells as in confocal microscopy: a nucleus with a marked boundary, and a cell that is bright
 * inside.
 */
import { uniform } from '../random';
import { distance, noise, type ShapeVoxels, sample } from './sampling';

type Point = [number, number, number];

const NUCLEUS_SIZE = 72;
/** Balls that make up the nucleus: centre and radius, voxels. */
const LOBES: { middle: Point; radius: number }[] = [
  { middle: [26, 30, 34], radius: 13 },
  { middle: [44, 28, 38], radius: 13 },
  { middle: [38, 46, 34], radius: 12 },
];
/** Width of the smooth transition between two lobes of the nucleus, voxels. */
const BLEND = 5;
/** Distance from the surface of the nucleus, voxels, at which the brightness of its boundary has dropped to 1/e. */
const MARK = 2.2;

/** Returns the volume of a nucleus of three lobes with only its boundary bright, and noise. */
export function markedNucleus(): ShapeVoxels {
  const grain = noise(22, 14);
  return sample(NUCLEUS_SIZE, (i, j, k) => {
    const depth = LOBES.map(({ middle, radius }) => radius - distance([i, j, k], middle));
    const d = BLEND * Math.log(depth.reduce((sum, one) => sum + Math.exp(one / BLEND), 0));
    return 20 + 200 * Math.exp(-((d / MARK) ** 2)) + grain();
  });
}

const CELL_SIZE = 80;
const CELL_RADIUS = 24;
const GRANULES = 7;

/**
 * Returns the volume of a cell with intensity decreasing from its centre to an irregular border, and brighter granules.
 */
export function cell(): ShapeVoxels {
  const next = uniform(24);
  const middle: Point = [39.5, 39.5, 39.5];
  const around = (radius: number): Point => {
    const [turn, height] = [2 * Math.PI * next(), 2 * next() - 1];
    const flat = radius * Math.sqrt(1 - height * height);
    return [39.5 + flat * Math.cos(turn), 39.5 + flat * Math.sin(turn), 39.5 + radius * height];
  };
  const granules = Array.from({ length: GRANULES }, () => around(10 + 6 * next()));
  const bulges = Array.from({ length: 14 }, () => around(CELL_RADIUS));
  const grain = noise(4, 4);
  return sample(CELL_SIZE, (i, j, k) => {
    const at: Point = [i, j, k];
    const bump = (points: Point[], width: number) =>
      points.reduce((sum, point) => sum + Math.exp(-((distance(at, point) / width) ** 2)), 0);
    const body = 150 / (1 + Math.exp((distance(at, middle) - CELL_RADIUS) / 3));
    return body + 60 * bump(bulges, 5) + 110 * bump(granules, 5) + grain();
  });
}
