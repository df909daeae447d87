//! Binning of a volume: fewer, larger voxels, each the mean of a block of the original ones.

use super::derived::Derivation;
use super::error::{VolumeError, reserve};
use super::{Volume, VolumeInit};
use crate::math::{DAffine3, DMat3, DVec3};

/// Largest number of voxels along an axis that binning ([`Volume::binned`](super::Volume::binned)) merges into one.
const MAX_FACTOR: usize = 16;

impl Volume {
    /// Returns the volume binned by `factors` along x, y and z: each voxel is the mean of the finite voxels of a block,
    /// in every frame. The numeric type is kept, so means are rounded for integers. Incomplete blocks at the far ends
    /// are dropped.
    ///
    /// Meant for images that were interpolated to pixels smaller than measured, as is common in magnetic resonance:
    /// fewer voxels hold the same information, and the windows of tracking, a fixed number of voxels wide, then cover a
    /// larger region.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] for a factor not in 1..=16 or larger than the number of voxels along its axis,
    /// and if no complete block has a finite voxel; [`VolumeError::TooLarge`].
    pub fn binned(&self, factors: [usize; 3]) -> Result<Volume, VolumeError> {
        let dims = self.dims();
        if (0..3).any(|axis| !(1..=MAX_FACTOR).contains(&factors[axis]) || factors[axis] > dims[axis]) {
            let problem = format!(
                "must be 1 to {MAX_FACTOR} and at most the number of voxels ({dims:?}) on each axis, got {factors:?}"
            );
            return Err(VolumeError::invalid("factors", problem));
        }
        if factors == [1; 3] {
            return Ok(self.clone());
        }
        let [nx, ny, nz] = [0, 1, 2].map(|axis| dims[axis] / factors[axis]);
        let mut values = reserve(nx * ny * nz * self.frames())?;
        for frame in 0..self.frames() {
            let start = self.frame_start(frame)?;
            for block in 0..nx * ny * nz {
                let first =
                    [block % nx * factors[0], block / nx % ny * factors[1], block / (nx * ny) * factors[2]];
                values.push(self.block_mean(start, first, factors));
            }
        }
        let ratio = DVec3::from(factors.map(|factor| factor as f64));
        let index_map =
            DAffine3 { matrix3: DMat3::from_diagonal(ratio), translation: (ratio - DVec3::ONE) * 0.5 };
        let volume = Volume::new(VolumeInit {
            voxels: self.voxels.like(&values)?,
            dims: [nx, ny, nz, self.frames()],
            affine: self.affine * index_map,
            slope: self.slope,
            intercept: self.intercept,
            frame_seconds: self.frame_seconds,
            space: self.space,
        })?;
        Ok(volume.derived(self, Derivation::Averaged))
    }

    /// Returns the mean of the finite stored values in one block of voxels, for binning: `size` voxels along each axis,
    /// from voxel `first` of the frame whose values begin at index `start`; NaN if no value is finite.
    fn block_mean(&self, start: usize, first: [usize; 3], size: [usize; 3]) -> f64 {
        let [nx, ny, _] = self.dims();
        let (mut sum, mut count) = (0.0, 0.0);
        for z in first[2]..first[2] + size[2] {
            for y in first[1]..first[1] + size[1] {
                for x in first[0]..first[0] + size[0] {
                    let value = self.voxels.get(start + (z * ny + y) * nx + x).unwrap_or(f64::NAN);
                    if value.is_finite() {
                        sum += value;
                        count += 1.0;
                    }
                }
            }
        }
        sum / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Space, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a volume whose intensity is x + 10 y + 100 z in world coordinates, doubled in the second frame.
    fn ramp() -> Volume {
        let affine = DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::new(1.0, 2.0, 5.0)),
            translation: DVec3::new(3.0, -4.0, 7.0),
        };
        let mut values = Vec::new();
        for frame in 1..=2 {
            for i in 0..7 * 6 * 4 {
                let at =
                    affine.transform_point3(DVec3::new((i % 7) as f64, (i / 7 % 6) as f64, (i / 42) as f64));
                values.push(((at.x + 10.0 * at.y + 100.0 * at.z) * f64::from(frame)) as f32);
            }
        }
        Volume::new(VolumeInit {
            affine,
            frame_seconds: 0.5,
            space: Space::Lps,
            ..VolumeInit::new(Voxels::F32(values), [7, 6, 4, 2])
        })
        .unwrap()
    }

    #[test]
    fn means_lie_in_the_middle_of_their_blocks() {
        let volume = ramp();
        let binned = volume.binned([2, 3, 1]).unwrap();
        assert_eq!((binned.dims(), binned.frames()), ([3, 2, 4], 2));
        assert_eq!(binned.spacing(), [2.0, 6.0, 5.0]);
        assert_eq!((binned.frame_seconds(), binned.space()), (0.5, Space::Lps));
        for frame in 0..2 {
            for index in [[0, 0, 0], [2, 1, 3], [1, 0, 2]] {
                let at = binned.affine().transform_point3(DVec3::from(index.map(f64::from)));
                let there = (at.x + 10.0 * at.y + 100.0 * at.z) * (frame + 1) as f64;
                assert!((binned.sample(at, frame).unwrap() - there).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn types_stay_and_what_is_no_number_is_left_out() {
        let init = |voxels, dims| VolumeInit {
            voxels,
            dims,
            affine: DAffine3::IDENTITY,
            slope: 2.0,
            intercept: 1.0,
            frame_seconds: 0.0,
            space: Space::Ras,
        };
        let whole = Volume::new(init(Voxels::U8(vec![1, 2, 4, 9]), [4, 1, 1, 1])).unwrap();
        let binned = whole.binned([2, 1, 1]).unwrap();
        assert!(matches!(binned.voxels(), Voxels::U8(_)));
        assert_eq!(binned.intensities(0).unwrap(), [5.0, 15.0]);
        let holes = Volume::new(init(Voxels::F32(vec![f32::NAN, 2.0, 4.0, 6.0]), [4, 1, 1, 1])).unwrap();
        assert_eq!(holes.binned([2, 1, 1]).unwrap().intensities(0).unwrap(), [5.0, 11.0]);
    }

    #[test]
    fn factors_out_of_range_are_refused() {
        let volume = ramp();
        for factors in [[0, 1, 1], [8, 1, 1], [1, 1, 17]] {
            let refused = volume.binned(factors).unwrap_err();
            assert!(refused.to_string().contains("1 to 16"), "{refused}");
        }
    }
}
