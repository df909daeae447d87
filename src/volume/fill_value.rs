//! Fill values: numbers for "no value" where a file's type has no NaN, such as −32768 around an image of 0 to 255.

use super::Volume;
use super::derived::Derivation;
use super::error::{VolumeError, reserve};
use super::voxels::{VoxelNumber, Voxels};
use crate::pauses::Pauses;

/// How far below all others the least intensity is a fill value, in ranges of the others. From air to the darkest tissue is
/// one range at most; from −32768 to an image of 12 bits are seven.
const FAR_BELOW: f64 = 4.0;

/// Number of other intensities that an image has at least. In a computed one, of walls along the voxels and without noise, all
/// voxels but those of the background may be bright.
const VALUES: usize = 16;

/// How far above all others the largest intensity is a fill value: a bright object without noise may be a hundred times as
/// bright as the noise around it.
const FAR_ABOVE: f64 = 4096.0;

/// Largest number of fill values that are removed.
const MOST: usize = 4;

/// Number of voxels that are read between pauses.
const SLICE: usize = 1 << 16;

impl Volume {
    /// Returns the volume with NaN for the fill values, in floating point; as it is if it has none.
    ///
    /// # Errors
    /// [`VolumeError::TooLarge`].
    pub(crate) async fn without_fill_values(self, pauses: &Pauses) -> Result<Self, VolumeError> {
        let mut volume = self;
        for _ in 0..MOST {
            let Some(fill) = volume.fill_value(pauses).await else { break };
            volume = volume.without(fill, pauses).await?;
        }
        Ok(volume)
    }

    /// Returns the least or the largest intensity if it is far from all others.
    async fn fill_value(&self, pauses: &Pauses) -> Option<f64> {
        let [low, high] = self.range;
        let (mut next, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut values = Vec::with_capacity(VALUES);
        for start in (0..self.voxels.len()).step_by(SLICE) {
            self.voxels.for_each_part(start..self.voxels.len().min(start + SLICE), |part| {
                for value in part.iter().map(|stored| stored * self.slope + self.intercept) {
                    // Comparisons with NaN are false.
                    if value > low && value < next {
                        next = value;
                    }
                    if value < high && value > last {
                        last = value;
                    }
                    if values.len() < VALUES && value > low && value < high && !values.contains(&value) {
                        values.push(value);
                    }
                }
            });
            pauses.now().await;
        }
        if values.len() < VALUES {
            return None;
        }
        let is_far_below = next < high && next - low > FAR_BELOW * (high - next);
        let is_far_above = last > low && high - last > FAR_ABOVE * (last - low);
        if is_far_below { Some(low) } else { is_far_above.then_some(high) }
    }

    /// Returns the volume with NaN for the voxels of an intensity.
    async fn without(&self, fill: f64, pauses: &Pauses) -> Result<Self, VolumeError> {
        let kept = |stored: f64| if stored * self.slope + self.intercept == fill { f64::NAN } else { stored };
        let fits_single = self.voxels.number_size() <= 2 || matches!(*self.voxels, Voxels::F32(_));
        let voxels = if fits_single {
            Voxels::F32(self.mapped(kept, pauses).await?)
        } else {
            Voxels::F64(self.mapped(kept, pauses).await?)
        };
        Ok(Volume::new(self.init_with(voxels))?.derived(self, Derivation::Same))
    }

    async fn mapped<T: VoxelNumber>(
        &self,
        map: impl Fn(f64) -> f64,
        pauses: &Pauses,
    ) -> Result<Vec<T>, VolumeError> {
        let count = self.voxels.len();
        let mut values = reserve(count)?;
        for start in (0..count).step_by(SLICE) {
            self.voxels.for_each_part(start..count.min(start + SLICE), |part| {
                values.extend(part.iter().map(|&stored| T::nearest(map(stored))));
            });
            pauses.now().await;
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pauses::finished;
    use crate::volume::VolumeInit;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the intensities of a volume without its fill values, and the range of those left.
    fn left(voxels: Voxels) -> (Vec<f32>, [f64; 2]) {
        let dims = [voxels.len(), 1, 1, 1];
        let volume =
            Volume::new(VolumeInit { slope: 2.0, intercept: 1.0, ..VolumeInit::new(voxels, dims) }).unwrap();
        let volume = finished(volume.without_fill_values(&Pauses::default())).unwrap();
        (volume.intensities(0).unwrap(), volume.range())
    }

    #[test]
    fn values_far_from_all_others_become_nan() {
        let image = |first: f64| -> Vec<f64> { [first].into_iter().chain((0..30).map(f64::from)).collect() };
        let fills = [
            Voxels::I16(image(-32768.0).iter().map(|&v| v as i16).collect()),
            Voxels::F32(image(-1.0e38).iter().map(|&v| v as f32).collect()),
            Voxels::F64(image(1.0e30)),
            Voxels::I32(image(-2.0e9).iter().map(|&v| v as i32).collect()),
        ];
        let others: Vec<f32> = (0..30).map(|v| 2.0 * v as f32 + 1.0).collect();
        for voxels in fills {
            let name = format!("{voxels:?}");
            let (values, range) = left(voxels);
            assert!(values[0].is_nan() && values[1..] == others, "{name} {values:?}");
            assert_eq!(range, [1.0, 59.0], "{name}");
        }
        let both = [1.0e20, -32768.0].into_iter().chain((0..30).map(|v| v as f32 / 10.0)).collect();
        let (values, range) = left(Voxels::F32(both));
        assert!(values[0].is_nan() && values[1].is_nan(), "{values:?}");
        assert!((range[1] - 6.8).abs() < 1e-6, "{range:?}");
    }

    #[test]
    fn other_volumes_stay_as_they_are() {
        // Air below tissue, a bright object in weak noise, masks, few values, one.
        let tissue = |v: i16| if v == 0 { -1000 } else { 30 * v - 100 };
        let images: [Vec<i16>; 5] = [
            (0..40).map(tissue).collect(),
            (0..40).map(|v| if v == 0 { 9000 } else { v % 20 }).collect(),
            vec![0, 1, 0, 1],
            vec![0, 80, 90, 100],
            vec![7, 7],
        ];
        for values in images {
            let (found, _) = left(Voxels::I16(values.clone()));
            assert_eq!(found, values.iter().map(|&v| f32::from(v) * 2.0 + 1.0).collect::<Vec<_>>());
        }
    }
}
