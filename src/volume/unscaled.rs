//! Intensities as voxels, for formats that store no slope and intercept.

use super::Volume;
use super::error::{VolumeError, reserve};
use super::voxels::{Voxels, each};
use std::borrow::Cow;

impl Volume {
    /// Returns the number of bytes of the voxels that formats without slope and intercept store in place of those of the
    /// volume; 0 if they store the same.
    pub fn unscaled_bytes(&self) -> u64 {
        let bytes = match self.voxels.as_ref() {
            _ if self.slope == 1.0 && self.intercept == 0.0 => 0,
            Voxels::U32(_) | Voxels::I32(_) | Voxels::F64(_) => size_of::<f64>(),
            _ => size_of::<f32>(),
        };
        (bytes as u64).saturating_mul(self.voxels.len() as u64)
    }

    /// Returns voxels whose stored values are the intensities of this volume, in all frames: its own if the slope is 1
    /// and the intercept 0, else floats, of 64 bits in place of 32-bit integers and 64-bit floats, of 32 bits in place
    /// of the others. NaN and infinite voxels are kept.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) fn unscaled(&self) -> Result<Cow<'_, Voxels>, VolumeError> {
        if self.slope == 1.0 && self.intercept == 0.0 {
            return Ok(Cow::Borrowed(&self.voxels));
        }
        let scaled = |v: f64| v * self.slope + self.intercept;
        Ok(Cow::Owned(match self.voxels.as_ref() {
            Voxels::U32(values) => Voxels::F64(mapped(values, scaled)?),
            Voxels::I32(values) => Voxels::F64(mapped(values, scaled)?),
            Voxels::F64(values) => Voxels::F64(mapped(values, scaled)?),
            others => Voxels::F32(each!(others, values => mapped(values, |v| scaled(v) as f32))?),
        }))
    }
}

fn mapped<T: Copy + Into<f64>, U>(values: &[T], map: impl Fn(f64) -> U) -> Result<Vec<U>, VolumeError> {
    let mut out = reserve(values.len())?;
    out.extend(values.iter().map(|&v| map(v.into())));
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::volume::{Space, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn unscaled(voxels: Voxels, slope: f64, intercept: f64) -> Voxels {
        let init = VolumeInit {
            dims: [voxels.len(), 1, 1, 1],
            voxels,
            affine: DAffine3::IDENTITY,
            slope,
            intercept,
            frame_seconds: 0.0,
            space: Space::Ras,
        };
        Volume::new(init).unwrap().unscaled().unwrap().into_owned()
    }

    #[test]
    fn intensities_have_a_float_type_that_holds_them() {
        assert_eq!(unscaled(Voxels::U8(vec![1, 2]), 1.0, 0.0), Voxels::U8(vec![1, 2]));
        assert_eq!(unscaled(Voxels::I16(vec![-1, 2]), 0.5, 3.0), Voxels::F32(vec![2.5, 4.0]));
        assert_eq!(
            unscaled(Voxels::F32(vec![1.0, f32::INFINITY]), -1.0, 0.0),
            Voxels::F32(vec![-1.0, f32::NEG_INFINITY])
        );
        let large = unscaled(Voxels::U32(vec![0, u32::MAX]), 1.0, 1.0);
        assert_eq!(large, Voxels::F64(vec![1.0, 4_294_967_296.0]));
        assert_eq!(unscaled(Voxels::I32(vec![i32::MIN]), 1.0, 0.5), Voxels::F64(vec![-2_147_483_647.5]));
        assert!(matches!(unscaled(Voxels::F64(vec![0.1]), 1.0, 1e-9), Voxels::F64(v) if v[0] == 0.1 + 1e-9));
    }
}
