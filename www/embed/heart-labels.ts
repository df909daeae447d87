// Stand-in for your own segmentation: a label map of the heart's MR.
import type { Scan } from './nifti';

export const LABELS = [
  { value: 1, name: 'left ventricle', color: [0.82, 0.27, 0.25] },
  { value: 2, name: 'right ventricle', color: [0.3, 0.5, 0.85] },
  { value: 3, name: 'wall of the left ventricle', color: [0.93, 0.75, 0.55] },
] as const;

/** Indices of voxels in the left and in the right ventricle. */
const SEEDS = [
  [31, 32, 5],
  [18, 26, 8],
];

/** Blood is brighter. */
const BLOOD = 85;

/** Thickness of the wall in millimetres. */
const WALL = 8;

/** Returns a label for each voxel of `heart.nii.gz`, 0 for none; the wall touches both ventricles. */
export function heartLabels({ voxels, size, spacing }: Scan): Uint8Array<ArrayBuffer> {
  const labels = new Uint8Array(voxels.length);
  for (const [k, seed] of SEEDS.entries()) fill(labels, k + 1, seed, (i) => (voxels[i] ?? 0) >= BLOOD, size);
  // Within each slice, so that the ventricle is open at both ends.
  const wall = ball(size, [spacing[0] ?? 1, spacing[1] ?? 1, 1000], WALL);
  for (let i = 0; i < labels.length; i++) {
    if (labels[i] !== 1) continue;
    for (const j of wall(i)) if (labels[j] === 0) labels[j] = 3;
  }
  return labels;
}

/** Labels the voxels that are connected with the seed. */
function fill(
  labels: Uint8Array,
  label: number,
  seed: number[],
  isWanted: (i: number) => boolean,
  size: number[],
): void {
  const near = ball(size, [1, 1, 1], 1);
  const [nx = 0, ny = 0] = size;
  const pending = [(seed[0] ?? 0) + nx * ((seed[1] ?? 0) + ny * (seed[2] ?? 0))];
  for (let i = pending.pop(); i !== undefined; i = pending.pop()) {
    if (labels[i] !== 0 || !isWanted(i)) continue;
    labels[i] = label;
    pending.push(...near(i));
  }
}

/** Returns a function that returns the voxels around a voxel, up to a radius in world units. */
export function ball(size: number[], spacing: number[], radius: number): (i: number) => number[] {
  const [nx = 0, ny = 0, nz = 0] = size;
  const reach = spacing.map((step) => Math.floor(radius / step));
  const [rx = 0, ry = 0, rz = 0] = reach;
  const offsets: number[][] = [];
  for (let z = -rz; z <= rz; z++) {
    for (let y = -ry; y <= ry; y++) {
      for (let x = -rx; x <= rx; x++) {
        if (Math.hypot(x * (spacing[0] ?? 1), y * (spacing[1] ?? 1), z * (spacing[2] ?? 1)) <= radius)
          offsets.push([x, y, z]);
      }
    }
  }
  return (i) => {
    const [x, y, z] = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
    return offsets
      .map(([dx = 0, dy = 0, dz = 0]) => [x + dx, y + dy, z + dz] as const)
      .filter(([a, b, c]) => a >= 0 && b >= 0 && c >= 0 && a < nx && b < ny && c < nz)
      .map(([a, b, c]) => a + nx * (b + ny * c));
  };
}
