//! Inside/outside labelling: finds which voxels are on the bright side of the boundary, to extract the surface of the
//! first frame and to close it at the sides of the box.
//!
//! No intensity threshold can separate bright from dark: far from a coil, bright regions are as dark as dark regions
//! near it. So an image is reconstructed from the boundary votes alone. Every face contributes a step in intensity by
//! its votes; the image whose differences are nearest to these steps (a Poisson equation) has steps of about 1 at all
//! walls, flat parts between, and hardly any trace of isolated votes. A voxel is bright if it is above the middle of
//! the step at the nearest wall.

use super::region::Region;
use super::vote::{Faces, X, Y, Z};
use crate::math::ConjugateGradients;
use crate::pauses::Pauses;

/// Number of voxels that count as one unit of work between pauses, in an iteration of the conjugate gradients.
const VOXELS_PER_UNIT: usize = 64;

/// Number of faces that count as one unit of work between pauses.
pub(super) const FACES_PER_UNIT: usize = 256;

/// Numbers of faces and of voxels between two pauses.
const FACES_PER_CHUNK: usize = 1 << 16;
const VOXELS_PER_CHUNK: usize = 1 << 18;

/// Stands for a value that is not known; all that are known are numbers.
pub(super) const UNKNOWN: f64 = f64::NAN;

/// Smallest weight of a face between two voxels, the share of windows that vote for it, with which the face counts as
/// part of a wall between bright and dark.
pub(super) const MIN_WEIGHT: f32 = 0.3;

/// Relative residual at which the conjugate gradients stop that solve the Poisson equation of the labelling.
const TOLERANCE: f64 = 1e-3;

/// Maximum number of conjugate gradient iterations for the Poisson equation of the labelling: a box of 64 voxels a side
/// needs a hundred.
const ITERATIONS: usize = 400;

/// A box of voxels within a [`Region`], whose voxels are labelled bright or dark.
#[derive(Clone, Copy)]
pub(super) struct VoxelBox {
    /// First and last voxel of the box, both inclusive, in the coordinates of the region.
    pub ends: [[usize; 3]; 2],
}

impl VoxelBox {
    /// Returns the numbers of voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.ends[1][axis] - self.ends[0][axis] + 1)
    }

    /// Returns the number of voxels in the box.
    pub fn len(&self) -> usize {
        self.dims().iter().product()
    }

    /// Returns the coordinates in the region of the voxel with the given index in the box, x fastest.
    pub fn at(&self, index: usize) -> [usize; 3] {
        let ([nx, ny, _], [x, y, z]) = (self.dims(), self.ends[0]);
        [x + index % nx, y + index / nx % ny, z + index / (nx * ny)]
    }

    /// Returns the index in the box of a voxel given by region coordinates; `None` outside the box.
    pub fn index(&self, at: [usize; 3]) -> Option<usize> {
        let [first, last] = self.ends;
        let is_inside = (0..3).all(|axis| (first[axis]..=last[axis]).contains(&at[axis]));
        let [nx, ny, _] = self.dims();
        is_inside.then(|| ((at[2] - first[2]) * ny + at[1] - first[1]) * nx + at[0] - first[0])
    }
}

/// Labels the voxels of a box in one frame: true on the bright side of the boundary. The labels are in the order of
/// [`VoxelBox::index`]; `None` if no faces have enough votes to be part of a boundary.
pub(super) async fn label_bright(
    region: &Region,
    frame: usize,
    faces: &Faces,
    voxels: VoxelBox,
    pauses: &Pauses,
) -> Option<Vec<bool>> {
    let dims = voxels.dims();
    let steps = face_steps(region, frame, faces, voxels, pauses).await;
    let mut source = vec![0.0; dims.iter().product()];
    for steps in steps.chunks(FACES_PER_CHUNK) {
        for &(i, j, step) in steps {
            source[i] -= f64::from(step);
            source[j] += f64::from(step);
        }
        pauses.after(steps.len() / FACES_PER_UNIT).await;
    }
    let reconstructed = solve_poisson(dims, source, pauses).await;
    // Weighted means of the middles of the steps, at voxels adjacent to walls.
    let mut middles = vec![(0.0, 0.0); reconstructed.len()];
    for steps in steps.chunks(FACES_PER_CHUNK) {
        for &(i, j, step) in steps.iter().filter(|(.., step)| step.abs() >= MIN_WEIGHT) {
            let (weight, middle) = (f64::from(step.abs()), (reconstructed[i] + reconstructed[j]) / 2.0);
            for k in [i, j] {
                middles[k].0 += weight * middle;
                middles[k].1 += weight;
            }
        }
        pauses.after(steps.len() / FACES_PER_UNIT).await;
    }
    drop(steps);
    let known =
        middles.into_iter().map(|(sum, total)| if total > 0.0 { sum / total } else { UNKNOWN }).collect();
    pauses.after(reconstructed.len() / VOXELS_PER_UNIT).await;
    let levels = extend_to_all(known, dims, pauses).await?;
    Some(reconstructed.iter().zip(levels).map(|(value, level)| *value > level).collect())
}

