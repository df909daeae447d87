//! Writer of NIfTI-1 and NIfTI-2 as single files; see [`super::nifti`] for the reader.

use super::FormatError;
use super::nifti::{FORMAT, SIZE_1, SIZE_2};
use super::raw::append_voxels;
use crate::math::{DVec3, box_corners};
use crate::volume::{LengthUnit, Space, Volume, Voxels};

/// Size of a NIfTI-1 header in bytes with the extension flag after it, where the voxels start.
const OFFSET_1: usize = SIZE_1 + 4;
/// Size of a NIfTI-2 header in bytes with the extension flag after it, where the voxels start.
const OFFSET_2: usize = SIZE_2 + 4;
/// Largest error of an intensity, as a fraction of the step between the intensities of integer voxels, by which a file is
/// written as NIfTI-1: invisible where intensities are measured, and far below the difference of two labels.
const STEP_TOLERANCE: f64 = 0.01;
/// Largest displacement of a corner of the volume, as a fraction of the shortest side of a voxel, by which a file is
/// written as NIfTI-1: less than measurements resolve, and more than rounding does to a scan near the origin.
const SHIFT_TOLERANCE: f64 = 1e-3;

/// Returns the volume as an uncompressed little-endian NIfTI file: voxels as stored, world space converted to RAS, and
/// the affine as sform.
///
/// The file is NIfTI-1, which stores the affine, slope, intercept and time between frames in `f32`. It is NIfTI-2, which
/// stores them in `f64`, if a dimension or the number of frames exceeds 32,767, if the time between frames is beyond the
/// range of `f32`, if rounding the affine to `f32` would move a corner of the volume by more than a thousandth of the
/// shortest side of a voxel, or if rounding slope and intercept would change intensities: those of integers by more than
/// a hundredth of a step, those of floats at all.
///
/// # Errors
/// [`FormatError::TooLarge`] if there is not enough memory for the file.
pub fn write_nifti(volume: &Volume) -> Result<Vec<u8>, FormatError> {
    let [nx, ny, nz] = volume.dims();
    let dims = [nx, ny, nz, volume.frames()];
    let (code, size) = (datatype(volume.voxels()), volume.voxels().number_size());
    let total = OFFSET_2 + size * volume.voxels().len();
    let mut out = Vec::new();
    out.try_reserve_exact(total).map_err(|_| FormatError::too_large(FORMAT, "file", total as u64))?;
    let header = if fits_version_1(volume) { header_1 } else { header_2 };
    header(&mut out, volume, dims, code, size);
    append_voxels(&mut out, volume.voxels());
    Ok(out)
}

/// Returns whether a NIfTI-1 header represents the volume, with the tolerances given at [`write_nifti`].
fn fits_version_1(volume: &Volume) -> bool {
    let fits = |n: usize| n <= i16::MAX as usize;
    volume.dims().into_iter().all(fits)
        && fits(volume.frames())
        && is_normal_f32(volume.frame_seconds())
        && affine_fits_f32(volume)
        && scaling_fits_f32(volume)
}

/// Returns whether `f32` represents a number up to its relative rounding error: whether it is 0 or of a magnitude within
/// the range of `f32`.
fn is_normal_f32(value: f64) -> bool {
    value == 0.0 || (value as f32).is_normal()
}

/// Returns whether the corners of the volume stay where they are, within the tolerance, if the affine is rounded to
/// `f32`.
fn affine_fits_f32(volume: &Volume) -> bool {
    let errors = rows_in_ras(volume).map(|v| f64::from(v as f32) - v);
    let [x, y, z] = volume.spacing();
    let limit = SHIFT_TOLERANCE * x.min(y).min(z);
    let last = DVec3::from(volume.dims().map(|n| n as f64 - 0.5));
    box_corners(DVec3::splat(-0.5), last).into_iter().all(|at| {
        let shift = |row: usize| DVec3::from_slice(&errors[4 * row..]).dot(at) + errors[4 * row + 3];
        DVec3::new(shift(0), shift(1), shift(2)).length() <= limit
    })
}

/// Returns whether the intensities stay the same, within the tolerance, if slope and intercept are rounded to `f32`.
fn scaling_fits_f32(volume: &Volume) -> bool {
    let (slope, intercept) = (volume.slope(), volume.intercept());
    let errors = [slope, intercept].map(|v| (f64::from(v as f32) - v).abs());
    if errors == [0.0, 0.0] {
        return true;
    }
    let is_float = matches!(volume.voxels(), Voxels::F32(_) | Voxels::F64(_));
    if is_float || !is_normal_f32(slope) {
        return false;
    }
    let [low, high] = volume.range().map(|v| ((v - intercept) / slope).abs());
    let largest = if low > high { low } else { high };
    errors[0] * largest + errors[1] <= STEP_TOLERANCE * slope.abs()
}

