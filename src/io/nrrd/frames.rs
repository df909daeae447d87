//! Reordering of the voxels of an NRRD in which the voxels of a frame are not consecutive.

use super::DATA;
use crate::io::FormatError;
use crate::volume::Voxels;

/// Returns the voxels reordered frame by frame. In the file, `run` consecutive numbers belong to the first frame, the
/// next `run` to the second, and so on; after the last of the `frames` follows the first again.
///
/// # Errors
/// [`FormatError::TooLarge`] if there is not enough memory.
pub(super) fn deinterleave_frames(voxels: Voxels, run: usize, frames: usize) -> Result<Voxels, FormatError> {
    if run * frames == voxels.len() {
        return Ok(voxels);
    }
    macro_rules! of_each_type {
        ($($kind:ident),+) => {
            match voxels {
                $(Voxels::$kind(values) => Voxels::$kind(deinterleaved(&values, run, frames)?),)+
            }
        };
    }
    Ok(of_each_type!(U8, I8, U16, I16, U32, I32, F32, F64))
}

fn deinterleaved<T: Copy>(values: &[T], run: usize, frames: usize) -> Result<Vec<T>, FormatError> {
    let mut out = Vec::new();
    let too_large = |_| FormatError::too_large(DATA.format, DATA.field, size_of_val(values) as u64);
    out.try_reserve_exact(values.len()).map_err(too_large)?;
    out.extend_from_slice(values);
    let frame = values.len() / frames;
    // In the order of the source, so that each number is fetched from memory once.
    for (at, all) in values.chunks_exact(run * frames).enumerate() {
        for (t, part) in all.chunks_exact(run).enumerate() {
            let to = t * frame + at * run;
            out[to..to + run].copy_from_slice(part);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the numbers of 4 frames of 2 × 3 each, as in a file with `run` consecutive numbers per frame. Each
    /// number is 10 times its index within the frame plus the index of the frame.
    fn alternating(run: usize) -> Vec<u8> {
        let one = |i: usize| 10 * (i / (4 * run) * run + i % run) + i / run % 4;
        (0..24).map(|i| one(i) as u8).collect()
    }

    #[test]
    fn frames_wherever_their_axis_was() {
        let expected: Vec<u8> = (0..24).map(|i| (10 * (i % 6) + i / 6) as u8).collect();
        for run in [1, 2, 6] {
            let found = deinterleave_frames(Voxels::U8(alternating(run)), run, 4);
            assert_eq!(found, Ok(Voxels::U8(expected.clone())), "{run} in a row");
        }
    }

    #[test]
    fn numbers_keep_their_type() {
        let numbers = Voxels::F64(vec![0.5, 1.5, 2.5, 3.5]);
        assert_eq!(deinterleave_frames(numbers, 1, 2), Ok(Voxels::F64(vec![0.5, 2.5, 1.5, 3.5])));
        let still = Voxels::I16(vec![-1, 2, -3]);
        assert_eq!(deinterleave_frames(still.clone(), 3, 1), Ok(still));
    }
}
