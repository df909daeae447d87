//! Changing the voxels of a volume in place.

use super::error::VolumeError;
use super::voxels::Voxels;
use super::{Region, Volume, scaled_range};
use std::sync::Arc;

impl Volume {
    /// Changes the voxels of one frame in a region to the stored values `data`, of the voxels' type, x fastest.
    ///
    /// Clones of the volume, and models that hold one, keep the voxels as they were: the voxels are copied once if they
    /// are shared. [`range`](Self::range) is updated.
    ///
    /// # Errors
    /// Changes nothing in these cases: [`VolumeError::InvalidArgument`] if the region is empty or not within the volume,
    /// `data` has another type or length, an intensity exceeds the range of `f32`, no voxel of the volume would be
    /// finite, or `frame` is out of range; [`VolumeError::TooLarge`] if there is no memory for the copy.
    pub fn write(&mut self, region: Region, data: &Voxels, frame: usize) -> Result<(), VolumeError> {
        let start = self.frame_start(frame)?;
        let dims = self.dims();
        region.check("region", dims)?;
        self.check_data(region, data)?;
        let rows = region.rows(dims, start);
        let old = self.voxels.gathered(region.len(), rows.clone())?;
        let new_range = self.range_after(&old, data)?;
        if Arc::get_mut(&mut self.voxels).is_none() {
            self.voxels = Arc::new(self.voxels.try_clone()?);
        }
        if let Some(voxels) = Arc::get_mut(&mut self.voxels) {
            voxels.overwrite(rows, data);
        }
        self.range = new_range;
        self.shrink_range(&old)
    }

    fn check_data(&self, region: Region, data: &Voxels) -> Result<(), VolumeError> {
        let (mine, given) = (self.voxels.type_name(), data.type_name());
        if mine != given {
            let problem = format!("must be {mine} as the voxels of the volume, got {given}");
            return Err(VolumeError::invalid("data", problem));
        }
        if data.len() == region.len() {
            return Ok(());
        }
        let problem =
            format!("must have {} voxels for dims {:?}, got {}", region.len(), region.dims, data.len());
        Err(VolumeError::invalid("data", problem))
    }

    /// Returns the range of intensities of the present voxels and `data` together, which replaces the voxels `old`; an
    /// error if `f32` cannot represent it, or if no voxel would remain finite.
    fn range_after(&self, old: &Voxels, data: &Voxels) -> Result<[f64; 2], VolumeError> {
        match data.finite_range() {
            Some(stored) => {
                let [low, high] = scaled_range(stored, self.slope, self.intercept)?;
                let [a, b] = self.range;
                Ok([if low < a { low } else { a }, if high > b { high } else { b }])
            }
            None if self.voxels.finite_count() > old.finite_count() => Ok(self.range),
            None => Err(VolumeError::invalid("data", "must leave at least one voxel of the volume finite")),
        }
    }