/// Returns NIfTI's code of a voxel type.
fn datatype(voxels: &Voxels) -> i16 {
    match voxels {
        Voxels::U8(_) => 2,
        Voxels::I8(_) => 256,
        Voxels::U16(_) => 512,
        Voxels::I16(_) => 4,
        Voxels::U32(_) => 768,
        Voxels::I32(_) => 8,
        Voxels::F32(_) => 16,
        Voxels::F64(_) => 64,
    }
}

/// Writes bytes into a NIfTI header at offset `at`; nothing if they do not fit.
fn put<const N: usize>(out: &mut [u8], at: usize, bytes: [u8; N]) {
    if let Some(target) = out.get_mut(at..at + N) {
        target.copy_from_slice(&bytes);
    }
}

/// Writes a NIfTI-1 header for the volume to the empty `out`; `code` and `size` are the voxels' [`datatype`].
fn header_1(out: &mut Vec<u8>, volume: &Volume, dims: [usize; 4], code: i16, size: usize) {
    out.resize(OFFSET_1, 0);
    put(out, 0, (SIZE_1 as i32).to_le_bytes());
    for (i, v) in dim_field(dims).iter().enumerate() {
        put(out, 40 + 2 * i, (*v as i16).to_le_bytes());
    }
    put(out, 70, code.to_le_bytes());
    put(out, 72, (8 * size as i16).to_le_bytes());
    for (i, v) in pixdim_field(volume).iter().enumerate() {
        put(out, 76 + 4 * i, (*v as f32).to_le_bytes());
    }
    for (at, v) in [(108, OFFSET_1 as f64), (112, volume.slope()), (116, volume.intercept())] {
        put(out, at, (v as f32).to_le_bytes());
    }
    put(out, 123, [units_field(volume)]);
    put(out, 254, 1i16.to_le_bytes());
    for (i, v) in rows_in_ras(volume).iter().enumerate() {
        put(out, 280 + 4 * i, (*v as f32).to_le_bytes());
    }
    put(out, 344, *b"n+1\0");
}

/// Writes a NIfTI-2 header for the volume to the empty `out`; `code` and `size` are the voxels' [`datatype`].
fn header_2(out: &mut Vec<u8>, volume: &Volume, dims: [usize; 4], code: i16, size: usize) {
    out.resize(OFFSET_2, 0);
    put(out, 0, (SIZE_2 as i32).to_le_bytes());
    put(out, 4, *b"n+2\0\r\n\x1A\n");
    put(out, 12, code.to_le_bytes());
    put(out, 14, (8 * size as i16).to_le_bytes());
    for (i, v) in dim_field(dims).iter().enumerate() {
        put(out, 16 + 8 * i, (*v as i64).to_le_bytes());
    }
    for (i, v) in pixdim_field(volume).iter().enumerate() {
        put(out, 104 + 8 * i, v.to_le_bytes());
    }
    put(out, 168, (OFFSET_2 as i64).to_le_bytes());
    put(out, 176, volume.slope().to_le_bytes());
    put(out, 184, volume.intercept().to_le_bytes());
    put(out, 348, 1i32.to_le_bytes());
    for (i, v) in rows_in_ras(volume).iter().enumerate() {
        put(out, 400 + 8 * i, v.to_le_bytes());
    }
    put(out, 500, i32::from(units_field(volume)).to_le_bytes());
}

fn dim_field([nx, ny, nz, frames]: [usize; 4]) -> [usize; 8] {
    [if frames > 1 { 4 } else { 3 }, nx, ny, nz, frames, 1, 1, 1]
}

fn pixdim_field(volume: &Volume) -> [f64; 8] {
    let [x, y, z] = volume.spacing();
    [1.0, x, y, z, volume.frame_seconds(), 0.0, 0.0, 0.0]
}

/// Returns the code of the volume's length unit together with that of seconds, for the field `xyzt_units`.
fn units_field(volume: &Volume) -> u8 {
    8 + match volume.unit() {
        LengthUnit::Unknown => 0,
        LengthUnit::Metre => 1,
        LengthUnit::Millimetre => 2,
        LengthUnit::Micrometre => 3,
    }
}

