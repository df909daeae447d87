/** Label maps of the examples, computed from intensities by thresholds and connected components. */
import type { Vec3 } from './protocol';

/** Names of the labels of the examples, in the order of their values from 1 on. */
export type TissueMap = Uint8Array;

/** Intensity of the CT of the tooth halfway between its holder (400) and dentine (820), rounded. */
const TISSUE = 640;
/** Intensity halfway between dentine (820) and enamel (1,180). */
const ENAMEL = 1000;
/** Distance in voxels over which the intensities of a boundary are blurred. */
const BLUR = 2;
/** Number of voxels below which a part is noise. */
const SPECK = 60;

const [AIR, ENAMEL_LABEL, DENTINE_LABEL, PULP_LABEL] = [0, 1, 2, 3];

/**
 * Labels the CT of a tooth: enamel 1, dentine 2, pulp 3. Enamel are intensities of 1,000 or more, dentine those from 640
 * on; pulp is what is below 640 but enclosed in its axial slice. On its outer side, enamel is as blurred as dentine is
 * bright: that rim, two voxels of it, belongs to enamel. Parts of less than 60 voxels are dropped.
 */
export function labelTooth(intensities: Float32Array, dims: Vec3): TissueMap {
  const labels = Uint8Array.from(intensities, (value) =>
    value >= ENAMEL ? ENAMEL_LABEL : value >= TISSUE ? DENTINE_LABEL : PULP_LABEL,
  );
  openToAir(labels, dims);
  coverRim(labels, dims);
  dropSpecks(labels, dims, ENAMEL_LABEL, DENTINE_LABEL);
  dropSpecks(labels, dims, PULP_LABEL, DENTINE_LABEL);
  dropSpecks(labels, dims, DENTINE_LABEL, AIR);
  return labels;
}

/** Intensities of the CT of the head from which on voxels are soft tissue, and bone. */
const [SOFT, BONE] = [35, 95];

/** Labels the CT of a head: bone 1 from intensity 95 on, soft tissue 2 from 35 on. Parts of less than 60 voxels are dropped. */
export function labelHead(intensities: Float32Array, dims: Vec3): TissueMap {
  const labels = Uint8Array.from(intensities, (value) => (value >= BONE ? 1 : value >= SOFT ? 2 : 0));
  dropSpecks(labels, dims, 1, 2);
  dropSpecks(labels, dims, 2, 0);
  return labels;
}

/** Sets pulp that is connected to the border of its axial slice to air. */
function openToAir(labels: Uint8Array, [nx, ny, nz]: Vec3): void {
  for (let z = 0; z < nz; z++) {
    const slice = labels.subarray(z * nx * ny, (z + 1) * nx * ny);
    const queue: number[] = [];
    const open = (index: number) => {
      if (slice[index] !== PULP_LABEL) return;
      slice[index] = AIR;
      queue.push(index);
    };
    for (let x = 0; x < nx; x++) for (const y of [0, ny - 1]) open(y * nx + x);
    for (let y = 0; y < ny; y++) for (const x of [0, nx - 1]) open(y * nx + x);
    for (let index = queue.pop(); index !== undefined; index = queue.pop()) {
      const x = index % nx;
      if (x > 0) open(index - 1);
      if (x < nx - 1) open(index + 1);
      open(index - nx);
      open(index + nx);
    }
  }
}

/** Sets dentine that is within the blur of both enamel and air to enamel. */
function coverRim(labels: Uint8Array, dims: Vec3): void {
  const nearEnamel = near(labels, dims, ENAMEL_LABEL);
  const nearAir = near(labels, dims, AIR);
  for (let index = 0; index < labels.length; index++)
    if (labels[index] === DENTINE_LABEL && nearEnamel[index] && nearAir[index]) labels[index] = ENAMEL_LABEL;
}

/** Returns 1 for the voxels within {@link BLUR} steps, side by side, of a voxel with a label. */
function near(labels: Uint8Array, dims: Vec3, label: number): Uint8Array {
  let present = Uint8Array.from(labels, (value) => Number(value === label));
  for (let step = 0; step < BLUR; step++) {
    const wider = Uint8Array.from(present);
    for (let index = 0; index < present.length; index++)
      if (present[index]) for (const next of neighbours(index, dims)) wider[next] = 1;
    present = wider;
  }
  return present;
}

/** Replaces the label of its connected parts of less than {@link SPECK} voxels by another one. */
function dropSpecks(labels: Uint8Array, dims: Vec3, label: number, other: number): void {
  const seen = new Uint8Array(labels.length);
  for (let first = labels.indexOf(label); first >= 0; first = labels.indexOf(label, first + 1)) {
    if (seen[first]) continue;
    const part = [first];
    seen[first] = 1;
    for (const index of part)
      for (const next of neighbours(index, dims))
        if (labels[next] === label && !seen[next]) {
          seen[next] = 1;
          part.push(next);
        }
    if (part.length < SPECK) for (const index of part) labels[index] = other;
  }
}

/** Returns the indices of the up to six voxels that share a side with a voxel. */
function neighbours(index: number, [nx, ny, nz]: Vec3): number[] {
  const row = Math.floor(index / nx);
  const at = [index - row * nx, row % ny, Math.floor(row / ny)];
  const found: number[] = [];
  for (const [axis, [size, stride]] of (
    [
      [nx, 1],
      [ny, nx],
      [nz, nx * ny],
    ] as const
  ).entries()) {
    if ((at[axis] ?? 0) > 0) found.push(index - stride);
    if ((at[axis] ?? 0) < size - 1) found.push(index + stride);
  }
  return found;
}