/// Labels the voxels of a box as [`label_bright`] does, but by comparing each intensity with the middle of the
/// intensity step at the nearest boundary. Solves no equations, but is only right where the signal is as strong as at
/// that boundary.
pub(super) async fn label_bright_by_level(
    region: &Region,
    frame: usize,
    faces: &Faces,
    voxels: VoxelBox,
    pauses: &Pauses,
) -> Option<Vec<bool>> {
    let [nx, ny, _] = region.dims;
    let level = |i: usize| {
        let [x, y, z] = voxels.at(i);
        f64::from(region.frames[frame][(z * ny + y) * nx + x])
    };
    let mut known = vec![UNKNOWN; voxels.len()];
    let steps = face_steps(region, frame, faces, voxels, pauses).await;
    for (i, j, _) in steps.into_iter().filter(|step| step.2.abs() >= MIN_WEIGHT) {
        let middle = (level(i) + level(j)) / 2.0;
        (known[i], known[j]) = (middle, middle);
    }
    pauses.after(voxels.len() / VOXELS_PER_UNIT).await;
    let levels = extend_to_all(known, voxels.dims(), pauses).await?;
    let mut bright = Vec::with_capacity(levels.len());
    for levels in levels.chunks(VOXELS_PER_CHUNK) {
        let first = bright.len();
        bright.extend(levels.iter().zip(first..).map(|(middle, i)| level(i) > *middle));
        pauses.after(levels.len() / VOXELS_PER_UNIT).await;
    }
    Some(bright)
}

/// Returns the steps in intensity at the faces within a box of voxels, of which an image is reconstructed: the indices
/// in the box of the voxels before and after the face, and its share of votes as the height of the step, negative if
/// intensity falls.
async fn face_steps(
    region: &Region,
    frame: usize,
    faces: &Faces,
    voxels: VoxelBox,
    pauses: &Pauses,
) -> Vec<(usize, usize, f32)> {
    let image = &region.frames[frame];
    let mut steps = Vec::new();
    for direction in [X, Y, Z] {
        let stride = [1, region.dims[0], region.dims[0] * region.dims[1]][direction];
        for faces in faces[direction].chunks(FACES_PER_CHUNK) {
            for face in faces {
                let before = region.voxel(face.voxel);
                let mut after = before;
                after[direction] += 1;
                let (Some(i), Some(j)) = (voxels.index(before), voxels.index(after)) else { continue };
                let is_up = image[face.voxel as usize] < image[face.voxel as usize + stride];
                steps.push((i, j, if is_up { face.weight } else { -face.weight }));
            }
            pauses.after(faces.len() / FACES_PER_UNIT).await;
        }
    }
    steps
}

/// Solves the Poisson equation of the labelling for the image whose graph Laplacian, see [`laplacian`], is `source`, by
/// conjugate gradients.
async fn solve_poisson(dims: [usize; 3], source: Vec<f64>, pauses: &Pauses) -> Vec<f64> {
    // Without a preconditioner.
    let same = |residual: &mut [f64]| residual.to_vec();
    let mut gradients = ConjugateGradients::new(vec![0.0; source.len()], source, same);
    let enough = TOLERANCE * TOLERANCE * gradients.energy();
    for _ in 0..ITERATIONS {
        if gradients.energy() <= enough {
            break;
        }
        let image = laplacian(dims, gradients.direction(), pauses).await;
        if !gradients.iterate_in_slices(image, same, pauses).await {
            break;
        }
    }
    gradients.into_solution()
}

/// Returns for each voxel of a box the sum of its differences from its neighbours, its own entry in `values` minus
/// theirs: the graph Laplacian.
async fn laplacian([nx, ny, nz]: [usize; 3], values: &[f64], pauses: &Pauses) -> Vec<f64> {
    let mut out = vec![0.0; values.len()];
    for z in 0..nz {
        let mut add = |i: usize, j: usize| {
            let difference = values[i] - values[j];
            out[i] += difference;
            out[j] -= difference;
        };
        for y in 0..ny {
            let row = (z * ny + y) * nx;
            (row + 1..row + nx).for_each(|i| add(i, i - 1));
            if y > 0 {
                (row..row + nx).for_each(|i| add(i, i - nx));
            }
            if z > 0 {
                (row..row + nx).for_each(|i| add(i, i - nx * ny));
            }
        }
        pauses.after(nx * ny / VOXELS_PER_UNIT + 1).await;
    }
    out
}

