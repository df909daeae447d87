/** Label maps of the examples, computed from intensities by thresholds and connected components. */
import type { Vec3 } from './protocol';

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
 * on; pulp is what is below 640 but enclosed in its axial slice, other than pits that are open above. On its outer side, enamel is as blurred as dentine is
 * bright: that rim, two voxels of it, belongs to enamel. Parts of less than 60 voxels are dropped.
 */
export function labelTooth(intensities: Float32Array, dims: Vec3): Uint8Array {
  const labels = Uint8Array.from(intensities, (value) =>
    value >= ENAMEL ? ENAMEL_LABEL : value >= TISSUE ? DENTINE_LABEL : PULP_LABEL,
  );
  openToAir(labels, dims);
  openPits(labels, dims);
  coverRim(labels, dims);
  dropSpecks(labels, dims, ENAMEL_LABEL, DENTINE_LABEL);
  dropSpecks(labels, dims, PULP_LABEL, DENTINE_LABEL);
  dropSpecks(labels, dims, DENTINE_LABEL, AIR);
  return labels;
}

/** Intensity of the CT of the head from which on voxels are bone. */
const BONE = 95;

/** Labels the CT of a head: bone 1 from intensity 95 on. Parts of less than 60 voxels are dropped. */
export function labelHead(intensities: Float32Array, dims: Vec3): Uint8Array {
  const labels = Uint8Array.from(intensities, (value) => Number(value >= BONE));
  dropSpecks(labels, dims, 1, AIR);
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
  let present = labels.map((value) => Number(value === label));
  for (let step = 0; step < BLUR; step++) {
    const wider = present.slice();
    const mark = (next: number) => {
      wider[next] = 1;
    };
    for (let index = present.indexOf(1); index >= 0; index = present.indexOf(1, index + 1))
      forEachNeighbour(index, dims, mark);
    present = wider;
  }
  return present;
}

/** Returns the connected parts of a label, as lists of voxels. */
function partsOf(labels: Uint8Array, dims: Vec3, label: number): number[][] {
  const unseen = labels.map((value) => Number(value === label));
  const parts: number[][] = [];
  for (let first = unseen.indexOf(1); first >= 0; first = unseen.indexOf(1, first + 1)) {
    const part = [first];
    unseen[first] = 0;
    const add = (next: number) => {
      if (unseen[next] === 0) return;
      unseen[next] = 0;
      part.push(next);
    };
    for (const index of part) forEachNeighbour(index, dims, add);
    parts.push(part);
  }
  return parts;
}

/** Replaces the label of its connected parts of less than {@link SPECK} voxels by another one. */
function dropSpecks(labels: Uint8Array, dims: Vec3, label: number, other: number): void {
  for (const part of partsOf(labels, dims, label))
    if (part.length < SPECK) for (const index of part) labels[index] = other;
}

/** Sets all parts of pulp but the largest that touch air to air: pits, which are open above. */
function openPits(labels: Uint8Array, dims: Vec3): void {
  const parts = partsOf(labels, dims, PULP_LABEL).sort((one, other) => other.length - one.length);
  for (const part of parts.slice(1)) {
    let isOpen = false;
    for (const index of part)
      forEachNeighbour(index, dims, (next) => {
        isOpen ||= labels[next] === AIR;
      });
    if (isOpen) for (const index of part) labels[index] = AIR;
  }
}

/** Calls `visit` with the indices of the up to six voxels that share a side with a voxel. */
function forEachNeighbour(index: number, [nx, ny, nz]: Vec3, visit: (index: number) => void): void {
  const row = Math.floor(index / nx);
  const [x, y, z] = [index - row * nx, row % ny, Math.floor(row / ny)];
  if (x > 0) visit(index - 1);
  if (x < nx - 1) visit(index + 1);
  if (y > 0) visit(index - nx);
  if (y < ny - 1) visit(index + nx);
  if (z > 0) visit(index - nx * ny);
  if (z < nz - 1) visit(index + nx * ny);
}
