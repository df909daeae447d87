//! Overlap of two masks or labels.

use super::Volume;
use super::error::VolumeError;
use super::same_grid::grid_difference;
use super::voxels::{Voxels, each};

/// Number of voxels that are compared at a time: few enough to stay in the cache, enough to choose their type seldom.
const CHUNK: usize = 4096;

impl Volume {
    /// Returns the Dice coefficient of two volumes, 2 |A ∩ B| / (|A| + |B|), over all frames: of the voxels with the
    /// intensity `label`, or, without it, of the voxels whose intensity is neither 0 nor NaN. It is 1 if both have no
    /// such voxel.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if the volumes differ in dimensions, number of frames or space, or in position
    /// by more than a thousandth of a voxel; if `label` is 0 or not an integer, or is given for volumes of floats.
    pub fn dice(&self, other: &Volume, label: Option<f64>) -> Result<f64, VolumeError> {
        self.check_comparable(other)?;
        if let Some(label) = label {
            if label == 0.0 || label != libm::trunc(label) {
                let problem = format!("must be an integer other than 0 (the background), got {label}");
                return Err(VolumeError::invalid("label", problem));
            }
            self.check_integers()?;
            other.check_integers()?;
        }
        let (mut both, mut sum) = (0, 0);
        let mut inside = [[false; CHUNK]; 2];
        for start in (0..self.voxels.len()).step_by(CHUNK) {
            let [a, b] = &mut inside;
            let count = self.mark(start, label, a);
            other.mark(start, label, b);
            for (&a, &b) in a.iter().zip(b.iter()).take(count) {
                both += usize::from(a && b);
                sum += usize::from(a) + usize::from(b);
            }
        }
        Ok(if sum > 0 { 2.0 * both as f64 / sum as f64 } else { 1.0 })
    }

    fn check_comparable(&self, other: &Volume) -> Result<(), VolumeError> {
        let frames = (self.frames() != other.frames()).then_some("number of frames");
        let Some(what) = grid_difference(self, other).or(frames) else { return Ok(()) };
        let problem = format!("must have the grid of the volume it is compared with, differs in {what}");
        Err(VolumeError::invalid("other", problem))
    }

    /// Sets, for the voxels from index `start` on, whether they are compared by [`Self::dice`], and returns for how many.
    fn mark(&self, start: usize, label: Option<f64>, inside: &mut [bool]) -> usize {
        each!(self.voxels.as_ref(), values => {
            let rest = values.iter().skip(start).zip(inside);
            rest.map(|(&v, inside)| *inside = self.is_compared(v, label)).count()
        })
    }

    fn is_compared<T: Into<f64>>(&self, stored: T, label: Option<f64>) -> bool {
        let intensity = stored.into() * self.slope + self.intercept;
        label.map_or(intensity != 0.0 && !intensity.is_nan(), |label| intensity == label)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DVec3, Random};
    use crate::volume::{LengthUnit, Space, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn init(voxels: Voxels) -> VolumeInit {
        VolumeInit {
            dims: [voxels.len(), 1, 1, 1],
            voxels,
            affine: DAffine3::from_scale(DVec3::splat(0.01)),
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: 0.0,
            space: Space::Ras,
        }
    }

    fn volume(voxels: Voxels) -> Volume {
        Volume::new(init(voxels)).unwrap()
    }

    #[test]
    fn the_overlap_of_masks_and_labels_of_any_type() {
        let a = volume(Voxels::U8(vec![0, 1, 1, 2, 0, 2]));
        let b = volume(Voxels::I32(vec![0, 1, 2, 2, 2, 0])).with_unit(LengthUnit::Metre);
        assert_eq!(a.dice(&b, None), Ok(2.0 * 3.0 / 8.0));
        assert_eq!(a.dice(&b, Some(1.0)), Ok(2.0 * 1.0 / 3.0));
        assert_eq!(b.dice(&a, Some(2.0)), Ok(2.0 * 1.0 / 5.0));
        assert_eq!(a.dice(&a, Some(2.0)), Ok(1.0));
        assert_eq!(a.dice(&b, Some(7.0)), Ok(1.0), "both are empty");
        let floats = volume(Voxels::F32(vec![0.0, 0.5, f32::NAN, 1.0, f32::INFINITY, 0.0]));
        assert_eq!(a.dice(&floats, None), Ok(2.0 * 2.0 / 7.0));
    }

    #[test]
    fn large_volumes_agree_with_brute_force() {
        let mut random = Random::new(9);
        let mut labels = || (0..10_000).map(|_| random.below(4) as u16).collect::<Vec<_>>();
        let (a, b) = (labels(), labels());
        let count =
            |f: &dyn Fn(u16, u16) -> bool| a.iter().zip(&b).filter(|&(&a, &b)| f(a, b)).count() as f64;
        let [a_, b_] = [&a, &b].map(|values| volume(Voxels::U16(values.clone())));
        let expected = 2.0 * count(&|a, b| a > 0 && b > 0) / (count(&|a, _| a > 0) + count(&|_, b| b > 0));
        assert_eq!(a_.dice(&b_, None), Ok(expected));
        let expected =
            2.0 * count(&|a, b| a == 3 && b == 3) / (count(&|a, _| a == 3) + count(&|_, b| b == 3));
        assert_eq!(a_.dice(&b_, Some(3.0)), Ok(expected));
    }

    #[test]
    fn intensities_are_compared() {
        let shifted = VolumeInit { slope: 2.0, intercept: -2.0, ..init(Voxels::U8(vec![1, 2, 3])) };
        let shifted = Volume::new(shifted).unwrap();
        let plain = volume(Voxels::I16(vec![0, 2, 2]));
        assert_eq!(shifted.dice(&plain, None), Ok(1.0));
        assert_eq!(shifted.dice(&plain, Some(2.0)), Ok(2.0 / 3.0));
    }

    #[test]
    fn other_grids_and_labels_are_refused() {
        let a = volume(Voxels::U8(vec![1, 0]));
        let moved = |by: f64| DAffine3::from_translation(DVec3::Y * by) * a.affine();
        let other = |init: VolumeInit| a.dice(&Volume::new(init).unwrap(), None);
        let base = || init(Voxels::U8(vec![1, 0]));
        for (init, what) in [
            (VolumeInit { affine: moved(1e-3), ..base() }, "position"),
            (VolumeInit { space: Space::Lps, ..base() }, "space"),
            (VolumeInit { dims: [1, 2, 1, 1], ..base() }, "dimensions"),
            (VolumeInit { dims: [2, 1, 1, 2], ..init(Voxels::U8(vec![1; 4])) }, "number of frames"),
        ] {
            let refused = other(init).unwrap_err().to_string();
            assert!(refused.starts_with("other: ") && refused.ends_with(what), "{refused}");
        }
        assert_eq!(other(VolumeInit { affine: moved(9e-6), ..base() }), Ok(1.0));
        for label in [0.0, 0.5, f64::NAN] {
            assert!(
                a.dice(&a, Some(label)).unwrap_err().to_string().starts_with("label: must be an integer")
            );
        }
        let floats = volume(Voxels::F64(vec![1.0, 0.0]));
        assert!(a.dice(&floats, Some(1.0)).unwrap_err().to_string().contains("64-bit floats"));
    }
}
