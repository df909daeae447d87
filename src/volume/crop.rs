//! Parts of a volume: a box of its voxels, or one of its frames.

use super::derived::Derivation;
use super::error::VolumeError;
use super::{Region, Volume, VolumeInit};
use crate::math::{DAffine3, DVec3};

impl Volume {
    /// Returns the voxels of a box, in all frames: those with indices from `min` (included) to `max` (excluded) along
    /// each axis. Their positions in world space and their type stay.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if the box is empty, is not within the volume, or has no finite voxel;
    /// [`VolumeError::TooLarge`].
    pub fn crop(&self, min: [usize; 3], max: [usize; 3]) -> Result<Volume, VolumeError> {
        let dims = self.dims();
        if (0..3).any(|axis| min[axis] >= max[axis] || max[axis] > dims[axis]) {
            let problem =
                format!("must have 0 <= min < max <= {dims:?} along each axis, got {min:?} to {max:?}");
            return Err(VolumeError::invalid("box", problem));
        }
        let region = Region { min, dims: [0, 1, 2].map(|axis| max[axis] - min[axis]) };
        let rows = (0..self.frames()).flat_map(|frame| region.rows(dims, frame * self.frame_len()));
        let voxels = self.voxels.gathered(region.len() * self.frames(), rows)?;
        let first = DAffine3::from_translation(DVec3::from(min.map(|i| i as f64)));
        let [nx, ny, nz] = region.dims;
        let init = VolumeInit {
            dims: [nx, ny, nz, self.frames()],
            affine: self.affine * first,
            ..self.init_with(voxels)
        };
        self.part("box", init, Derivation::Box(region))
    }

    /// Returns one frame as a 3D volume, without a time between frames.
    ///
    /// # Errors
    /// [`VolumeError::InvalidArgument`] if there is no such frame, or it has no finite voxel;
    /// [`VolumeError::TooLarge`].
    pub fn frame(&self, index: usize) -> Result<Volume, VolumeError> {
        let start = self.frame_start(index)?;
        let voxels =
            self.voxels.gathered(self.frame_len(), std::iter::once(start..start + self.frame_len()))?;
        let [nx, ny, nz] = self.dims();
        let init = VolumeInit { dims: [nx, ny, nz, 1], frame_seconds: 0.0, ..self.init_with(voxels) };
        self.part("frame", init, Derivation::Frame(index))
    }

    /// Creates a volume of some voxels of this one, which `parameter` selects.
    fn part(
        &self,
        parameter: &'static str,
        init: VolumeInit,
        how: Derivation,
    ) -> Result<Volume, VolumeError> {
        if init.voxels.finite_range().is_none() {
            return Err(VolumeError::invalid(parameter, "must have at least one finite voxel"));
        }
        Ok(Volume::new(init)?.derived(self, how))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DMat3;
    use crate::volume::{LengthUnit, Space, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a volume of 5 × 4 × 3 voxels in 2 frames, each with its index as stored value.
    fn counted() -> Volume {
        let axes = DMat3::from_cols(
            DVec3::new(0.8, 0.6, 0.1),
            DVec3::new(-0.9, 1.2, 0.0),
            DVec3::new(0.0, 0.3, 2.5),
        );
        let init = VolumeInit {
            voxels: Voxels::I16((0..120).collect()),
            dims: [5, 4, 3, 2],
            affine: DAffine3::from_mat3_translation(axes, DVec3::new(-20.0, 5.0, 7.0)),
            slope: 0.5,
            intercept: 2.0,
            frame_seconds: 0.25,
            space: Space::Lps,
        };
        Volume::new(init).unwrap().with_unit(LengthUnit::Micrometre)
    }

    #[test]
    fn voxels_of_a_box_keep_their_values_and_positions() {
        let v = counted();
        let (min, max) = ([1, 2, 0], [4, 4, 3]);
        let cropped = v.crop(min, max).unwrap();
        assert_eq!((cropped.dims(), cropped.frames()), ([3, 2, 3], 2));
        assert_eq!((cropped.slope(), cropped.intercept(), cropped.frame_seconds()), (0.5, 2.0, 0.25));
        assert_eq!((cropped.space(), cropped.unit()), (Space::Lps, LengthUnit::Micrometre));
        for i in 0..36 {
            let at = [i % 3, i / 3 % 2, i / 6 % 3];
            let from = [0, 1, 2].map(|axis| at[axis] + min[axis]);
            let index = from[0] + 5 * (from[1] + 4 * from[2]) + 60 * (i / 18);
            assert_eq!(cropped.voxels().get(i), v.voxels().get(index));
            let [here, there] = [(&cropped, at), (&v, from)]
                .map(|(volume, p)| volume.affine().transform_point3(DVec3::from(p.map(|k| k as f64))));
            assert!(here.distance(there) < 1e-12);
        }
        assert_eq!(v.crop([0; 3], v.dims()).unwrap().voxels(), v.voxels());
    }

    #[test]
    fn one_frame_is_3d() {
        let second = counted().frame(1).unwrap();
        assert_eq!(second.voxels(), &Voxels::I16((60..120).collect()));
        assert_eq!((second.dims(), second.frames(), second.frame_seconds()), ([5, 4, 3], 1, 0.0));
        assert_eq!((second.range(), second.unit()), ([32.0, 61.5], LengthUnit::Micrometre));
    }

    #[test]
    fn parts_that_are_not_there_are_named() {
        let v = counted();
        for (min, max) in [
            ([0, 0, 0], [5, 4, 4]),
            ([2, 0, 0], [2, 4, 3]),
            ([3, 0, 0], [2, 4, 3]),
            ([usize::MAX, 0, 0], [usize::MAX, 1, 1]),
        ] {
            let refused = v.crop(min, max).unwrap_err().to_string();
            assert!(refused.starts_with("box: must have 0 <= min < max <= [5, 4, 3]"), "{refused}");
        }
        assert!(v.frame(2).unwrap_err().to_string().starts_with("frame: 2 is out of range"));
        let voxels = Voxels::F32(vec![f32::NAN, 1.0]);
        let holes = Volume::new(VolumeInit { dims: [1, 1, 1, 2], ..v.init_with(voxels.clone()) }).unwrap();
        assert!(holes.frame(0).unwrap_err().to_string().starts_with("frame: must have"));
        let holes = Volume::new(VolumeInit { dims: [2, 1, 1, 1], ..v.init_with(voxels) }).unwrap();
        assert!(holes.crop([0; 3], [1; 3]).unwrap_err().to_string().starts_with("box: must have"));
    }
}