/// Returns the upper three rows of the affine map from voxel indices to RAS world space, row-major, for the header's
/// sform.
fn rows_in_ras(volume: &Volume) -> [f64; 12] {
    let a = volume.affine_in(Space::Ras);
    let columns = [a.matrix3.x_axis, a.matrix3.y_axis, a.matrix3.z_axis, a.translation];
    std::array::from_fn(|i| columns[i % 4][i / 4])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::parse_volume;
    use crate::math::DAffine3;
    use crate::volume::VolumeInit;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn scaled(voxels: Voxels, slope: f64, intercept: f64, frame_seconds: f64) -> Volume {
        Volume::new(VolumeInit {
            dims: [1, 1, 1, voxels.len()],
            voxels,
            affine: DAffine3::IDENTITY,
            slope,
            intercept,
            frame_seconds,
            space: Space::Ras,
        })
        .unwrap()
    }

    fn version(file: &[u8]) -> u8 {
        if file.starts_with(&348i32.to_le_bytes()) { 1 } else { 2 }
    }

    #[test]
    fn scaling_that_f32_does_not_hold_is_written_as_nifti_2() {
        let bytes = || Voxels::U8(vec![0, 255]);
        for (voxels, slope, intercept, expected) in [
            (bytes(), 0.1, 0.0, 1),
            (bytes(), -2.5, 1024.0, 1),
            (Voxels::I16(vec![-30_000, 30_000]), 1.47, -0.003, 1),
            (bytes(), 1.0, 16_777_217.0, 2),
            (bytes(), 1e-60, 0.0, 2),
            (bytes(), 1e-42, 0.0, 2),
            (Voxels::U8(vec![0, 0]), 1e60, 5.0, 2),
            (Voxels::U8(vec![0, 0]), 1e-60, 5.0, 2),
            (Voxels::U32(vec![0, u32::MAX]), 0.1, 0.0, 2),
            (Voxels::U32(vec![0, u32::MAX]), 0.5, 3.0, 1),
            (Voxels::F32(vec![0.0, 1.0]), 0.1, 0.0, 2),
            (Voxels::F32(vec![0.0, 1.0]), 0.5, 0.25, 1),
        ] {
            let volume = scaled(voxels, slope, intercept, 0.04);
            let file = write_nifti(&volume).unwrap();
            assert_eq!(version(&file), expected, "{slope}, {intercept}");
            let again = parse_volume(&file, None).unwrap();
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-7 * b.abs();
            assert!(near(again.slope(), slope) && near(again.intercept(), intercept), "{slope}, {intercept}");
        }
    }

    /// Bytes of 8³ voxels with sides of `spacing`, the first of them at `origin`.
    fn placed(origin: DVec3, spacing: DVec3) -> Volume {
        let affine =
            DAffine3::from_scale_rotation_translation(spacing, glam::DQuat::from_rotation_z(0.3), origin);
        Volume::new(VolumeInit {
            voxels: Voxels::U8((0..=255).cycle().take(512).collect()),
            dims: [8, 8, 8, 1],
            affine,
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: 0.0,
            space: Space::Lps,
        })
        .unwrap()
    }

    #[test]
    fn an_affine_that_f32_does_not_hold_is_written_as_nifti_2() {
        let utm = DVec3::new(512_345.678, 5_401_234.567, 123.456);
        for (origin, spacing, expected) in [
            (utm, DVec3::splat(0.01), 2),
            (utm, DVec3::ONE, 2),
            (DVec3::new(1e7 + 0.25, 0.0, 0.0), DVec3::splat(0.1), 2),
            (DVec3::splat(-100.3), DVec3::new(1e-3, 1.0, 1.0), 2),
            (DVec3::splat(5.1), DVec3::splat(1e-11), 2),
            (DVec3::ZERO, DVec3::splat(1e-11), 1),
            (DVec3::splat(1e-40), DVec3::splat(0.7), 1),
            (DVec3::splat(-250.3), DVec3::new(0.35, 0.35, 1.1), 1),
            (DVec3::splat(5e6), DVec3::splat(1e3 / 3.0), 1),
        ] {
            let volume = placed(origin, spacing);
            let file = write_nifti(&volume).unwrap();
            assert_eq!(version(&file), expected, "{origin}, {spacing}");
            let (again, affine) = (parse_volume(&file, None).unwrap(), volume.affine_in(Space::Ras));
            let apart = |p: DVec3| (again.affine().transform_point3(p) - affine.transform_point3(p)).length();
            let moved = apart(DVec3::ZERO).max(apart(DVec3::splat(7.0)));
            assert!(moved <= SHIFT_TOLERANCE * spacing.min_element(), "{origin}, {spacing}: {moved}");
            assert!(expected == 1 || again.affine() == affine, "{origin}, {spacing}");
        }
    }

    #[test]
    fn a_time_beyond_f32_is_written_as_nifti_2() {
        for (seconds, expected) in [(0.0, 1), (0.04, 1), (1e-50, 2), (1e300, 2)] {
            let volume = scaled(Voxels::U8(vec![1, 2]), 1.0, 0.0, seconds);
            let file = write_nifti(&volume).unwrap();
            let again = parse_volume(&file, None).unwrap();
            assert_eq!(version(&file), expected);
            assert!((again.frame_seconds() - seconds).abs() <= 1e-7 * seconds);
        }
    }
}
