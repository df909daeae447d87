//! A sequence as bytes, with fewer voxels if there are many, to find an object in.

use super::lattice::Lattice;
use super::missing::{self, Beside, Missing};
use super::region::{BINS, MAX_LEVEL, count_values, intensity_quantiles, noise_of};
use crate::math::DVec3;
use crate::methods::MethodError;
use crate::pauses::Pauses;
use crate::volume::{Region, Volume};

/// Largest number of voxels, of all frames together, that are visited: in some seconds. Of a larger sequence, every other
/// one is left out along the axis along which they are closest, again and again.
const MAX_VOXELS: usize = 16_000_000;

/// Smallest number of voxels that are kept along an axis.
const MIN_VOXELS: usize = 8;

/// Voxels per unit of work between pauses, when they are read.
const VOXELS_PER_UNIT: usize = 256;

/// A part of a sequence with quantised intensities.
pub(super) struct CoarseSequence {
    pub lattice: Lattice,
    /// The first voxel of the part in the volume.
    first: [usize; 3],
    /// The number of voxels of the volume for each voxel along x, y and z.
    strides: [usize; 3],
    /// Quantised intensities by frame.
    pub frames: Vec<Vec<u8>>,
    /// The difference in intensity that one step of the quantised intensities stands for.
    pub quantum: f64,
    /// The standard deviation of the noise, in steps of the quantised intensities.
    pub noise: f64,
}

impl CoarseSequence {
    /// Reads the voxels of all frames from the first to the last of `ends`.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] if all have the same intensity; [`MethodError::Volume`] if memory does not suffice.
    pub async fn read(volume: &Volume, ends: [[usize; 3]; 2], pauses: &Pauses) -> Result<Self, MethodError> {
        let count = [0, 1, 2].map(|k| ends[1][k] - ends[0][k] + 1);
        let strides = strides(count, volume.spacing(), volume.frames());
        let lattice = Lattice {
            dims: [0, 1, 2].map(|k| count[k].div_ceil(strides[k])),
            spacing: [0, 1, 2].map(|k| volume.spacing()[k] * strides[k] as f64),
        };
        let mut sequence =
            Self { lattice, first: ends[0], strides, frames: Vec::new(), quantum: 0.0, noise: 0.0 };
        let (mut counts, mut lacks_values) = (vec![0u64; BINS], false);
        for frame in 0..volume.frames() {
            sequence
                .for_each_layer(volume, frame, pauses, |layer| {
                    lacks_values |= count_values(layer, &mut counts)
                })
                .await?;
        }
        let range = intensity_quantiles(&counts);
        let mut beside = Beside::new(range);
        let read_again = if lacks_values { 0..volume.frames() } else { 0..0 };
        for frame in read_again {
            let mut values = Vec::with_capacity(lattice.len());
            sequence.for_each_layer(volume, frame, pauses, |layer| values.extend(layer)).await?;
            beside.add(&values, lattice.dims);
        }
        let missing = beside.missing();
        let has_background = missing == Missing::Background;
        let ([missing, from], to) = (missing.intensity(range), range[1]);
        if from >= to {
            return Err(MethodError::invalid(
                "volume",
                "all voxels have the same intensity: nothing to track",
            ));
        }
        let scale = MAX_LEVEL / (to - from);
        let level = |value: f32| {
            let value = if value.is_nan() { missing } else { f64::from(value) };
            ((value - from) * scale + 0.5).clamp(0.0, MAX_LEVEL) as u8
        };
        for frame in 0..volume.frames() {
            let mut levels = Vec::with_capacity(lattice.len());
            sequence
                .for_each_layer(volume, frame, pauses, |layer| {
                    levels.extend(layer.iter().map(|&value| level(value)));
                })
                .await?;
            sequence.frames.push(levels);
        }
        sequence.quantum = volume.span() / scale;
        let rows = sequence.frames.iter().flat_map(|frame| frame.chunks_exact(lattice.dims[0]));
        sequence.noise = noise_of(rows, has_background);
        Ok(sequence)
    }

    /// Calls `visit` with the voxels of each layer along z of a frame that are kept, in 0..1, the range of the volume;
    /// NaN for those without a value.
    async fn for_each_layer(
        &self,
        volume: &Volume,
        frame: usize,
        pauses: &Pauses,
        mut visit: impl FnMut(&[f32]),
    ) -> Result<(), MethodError> {
        let [nx, ny, nz] = self.lattice.dims;
        let [sx, sy, sz] = self.strides;
        // The last voxel that is kept, and none beyond.
        let dims = [(nx - 1) * sx + 1, (ny - 1) * sy + 1, 1];
        let mut layer = Vec::with_capacity(nx * ny);
        for z in 0..nz {
            let min = [self.first[0], self.first[1], self.first[2] + z * sz];
            let grid = missing::read(volume, Region { min, dims }, frame)?;
            layer.clear();
            for row in grid.values.chunks_exact(dims[0]).step_by(sy) {
                layer.extend(row.iter().step_by(sx));
            }
            visit(&layer);
            pauses.after(grid.values.len().div_ceil(VOXELS_PER_UNIT)).await;
        }
        Ok(())
    }

    /// Returns the voxel of the sequence nearest to a world point; `None` if that is outside.
    pub fn voxel_at(&self, volume: &Volume, point: DVec3) -> Option<usize> {
        let at = volume.inverse_affine().transform_point3(point);
        let first = DVec3::from(self.first.map(|i| i as f64));
        let strides = DVec3::from(self.strides.map(|i| i as f64));
        let last = DVec3::from(self.lattice.dims.map(|n| (n - 1) as f64));
        let at = ((at - first) / strides).to_array();
        let is_inside = (0..3).all(|k| at[k] >= -0.5 && at[k] <= last[k] + 0.5);
        is_inside.then(|| {
            let clamp = |k: usize| libm::round(at[k]).clamp(0.0, last[k]) as usize;
            self.lattice.index([0, 1, 2].map(clamp))
        })
    }

    /// Returns the world point of a voxel's centre.
    pub fn point_of(&self, volume: &Volume, voxel: usize) -> DVec3 {
        let at = self.in_volume(self.lattice.at(voxel));
        volume.affine().transform_point3(DVec3::from(at.map(|i| i as f64)))
    }

    /// Returns the coordinates in the volume of a voxel.
    pub fn in_volume(&self, at: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|k| self.first[k] + at[k] * self.strides[k])
    }
}

/// Returns how many voxels there are along each axis for one that is kept.
fn strides(count: [usize; 3], spacing: [f64; 3], frames: usize) -> [usize; 3] {
    let mut strides = [1; 3];
    loop {
        let kept = [0, 1, 2].map(|k: usize| count[k].div_ceil(strides[k]));
        let all = kept.iter().fold(frames, |product, &n| product.saturating_mul(n));
        let can_halve = (0..3).filter(|&k| kept[k] >= 2 * MIN_VOXELS);
        let closest = can_halve.min_by(|&a, &b| {
            let side = |k: usize| spacing[k] * strides[k] as f64;
            side(a).total_cmp(&side(b))
        });
        match closest {
            Some(axis) if all > MAX_VOXELS => strides[axis] *= 2,
            _ => return strides,
        }
    }
}
