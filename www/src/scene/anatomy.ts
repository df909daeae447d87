import type { Plane, Vec3, VolumeView } from '../engine/protocol';
import { text } from '../texts';

export type Axis = 0 | 1 | 2;
export type Grid = Pick<VolumeView, 'dims' | 'spacing' | 'affine' | 'space'>;

/**
 * The horizontal or vertical side of a slice image: the voxel axis along it, and whether the voxel index decreases from
 * left to right or from top to bottom.
 */
export interface ImageAxis {
  axis: Axis;
  flip: boolean;
}

/**
 * How slices across one voxel axis are displayed, in radiological convention: the patient's right on the left, head or
 * face up.
 */
export interface SliceOrientation {
  axis: Axis;
  name: 'Sagittal' | 'Coronal' | 'Axial';
  /** The side of the slice image that runs from left to right. */
  horizontal: ImageAxis;
  /** The side of the slice image that runs from top to bottom. */
  vertical: ImageAxis;
  labels: { left: string; right: string; top: string; bottom: string };
}

/** Letters of the two ends of each anatomical axis of RAS space, positive end first. */
const ENDS = [
  ['R', 'L'],
  ['A', 'P'],
  ['S', 'I'],
] as const;
const NAMES = ['Sagittal', 'Coronal', 'Axial'] as const;

/** Displayed names of the slice directions, in the language of the page. */
export const SLICE_NAMES: Record<SliceOrientation['name'], string> = {
  Sagittal: text('view.sagittal'),
  Coronal: text('view.coronal'),
  Axial: text('view.axial'),
};
const ORDERS: [Axis, Axis, Axis][] = [
  [0, 1, 2],
  [0, 2, 1],
  [1, 0, 2],
  [1, 2, 0],
  [2, 0, 1],
  [2, 1, 0],
];

/**
 * Returns +1 for each world axis that points to the positive anatomical end (R, A, S), -1 for one that points away, as
 * x and y of LPS do.
 */
export function anatomicalSigns(space: 'RAS' | 'LPS'): Vec3 {
  return space === 'LPS' ? [-1, -1, 1] : [1, 1, 1];
}

/**
 * Returns for each voxel axis the anatomical axis (0 to 2: left-right, back-front, foot-head) that it is most nearly
 * parallel to, each of them once. `positive`: whether the voxel index increases towards the right, front or head.
 */
export function anatomyOf(grid: Grid): { anatomical: Axis; positive: boolean }[] {
  const signs = anatomicalSigns(grid.space);
  const along = (voxel: number, world: number) =>
    ((grid.affine[4 * voxel + world] ?? 0) * (signs[world] ?? 1)) / (grid.spacing[voxel] || 1);
  const score = (order: Axis[]) => order.reduce<number>((sum, world, voxel) => sum + Math.abs(along(voxel, world)), 0);
  // The margin resolves ties, in a volume rotated by 45 degrees, in favour of the first order.
  const best = ORDERS.reduce((a, b) => (score(b) > score(a) + 1e-9 ? b : a));
  return best.map((anatomical, voxel) => ({ anatomical, positive: along(voxel, anatomical) >= 0 }));
}

/** Returns for each of the three voxel axes of a volume how slices across it are displayed. */
export function sliceOrientations(grid: Grid): SliceOrientation[] {
  const anatomy = anatomyOf(grid);
  const at = (axis: Axis) => anatomy[axis] ?? { anatomical: axis, positive: true };
  return ([0, 1, 2] as Axis[]).map((axis) => {
    const sides = ([0, 1, 2] as Axis[]).filter((other) => other !== axis);
    const [across, up] = sides.sort((a, b) => at(a).anatomical - at(b).anatomical) as [Axis, Axis];
    const [left, right] = ENDS[at(across).anatomical];
    const [top, bottom] = ENDS[at(up).anatomical];
    return {
      axis,
      name: NAMES[at(axis).anatomical],
      horizontal: { axis: across, flip: at(across).positive },
      vertical: { axis: up, flip: at(up).positive },
      labels: { left, right, top, bottom },
    };
  });
}

/**
 * Applies a 4 × 4 affine map, column-major, to a point: with the volume's map, a voxel index (centres at integers) to
 * world space; with the inverse, a world point to voxel index.
 */
export function toWorld(affine: ArrayLike<number>, index: Vec3): Vec3 {
  const row = (r: number) =>
    (affine[r] ?? 0) * index[0] +
    (affine[4 + r] ?? 0) * index[1] +
    (affine[8 + r] ?? 0) * index[2] +
    (affine[12 + r] ?? 0);
  return [row(0), row(1), row(2)];
}

/** Returns the inverse of a 4 × 4 affine map; both are column-major. */
export function invert(affine: ArrayLike<number>): Float64Array {
  const a = (column: number, row: number) => affine[4 * column + row] ?? 0;
  const cofactor = (c: number, r: number) => {
    const [c1, c2, r1, r2] = [(c + 1) % 3, (c + 2) % 3, (r + 1) % 3, (r + 2) % 3];
    return a(c1, r1) * a(c2, r2) - a(c1, r2) * a(c2, r1);
  };
  const determinant = a(0, 0) * cofactor(0, 0) + a(0, 1) * cofactor(0, 1) + a(0, 2) * cofactor(0, 2);
  const inverse = new Float64Array(16);
  for (let c = 0; c < 3; c++) for (let r = 0; r < 3; r++) inverse[4 * c + r] = cofactor(r, c) / determinant;
  for (let r = 0; r < 3; r++) {
    inverse[12 + r] = -(
      (inverse[r] ?? 0) * a(3, 0) +
      (inverse[4 + r] ?? 0) * a(3, 1) +
      (inverse[8 + r] ?? 0) * a(3, 2)
    );
  }
  inverse[15] = 1;
  return inverse;
}

/**
 * Returns the plane, in world space, of the slice with the given index across a voxel axis, for cross-sections of the
 * surface. `affine` maps voxel indices to world space; `inverse` is its inverse.
 */
export function slicePlane(affine: ArrayLike<number>, inverse: ArrayLike<number>, axis: Axis, index: number): Plane {
  const at: Vec3 = [0, 0, 0];
  at[axis] = index;
  // The row of the inverse is the gradient of the index, hence normal to its level planes, also in a sheared grid.
  const normal: Vec3 = [inverse[axis] ?? 0, inverse[4 + axis] ?? 0, inverse[8 + axis] ?? 0];
  const length = Math.hypot(...normal);
  return { origin: toWorld(affine, at), normal: normal.map((x) => x / length) as Vec3 };
}

/** Returns the index of the voxel nearest to a position, in voxels, also outside the volume. */
export function nearestVoxel(place: Vec3, dims: Vec3): Vec3 {
  return place.map((at, axis) => Math.min((dims[axis] ?? 1) - 1, Math.max(0, Math.round(at)))) as Vec3;
}
