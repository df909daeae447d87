//! Concatenation of 3D volumes into a 4D volume.

use super::error::VolumeError;
use super::same_grid::grid_difference;
use super::voxels::Voxels;
use super::{Volume, VolumeInit};

impl Volume {
    /// Concatenates volumes on one grid, in order, into the frames of a 4D volume. A 4D volume contributes all its
    /// frames.
    ///
    /// If `frame_seconds`, the time between frames, is `None`, that of the first volume is used. The affine is that of
    /// the first volume.
    ///
    /// # Errors
    /// No volumes; a volume whose dimensions, space or unit differ from those of the first, or its position by more
    /// than a thousandth of a voxel; a `frame_seconds` that is negative or not finite; [`VolumeError::TooLarge`].
    pub fn from_frames(frames: &[Volume], frame_seconds: Option<f64>) -> Result<Volume, VolumeError> {
        let Some(first) = frames.first() else {
            return Err(VolumeError::invalid("frames", "must contain at least one volume"));
        };
        for (index, frame) in frames.iter().enumerate() {
            check_same_grid(first, frame, index)?;
        }
        let [nx, ny, nz] = first.dims();
        let count = frames.iter().map(Volume::frames).sum();
        let (voxels, slope, intercept) = join(frames)?;
        let volume = Volume::new(VolumeInit {
            voxels,
            dims: [nx, ny, nz, count],
            affine: first.affine,
            slope,
            intercept,
            frame_seconds: frame_seconds.unwrap_or(first.frame_seconds),
            space: first.space,
        })?;
        Ok(volume.with_unit(first.unit).with_warnings_of(frames))
    }
}

/// Returns the stored values of all frames of the volumes, and their common slope and intercept; if the volumes differ
/// in these or in their numeric type, the intensities as `f32`, slope 1 and intercept 0.
fn join(frames: &[Volume]) -> Result<(Voxels, f64, f64), VolumeError> {
    let (slope, intercept) = (frames[0].slope, frames[0].intercept);
    if frames.iter().all(|f| f.slope == slope && f.intercept == intercept) {
        let parts: Vec<&Voxels> = frames.iter().map(|f| f.voxels.as_ref()).collect();
        if let Some(voxels) = Voxels::concatenate(&parts)? {
            return Ok((voxels, slope, intercept));
        }
    }
    let mut all = Vec::new();
    for frame in frames {
        for t in 0..frame.frames() {
            all.push(Voxels::F32(frame.intensities(t)?));
        }
    }
    let parts: Vec<&Voxels> = all.iter().collect();
    let voxels = Voxels::concatenate(&parts)?.unwrap_or(Voxels::F32(Vec::new()));
    Ok((voxels, 1.0, 0.0))
}

fn check_same_grid(first: &Volume, frame: &Volume, index: usize) -> Result<(), VolumeError> {
    let differs = |what: &str| {
        let problem = format!("frame {index} differs from frame 0 in {what}; all frames must share one grid");
        Err(VolumeError::invalid("frames", problem))
    };
    if frame.unit != first.unit {
        return differs("unit");
    }
    grid_difference(first, frame).map_or(Ok(()), differs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DVec3};
    use crate::volume::{LengthUnit, Space};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn still(values: Voxels, slope: f64, shift: f64) -> Volume {
        Volume::new(VolumeInit {
            voxels: values,
            dims: [2, 1, 1, 1],
            affine: DAffine3::from_translation(DVec3::X * shift),
            slope,
            intercept: 0.0,
            frame_seconds: 0.0,
            space: Space::Lps,
        })
        .unwrap()
    }

    #[test]
    fn frames_of_one_type_stay_as_stored() {
        let frames = [still(Voxels::U8(vec![1, 2]), 3.0, 0.0), still(Voxels::U8(vec![3, 4]), 3.0, 1e-5)];
        let all = Volume::from_frames(&frames, Some(0.05)).unwrap();
        assert_eq!(
            (all.dims(), all.frames(), all.frame_seconds(), all.space()),
            ([2, 1, 1], 2, 0.05, Space::Lps)
        );
        assert_eq!(all.voxels(), &Voxels::U8(vec![1, 2, 3, 4]));
        assert_eq!(all.intensities(1).unwrap(), [9.0, 12.0]);
        let longer = Volume::from_frames(&[all.clone(), all], None).unwrap();
        assert_eq!((longer.frames(), longer.frame_seconds()), (4, 0.05));
    }

    #[test]
    fn frames_of_several_types_or_slopes_become_intensities() {
        let one = still(Voxels::U8(vec![1, 2]), 1.0, 0.0);
        for other in [still(Voxels::I16(vec![-7, 300]), 1.0, 0.0), still(Voxels::U8(vec![3, 4]), 0.5, 0.0)] {
            let all = Volume::from_frames(&[one.clone(), other.clone()], None).unwrap();
            assert_eq!(all.intensities(0).unwrap(), [1.0, 2.0]);
            assert_eq!(all.intensities(1).unwrap(), other.intensities(0).unwrap());
        }
    }

    #[test]
    fn frames_that_do_not_match_are_refused() {
        let one = still(Voxels::U8(vec![1, 2]), 1.0, 0.0);
        assert!(Volume::from_frames(&[], None).is_err());
        assert!(Volume::from_frames(&[one.clone(), still(Voxels::U8(vec![1, 2]), 1.0, 0.5)], None).is_err());
        assert!(Volume::from_frames(&[one.clone(), one.clone().with_unit(LengthUnit::Metre)], None).is_err());
        assert!(Volume::from_frames(&[one], Some(f64::NAN)).is_err());
    }
}
