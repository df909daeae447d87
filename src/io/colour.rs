//! Colours of voxels, of which the luminance is read.

use super::FormatError;
use crate::volume::{VoxelNumber, Voxels, map_each};
use crate::warning::{Warning, WarningCode};

/// Weights of red, green and blue in the luminance of Rec. 709, as ITK takes them.
const WEIGHTS: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// How the colours of voxels lie in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Colours {
    /// Numbers of a colour: 3 (red, green, blue) or 4 (opacity last).
    pub(super) channels: usize,
    /// How many consecutive numbers belong to one channel: 1 if the numbers of a voxel are side by side.
    pub(super) run: usize,
}

/// Returns voxels by the numbers of a file: the luminance of colours, or the numbers themselves.
pub(super) fn luminance_of(colours: Option<Colours>, numbers: Voxels) -> Voxels {
    match colours {
        Some(colours) => colours.luminance(numbers),
        None => numbers,
    }
}

impl Colours {
    /// Returns the colours of voxels whose numbers are side by side.
    pub(super) fn interleaved(channels: usize) -> Self {
        Self { channels, run: 1 }
    }

    /// Returns the size in bytes of voxels of this many numbers each, if one number a voxel takes `size`.
    ///
    /// # Errors
    /// A size that cannot be addressed.
    pub(super) fn size(self, format: &'static str, size: usize) -> Result<usize, FormatError> {
        let bytes = size.checked_mul(self.channels).filter(|&bytes| bytes <= isize::MAX as usize);
        bytes.ok_or_else(|| FormatError::too_large(format, "voxel data", u64::MAX))
    }

    /// Returns the luminance of each colour, in the type of the numbers; opacity is left out.
    pub(super) fn luminance(self, numbers: Voxels) -> Voxels {
        map_each!(numbers, values => self.reduced(values))
    }

    /// Returns one number for each colour, in the memory of the given ones: none is written before it has been read.
    fn reduced<T: VoxelNumber>(self, mut values: Vec<T>) -> Vec<T> {
        let Self { channels, run } = self;
        let count = values.len() / channels;
        for to in 0..count {
            let first = to / run * run * channels + to % run;
            let weighed =
                WEIGHTS.iter().enumerate().map(|(k, weight)| weight * values[first + k * run].into());
            values[to] = T::nearest(weighed.sum());
        }
        values.truncate(count);
        values.shrink_to_fit();
        values
    }

    /// Returns the warning that colours were read as luminance.
    pub(super) fn warning(self) -> Warning {
        let left_out = if self.channels == 4 { ", and its opacity is left out" } else { "" };
        let text = format!(
            "The voxels are colours. Each is read as its luminance (0.2126 red + 0.7152 green + 0.0722 blue, Rec. 709){left_out}. \
             Different colours may have the same luminance."
        );
        Warning::new(WarningCode::Reader, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn luminance_wherever_the_channels_are() {
        // Two blocks of two colours: green, white; blue, red.
        let side_by_side = [0, 255, 0, 255, 255, 255, 0, 0, 255, 255, 0, 0];
        let of_rows = [0, 255, 255, 255, 0, 255, 0, 255, 0, 0, 255, 0];
        let planar = [0, 255, 0, 255, 255, 255, 0, 0, 0, 255, 255, 0];
        for (run, numbers) in [(1, side_by_side), (2, of_rows), (4, planar)] {
            let found = Colours { channels: 3, run }.luminance(Voxels::U8(numbers.to_vec()));
            assert_eq!(found, Voxels::U8(vec![182, 255, 18, 54]), "{run} in a row");
        }
        let clear = Colours::interleaved(4).luminance(Voxels::F32(vec![0.5, 0.5, 0.5, 0.0]));
        assert_eq!(clear, Voxels::F32(vec![0.5]));
    }
}
