//! Slices and histograms of a volume.

use super::Volume;
use super::error::{VolumeError, reserve};
use std::ops::Range;

/// Largest number of histogram bins: more do not resolve more in 16-bit data.
const MAX_BINS: usize = 65_536;

impl Volume {
    /// Returns the histogram of one frame: the number of voxels in each of `bins` equal parts of
    /// [`range`](Self::range).
    ///
    /// The range is that of all frames, so the histograms of two frames are comparable. The largest intensity is
    /// counted in the last bin, but all of a constant volume in the first; NaN and infinite voxels are not counted.
    ///
    /// # Errors
    /// `bins` not in 1..=65536, `frame` out of range.
    pub fn histogram(&self, bins: usize, frame: usize) -> Result<Vec<u32>, VolumeError> {
        if bins == 0 || bins > MAX_BINS {
            return Err(VolumeError::invalid("bins", format!("must be 1 to {MAX_BINS}, got {bins}")));
        }
        let start = self.frame_start(frame)?;
        let end = start + self.frame_len();
        Ok(self.count(start..end, bins))
    }

    fn count(&self, indices: Range<usize>, bins: usize) -> Vec<u32> {
        let [low, high] = self.range();
        let scale = if high > low { bins as f64 / (high - low) } else { 0.0 };
        let mut counts = vec![0u32; bins];
        self.voxels.for_each_part(indices, |part| {
            for v in part {
                let value = v * self.slope + self.intercept;
                if value.is_finite() {
                    let bin = ((value - low) * scale) as usize;
                    let bin = if bin < bins { bin } else { bins - 1 };
                    counts[bin] = counts[bin].saturating_add(1);
                }
            }
        });
        counts
    }

    /// Returns the intensities of one axis-aligned slice, row-major.
    ///
    /// `axis` 0, 1, 2 fixes x, y, z at `index`. The lower one of the two other axes runs along the rows: a slice of
    /// fixed z has rows of x, one per y; fixed y rows of x, one per z; fixed x rows of y, one per z.
    ///
    /// # Errors
    /// `axis`, `index` or `frame` out of range; [`VolumeError::TooLarge`].
    pub fn slice(&self, axis: usize, index: usize, frame: usize) -> Result<Vec<f32>, VolumeError> {
        let start = self.frame_start(frame)?;
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        let (across, down) = match axis {
            0 => (1, 2),
            1 => (0, 2),
            2 => (0, 1),
            _ => return Err(VolumeError::invalid("axis", format!("must be 0, 1 or 2, got {axis}"))),
        };
        self.check_slice(axis, index)?;
        let mut out = reserve(self.dims[across] * self.dims[down])?;
        for row in 0..self.dims[down] {
            let first = start + index * strides[axis] + row * strides[down];
            out.extend((0..self.dims[across]).map(|i| self.intensity_at(first + i * strides[across]) as f32));
        }
        Ok(out)
    }

    fn check_slice(&self, axis: usize, index: usize) -> Result<(), VolumeError> {
        let count = self.dims[axis];
        if index < count {
            return Ok(());
        }
        Err(VolumeError::invalid(
            "index",
            format!("{index} is out of range; axis {axis} has {count} slices, the first is 0"),
        ))
    }
}

#[cfg(test)]
mod tests {

    use crate::volume::{Volume, VolumeInit, Voxels};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns a volume in which voxel (x, y, z) of frame t has the value x + 10y + 100z + 50t.
    fn volume() -> Volume {
        let value = |i: usize| (i % 4 + 10 * (i / 4 % 3) + 100 * (i / 12 % 2) + 50 * (i / 24)) as u8;
        Volume::new(VolumeInit::new(Voxels::U8((0..48).map(value).collect()), [4, 3, 2, 2])).unwrap()
    }

    #[test]
    fn slices_run_along_the_lower_axis_first() {
        let v = volume();
        assert_eq!(v.slice(0, 3, 0).unwrap(), [3., 13., 23., 103., 113., 123.]);
        assert_eq!(v.slice(1, 2, 0).unwrap(), [20., 21., 22., 23., 120., 121., 122., 123.]);
        assert_eq!(v.slice(2, 1, 1).unwrap()[..5], [150., 151., 152., 153., 160.]);
        assert_eq!(v.slice(2, 0, 0).unwrap().len(), 12);
    }

    #[test]
    fn slices_out_of_range_are_refused() {
        let v = volume();
        assert!(v.slice(3, 0, 0).is_err());
        assert!(v.slice(0, 4, 0).is_err());
        assert!(v.slice(2, 2, 0).is_err());
        assert!(v.slice(2, 0, 2).is_err());
    }

    #[test]
    fn histograms_count_every_voxel_of_a_frame_over_the_range_of_all() {
        let v = volume();
        assert_eq!(v.range(), [0.0, 173.0]);
        for bins in [1, 7, 256] {
            assert_eq!(v.histogram(bins, 1).unwrap().iter().sum::<u32>(), 24);
        }
        let exact = v.histogram(173, 0).unwrap();
        assert_eq!((exact[0], exact[13], exact[123], exact[172]), (1, 1, 1, 0));
        assert_eq!(v.histogram(173, 1).unwrap()[172], 2, "the largest shares the last bin with the next");
        assert!(v.histogram(0, 0).is_err() && v.histogram(65_537, 0).is_err() && v.histogram(4, 2).is_err());
    }
}