    /// Narrows [`Self::range`] to the present voxels after the voxels `old` were replaced. All voxels are read only if
    /// an end of the range was among `old` and is nowhere else.
    fn shrink_range(&mut self, old: &Voxels) -> Result<(), VolumeError> {
        let Some(ends) = old.finite_range() else { return Ok(()) };
        let is_lost = |stored: f64| {
            let intensity = stored * self.slope + self.intercept;
            self.range.contains(&intensity) && !self.voxels.contains(stored)
        };
        if ends.into_iter().any(is_lost)
            && let Some(stored) = self.voxels.finite_range()
        {
            self.range = scaled_range(stored, self.slope, self.intercept)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, Random};
    use crate::volume::{Space, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const DIMS: [usize; 3] = [5, 4, 3];

    fn volume(voxels: Voxels, slope: f64) -> Volume {
        Volume::new(VolumeInit {
            dims: [5, 4, 3, voxels.len() / 60],
            voxels,
            affine: DAffine3::IDENTITY,
            slope,
            intercept: 1.0,
            frame_seconds: 0.0,
            space: Space::Ras,
        })
        .unwrap()
    }

    fn random_region(random: &mut Random) -> Region {
        let min = DIMS.map(|n| random.below(n as u32) as usize);
        let dims = [0, 1, 2].map(|axis| 1 + random.below((DIMS[axis] - min[axis]) as u32) as usize);
        Region { min, dims }
    }

    /// Writes random regions and compares voxels and range with those of a volume made of all voxels anew.
    fn write_at_random(like: &Voxels, slope: f64, value: impl Fn(&mut Random) -> f64) {
        let mut random = Random::new(11);
        let mut values: Vec<f64> = (0..120).map(|_| value(&mut random)).collect();
        values[0] = 1.0;
        let mut v = volume(like.like(&values).unwrap(), slope);
        for _ in 0..300 {
            let (region, frame) = (random_region(&mut random), random.below(2) as usize);
            let data: Vec<f64> = (0..region.len()).map(|_| value(&mut random)).collect();
            let mut changed = values.clone();
            for (i, &new) in data.iter().enumerate() {
                let [nx, ny, _] = region.dims;
                let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
                changed[x + region.min[0] + 5 * (y + region.min[1] + 4 * (z + region.min[2])) + 60 * frame] =
                    new;
            }
            let anew = VolumeInit { ..v.init_with(like.like(&changed).unwrap()) };
            match Volume::new(anew) {
                Ok(anew) => {
                    v.write(region, &like.like(&data).unwrap(), frame).unwrap();
                    assert_eq!(v.range(), anew.range());
                    assert_eq!(format!("{:?}", v.voxels()), format!("{:?}", anew.voxels()));
                    values = changed;
                }
                Err(error) => assert_eq!(
                    v.write(region, &like.like(&data).unwrap(), frame).unwrap_err().to_string()[..5],
                    error.to_string()[..5]
                ),
            }
        }
    }

    #[test]
    fn random_regions_of_every_type() {
        let bytes = |random: &mut Random| f64::from(random.below(6));
        let wide = |random: &mut Random| f64::from(random.next_u32()) - 2e9;
        let holes = |random: &mut Random| match random.below(8) {
            0 => f64::INFINITY,
            1..6 => f64::NAN,
            _ => f64::from(random.below(5)),
        };
        for (like, slope) in [
            (Voxels::U8(Vec::new()), 1.0),
            (Voxels::I8(Vec::new()), -2.0),
            (Voxels::U16(Vec::new()), 1.0),
            (Voxels::I16(Vec::new()), 0.1),
        ] {
            write_at_random(&like, slope, bytes);
        }
        write_at_random(&Voxels::U32(Vec::new()), 1.0, wide);
        write_at_random(&Voxels::I32(Vec::new()), -1.0, wide);
        write_at_random(&Voxels::F32(Vec::new()), 1.0, holes);
        write_at_random(&Voxels::F64(Vec::new()), -3.0, holes);
    }

    #[test]
    fn clones_keep_their_voxels_and_the_voxels_of_one_owner_stay_in_place() {
        let mut v = volume(Voxels::U8(vec![7; 60]), 1.0);
        let before = v.clone();
        let region = Region { min: [1, 1, 1], dims: [2, 1, 1] };
        v.write(region, &Voxels::U8(vec![1, 9]), 0).unwrap();
        assert_eq!(before.voxels(), &Voxels::U8(vec![7; 60]));
        assert_eq!((before.range(), v.range()), ([8.0, 8.0], [2.0, 10.0]));
        let address = |volume: &Volume| match volume.voxels() {
            Voxels::U8(values) => values.as_ptr(),
            _ => std::ptr::null(),
        };
        let here = address(&v);
        v.write(region, &Voxels::U8(vec![7, 7]), 0).unwrap();
        assert_eq!((address(&v), v.range(), v.voxels()), (here, [8.0, 8.0], before.voxels()));
    }

    #[test]
    fn what_is_refused_changes_nothing() {
        let all = Region { min: [0; 3], dims: DIMS };
        let one = Region { min: [4, 3, 2], dims: [1; 3] };
        let mut v = volume(Voxels::F64((0..60).map(f64::from).collect()), 1.0);
        let before = v.clone();
        let floats = |values: &[f64]| Voxels::F64(values.to_vec());
        for (region, data, frame, message) in [
            (Region { min: [4, 0, 0], dims: [2, 1, 1] }, floats(&[1.0; 2]), 0, "region: must have"),
            (Region { min: [0; 3], dims: [0, 1, 1] }, floats(&[]), 0, "region: must have"),
            (one, Voxels::F32(vec![1.0]), 0, "data: must be 64-bit floats"),
            (one, floats(&[1.0; 2]), 0, "data: must have 1 voxels"),
            (one, floats(&[1e300]), 0, "data: intensities"),
            (all, floats(&[f64::NAN; 60]), 0, "data: must leave"),
            (one, floats(&[1.0]), 1, "frame: 1 is out of range"),
        ] {
            let refused = v.write(region, &data, frame).unwrap_err().to_string();
            assert!(refused.starts_with(message), "{refused}");
            assert_eq!((v.voxels(), v.range()), (before.voxels(), before.range()));
        }
        v.write(one, &floats(&[f64::NAN]), 0).unwrap();
        assert_eq!(v.range(), [1.0, 59.0]);
    }
}
