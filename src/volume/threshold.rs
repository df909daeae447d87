//! Masks of the voxels within a range of intensities.

use super::Volume;
use super::error::{VolumeError, reserve};

impl Volume {
    /// Returns the mask of the voxels whose intensity is from `low` to `high`, both included: 1 there, 0 elsewhere, in
    /// all frames. Either bound may be infinite. Voxels that are NaN are 0; infinite ones are compared as they are.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if a bound is NaN or `low` > `high`; [`VolumeError::TooLarge`].
    pub fn threshold(&self, low: f64, high: f64) -> Result<Volume, VolumeError> {
        for (parameter, bound) in [("low", low), ("high", high)] {
            if bound.is_nan() {
                return Err(VolumeError::invalid(
                    parameter,
                    "must be a number, which may be infinite, got NaN",
                ));
            }
        }
        if low > high {
            return Err(VolumeError::invalid("low", format!("must be <= high ({high}), got {low}")));
        }
        let mask = self.within(low, high)?;
        self.mask(mask)
    }

    fn within(&self, low: f64, high: f64) -> Result<Vec<u8>, VolumeError> {
        let mut mask = reserve(self.voxels.len())?;
        self.voxels.for_each_part(0..self.voxels.len(), |part| {
            mask.extend(part.iter().map(|v| {
                let intensity = v * self.slope + self.intercept;
                u8::from(low <= intensity && intensity <= high)
            }));
        });
        Ok(mask)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DVec3};
    use crate::volume::{LengthUnit, Space, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const LOWEST: f64 = f64::NEG_INFINITY;
    const HIGHEST: f64 = f64::INFINITY;

    fn volume(voxels: Voxels, slope: f64, intercept: f64) -> Volume {
        let init = VolumeInit {
            dims: [voxels.len() / 2, 1, 1, 2],
            voxels,
            affine: DAffine3::from_translation(DVec3::Y),
            slope,
            intercept,
            frame_seconds: 0.25,
            space: Space::Lps,
        };
        Volume::new(init).unwrap().with_unit(LengthUnit::Metre)
    }

    #[test]
    fn both_bounds_are_included_in_all_frames() {
        let v = volume(Voxels::I16(vec![-5, 0, 3, 4, 7, 8]), 2.0, -1.0);
        let mask = v.threshold(5.0, 13.0).unwrap();
        assert_eq!(mask.voxels(), &Voxels::U8(vec![0, 0, 1, 1, 1, 0]));
        assert_eq!((mask.slope(), mask.intercept(), mask.range()), (1.0, 0.0, [0.0, 1.0]));
        assert_eq!((mask.dims(), mask.frames(), mask.affine()), (v.dims(), 2, v.affine()));
        assert_eq!((mask.frame_seconds(), mask.space(), mask.unit()), (0.25, Space::Lps, LengthUnit::Metre));
        assert_eq!(v.threshold(LOWEST, -1.0).unwrap().voxels(), &Voxels::U8(vec![1, 1, 0, 0, 0, 0]));
        assert_eq!(v.threshold(7.0, 7.0).unwrap().voxels(), &Voxels::U8(vec![0, 0, 0, 1, 0, 0]));
    }

    #[test]
    fn nan_is_outside_and_infinite_voxels_are_compared() {
        let v = volume(Voxels::F32(vec![f32::NAN, 1.0, f32::INFINITY, f32::NEG_INFINITY]), 1.0, 0.0);
        for (low, high, expected) in [
            (LOWEST, HIGHEST, [0, 1, 1, 1]),
            (1.0, HIGHEST, [0, 1, 1, 0]),
            (0.0, 1.0, [0, 1, 0, 0]),
            (HIGHEST, HIGHEST, [0, 0, 1, 0]),
        ] {
            assert_eq!(
                v.threshold(low, high).unwrap().voxels(),
                &Voxels::U8(expected.to_vec()),
                "{low} to {high}"
            );
        }
    }

    #[test]
    fn bounds_that_are_no_range_are_refused() {
        let v = volume(Voxels::U8(vec![1, 2]), 1.0, 0.0);
        for (low, high, named) in [(f64::NAN, 1.0, "low"), (0.0, f64::NAN, "high"), (2.0, 1.0, "low")] {
            let refused = v.threshold(low, high).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("{named}: must be")), "{refused}");
        }
    }
}