/// Extends values that are known at some voxels of a box to all: each voxel takes the value of the known voxel fewest
/// steps along the axes away. Values are [`UNKNOWN`] at others. `None` if no value is known.
pub(super) async fn extend_to_all(
    known: Vec<f64>,
    [nx, ny, nz]: [usize; 3],
    pauses: &Pauses,
) -> Option<Vec<f64>> {
    let mut all = known;
    let mut front: Vec<u32> = (0..all.len()).filter(|&i| !all[i].is_nan()).map(|i| i as u32).collect();
    if front.is_empty() {
        return None;
    }
    while !front.is_empty() {
        let mut next = Vec::new();
        for (count, i) in front.into_iter().map(|i| i as usize).enumerate() {
            if count % FACES_PER_UNIT == 0 {
                pauses.after(1).await;
            }
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
            let neighbours = [
                (x > 0).then(|| i - 1),
                (x + 1 < nx).then_some(i + 1),
                (y > 0).then(|| i - nx),
                (y + 1 < ny).then_some(i + nx),
                (z > 0).then(|| i - nx * ny),
                (z + 1 < nz).then_some(i + nx * ny),
            ];
            for j in neighbours.into_iter().flatten() {
                if all[j].is_nan() {
                    all[j] = all[i];
                    next.push(j as u32);
                }
            }
        }
        front = next;
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::super::vote::{BoundaryVoting, Window};
    use super::super::working_space::WorkingSpace;
    use super::*;
    use crate::math::{DAffine3, DVec3, Random};
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const DIMS: [usize; 3] = [30, 26, 28];
    const CENTER: DVec3 = DVec3::new(14.0, 12.5, 13.5);
    const RADIUS: f64 = 8.0;

    fn depth(i: usize) -> f64 {
        let [x, y, z] = [i % DIMS[0], i / DIMS[0] % DIMS[1], i / (DIMS[0] * DIMS[1])].map(|k| k as f64);
        RADIUS - DVec3::new(x, y, z).distance(CENTER)
    }

    /// A test image of a ball that becomes darker along z: its far end is darker than the background at its near end.
    fn shaded() -> Region {
        let mut random = Random::new(3);
        let value = |i: usize| {
            let shading = 1.0 - 0.75 * (i / (DIMS[0] * DIMS[1])) as f64 / DIMS[2] as f64;
            let clean = shading * (80.0 + 80.0 * (depth(i) + 0.5).clamp(0.0, 1.0));
            (clean + f64::from(random.below(8)) - 4.0).clamp(0.0, 254.0) as u8
        };
        Region {
            dims: DIMS,
            inner: [[0; 3], DIMS.map(|n| n - 1)],
            spacing: DVec3::ONE,
            space: WorkingSpace::default(),
            to_space: DAffine3::IDENTITY,
            from_space: DAffine3::IDENTITY,
            frames: vec![(0..DIMS.iter().product()).map(value).collect()],
            quantum: 1.0,
            threshold: 20.0,
            has_background: false,
            is_blank: Vec::new(),
        }
    }

    fn faces(region: &Region, threshold: f64) -> Faces {
        let window = Window { half_width: 2, frames: 0, threshold, cyclic: false };
        finished(BoundaryVoting::new(window, 1).faces(region, 0, usize::MAX, &Pauses::default())).unwrap()
    }

    #[test]
    fn walls_decide_what_is_bright_even_under_shading() {
        let region = shaded();
        let whole = VoxelBox { ends: region.inner };
        let found =
            finished(label_bright(&region, 0, &faces(&region, 20.0), whole, &Pauses::default())).unwrap();
        for (i, &is_bright) in found.iter().enumerate().filter(|&(i, _)| depth(i).abs() > 1.5) {
            assert_eq!(is_bright, depth(i) > 0.0, "{:?}", whole.at(i));
        }
        // No threshold would separate them: the far end inside is darker than the near end outside.
        let image = &region.frames[0];
        let [inside, outside] = [[14, 12, 21], [14, 12, 0]].map(|at| image[whole.index(at).unwrap()]);
        assert!(inside < outside, "{inside} {outside}");
    }

    #[test]
    fn a_single_layer_of_voxels_is_labelled() {
        let region = shaded();
        let sheet = VoxelBox { ends: [[0, 0, 17], [DIMS[0] - 1, DIMS[1] - 1, 17]] };
        let found =
            finished(label_bright(&region, 0, &faces(&region, 20.0), sheet, &Pauses::default())).unwrap();
        let near_wall = |at: [usize; 3]| {
            let [nx, ny, _] = DIMS;
            depth((at[2] * ny + at[1]) * nx + at[0])
        };
        for (i, &is_bright) in found.iter().enumerate() {
            let depth = near_wall(sheet.at(i));
            assert!(depth.abs() < 1.5 || is_bright == (depth > 0.0), "{:?}", sheet.at(i));
        }
    }

    #[test]
    fn values_are_extended_to_many_voxels_with_pauses() {
        let mut known = vec![UNKNOWN; 1 << 20];
        known[77] = 3.0;
        let pauses = Pauses::default();
        let all = finished(extend_to_all(known, [128, 128, 64], &pauses));
        assert!(all.unwrap().iter().all(|&value| value == 3.0));
        assert!(pauses.work() > 1 << 12, "{}", pauses.work());
        assert!(finished(extend_to_all(vec![UNKNOWN; 8], [2; 3], &pauses)).is_none());
    }

    #[test]
    fn without_walls_nothing_is_labelled() {
        let region = shaded();
        let (none, whole) = (faces(&region, 250.0), VoxelBox { ends: region.inner });
        assert!(finished(label_bright(&region, 0, &none, whole, &Pauses::default())).is_none());
    }
}
