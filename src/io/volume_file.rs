//! Writing of volumes in any of the formats.

use super::deflate::gzip;
use super::raw::append_voxels;
use super::{FormatError, metaimage_writer, nifti, nrrd, write_nifti};
use crate::volume::{Volume, Voxels};

/// File format in which [`write_volume`] writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFormat {
    /// NIfTI-1, or NIfTI-2 where that is needed (.nii, .nii.gz); see [`write_nifti`].
    Nifti,
    /// NRRD with header and voxels in one file (.nrrd).
    Nrrd,
    /// MetaImage with header and voxels in one file (.mha).
    Mha,
}

impl VolumeFormat {
    /// Returns the format with a name: `nifti`, `nrrd` or `mha`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "nifti" => Some(Self::Nifti),
            "nrrd" => Some(Self::Nrrd),
            "mha" => Some(Self::Mha),
            _ => None,
        }
    }
}

/// Compression of a file that [`write_volume`] writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Voxels as plain little-endian numbers.
    #[default]
    None,
    /// All of a NIfTI file, or the voxels of an NRRD, as gzip; the voxels of a MetaImage as zlib.
    Deflate,
}

/// Returns the volume as a file.
///
/// NIfTI stores voxels, slope and intercept as they are; NRRD and MetaImage have no slope and intercept: if these are not
/// 1 and 0, intensities are stored, as 64-bit floats in place of 32-bit integers and 64-bit floats and as 32-bit floats in
/// place of the other types. World space is RAS in NIfTI, LPS in MetaImage, and that of the volume in NRRD. MetaImage has no
/// unit of time, so the time between frames is lost when the file is read by this library.
///
/// # Errors
/// [`FormatError::TooLarge`] if there is not enough memory for the file.
pub fn write_volume(
    volume: &Volume,
    format: VolumeFormat,
    compression: Compression,
) -> Result<Vec<u8>, FormatError> {
    match format {
        VolumeFormat::Nifti => {
            let file = write_nifti(volume)?;
            if compression == Compression::None { Ok(file) } else { gzip(nifti::FORMAT, &file) }
        }
        VolumeFormat::Nrrd => nrrd::write(volume, compression),
        VolumeFormat::Mha => metaimage_writer::write(volume, compression),
    }
}

/// Returns the voxels as little-endian numbers after the bytes of `header`.
pub(super) fn with_voxels(
    format: &'static str,
    header: String,
    voxels: &Voxels,
) -> Result<Vec<u8>, FormatError> {
    let mut out = header.into_bytes();
    let size = voxels.len().saturating_mul(voxels.number_size());
    out.try_reserve_exact(size).map_err(|_| FormatError::too_large(format, "voxels", size as u64))?;
    append_voxels(&mut out, voxels);
    Ok(out)
}

/// Returns the bytes of `payload` after those of `header`.
pub(super) fn with_payload(
    format: &'static str,
    header: String,
    payload: &[u8],
) -> Result<Vec<u8>, FormatError> {
    let mut out = header.into_bytes();
    let too_large = |_| FormatError::too_large(format, "voxels", payload.len() as u64);
    out.try_reserve_exact(payload.len()).map_err(too_large)?;
    out.extend_from_slice(payload);
    Ok(out)
}

/// Returns numbers as text that reads as the same numbers again.
pub(super) fn written(numbers: impl IntoIterator<Item = f64>) -> Vec<String> {
    // Adding 0 turns -0 into 0.
    numbers.into_iter().map(|number| format!("{:?}", number + 0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::parse_volume;
    use crate::math::{DAffine3, DMat3, DVec3, Random};
    use crate::volume::{LengthUnit, Space, VolumeInit};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const FORMATS: [VolumeFormat; 3] = [VolumeFormat::Nifti, VolumeFormat::Nrrd, VolumeFormat::Mha];
    const BOTH: [Compression; 2] = [Compression::None, Compression::Deflate];

    /// Returns voxels of each type: its extreme numbers and random ones, `count` in all.
    fn voxels_of_all_types(count: usize) -> [Voxels; 8] {
        let mut random = Random::new(2);
        macro_rules! integers {
            ($kind:ident, $number:ty) => {{
                let mut values: Vec<$number> = (0..count).map(|_| random.next_u32() as $number).collect();
                values[..3].copy_from_slice(&[<$number>::MIN, <$number>::MAX, 0]);
                Voxels::$kind(values)
            }};
        }
        let all = [
            integers!(U8, u8),
            integers!(I8, i8),
            integers!(U16, u16),
            integers!(I16, i16),
            integers!(U32, u32),
            integers!(I32, i32),
        ];
        let mut floats: Vec<f64> = (0..count).map(|_| f64::from(random.next_u32()) / 7.0 - 3e8).collect();
        floats[..4].copy_from_slice(&[f64::from(f32::MAX), -1e-40, f64::INFINITY, f64::NEG_INFINITY]);
        let [a, b, c, d, e, f] = all;
        let single = floats.iter().map(|&v| v as f32).collect();
        [a, b, c, d, e, f, Voxels::F32(single), Voxels::F64(floats)]
    }

    /// Returns an oblique, mirrored affine with voxels of different sizes.
    fn oblique() -> DAffine3 {
        let turned = DMat3::from_quat(glam::DQuat::from_xyzw(0.1, -0.4, 0.3, 0.7).normalize());
        let sizes = DMat3::from_diagonal(DVec3::new(0.7, -1.3, 2.1));
        DAffine3::from_mat3_translation(turned * sizes, DVec3::new(-83.123, 45.6, 1e-3))
    }

    fn init(voxels: Voxels, frames: usize, space: Space) -> VolumeInit {
        VolumeInit {
            dims: [5, 4, voxels.len() / (20 * frames), frames],
            voxels,
            affine: oblique(),
            slope: 1.0,
            intercept: 0.0,
            frame_seconds: if frames > 1 { 0.04 } else { 0.0 },
            space,
        }
    }

    fn again(volume: &Volume, format: VolumeFormat, compression: Compression) -> Volume {
        let file = write_volume(volume, format, compression).unwrap();
        parse_volume(&file, None).unwrap_or_else(|error| panic!("{format:?}, {compression:?}: {error}"))
    }

    /// Returns the position of a voxel in RAS, whatever the volume's own space.
    fn in_ras(volume: &Volume, index: DVec3) -> DVec3 {
        let p = volume.affine().transform_point3(index);
        if volume.space() == Space::Lps { DVec3::new(-p.x, -p.y, p.z) } else { p }
    }

    fn assert_same_grid(found: &Volume, volume: &Volume, format: VolumeFormat) {
        assert_eq!((found.dims(), found.frames()), (volume.dims(), volume.frames()));
        // NIfTI-1 stores the affine in single precision.
        let tolerance = if format == VolumeFormat::Nifti { 2e-5 } else { 1e-12 };
        for index in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(5.0, 4.0, 3.0)] {
            let (here, there) = (in_ras(found, index), in_ras(volume, index));
            assert!(here.distance(there) <= tolerance, "{format:?}: {here}, not {there}");
        }
        let expected = match format {
            VolumeFormat::Nifti => Space::Ras,
            VolumeFormat::Nrrd => volume.space(),
            VolumeFormat::Mha => Space::Lps,
        };
        assert_eq!(found.space(), expected);
        if format == VolumeFormat::Nrrd {
            assert_eq!(found.affine(), volume.affine());
        }
        let seconds = if format == VolumeFormat::Mha { 0.0 } else { volume.frame_seconds() };
        assert!((found.frame_seconds() - seconds).abs() < 1e-9);
    }

    #[test]
    fn every_type_comes_back_from_every_format_with_its_grid() {
        for (space, frames) in [(Space::Ras, 1), (Space::Lps, 1), (Space::Ras, 2), (Space::Lps, 3)] {
            for voxels in voxels_of_all_types(20 * 3 * frames) {
                let volume = Volume::new(init(voxels, frames, space)).unwrap();
                for (format, compression) in FORMATS.iter().flat_map(|&f| BOTH.map(|c| (f, c))) {
                    let found = again(&volume, format, compression);
                    assert_eq!(found.voxels(), volume.voxels(), "{format:?}, {compression:?}");
                    assert_eq!((found.slope(), found.intercept()), (1.0, 0.0));
                    assert_same_grid(&found, &volume, format);
                }
            }
        }
    }

    #[test]
    fn slope_and_intercept_are_kept_by_nifti_and_applied_for_the_others() {
        for voxels in voxels_of_all_types(60).into_iter().take(6) {
            let scaled = VolumeInit { slope: -0.5, intercept: 3.25, ..init(voxels, 1, Space::Ras) };
            let volume = Volume::new(scaled).unwrap();
            let wide = matches!(volume.voxels(), Voxels::U32(_) | Voxels::I32(_));
            for format in FORMATS {
                let found = again(&volume, format, Compression::None);
                let stays = format == VolumeFormat::Nifti;
                assert_eq!(found.voxels() == volume.voxels(), stays);
                assert_eq!((found.slope(), found.intercept()), if stays { (-0.5, 3.25) } else { (1.0, 0.0) });
                assert!(stays || matches!(found.voxels(), Voxels::F64(_)) == wide);
                assert_eq!((found.range(), found.intensities(0)), (volume.range(), volume.intensities(0)));
            }
        }
    }

    #[test]
    fn units_of_length_and_axes_of_one_voxel_come_back() {
        for unit in [LengthUnit::Unknown, LengthUnit::Metre, LengthUnit::Millimetre, LengthUnit::Micrometre] {
            let small = VolumeInit { dims: [1, 1, 1, 2], ..init(Voxels::U8(vec![3, 9]), 2, Space::Lps) };
            let volume = Volume::new(small).unwrap().with_unit(unit);
            for format in FORMATS {
                let found = again(&volume, format, Compression::Deflate);
                assert_eq!((found.unit(), found.voxels()), (unit, volume.voxels()));
                assert_same_grid(&found, &volume, format);
            }
        }
    }

    #[test]
    fn numbers_of_any_size_come_back() {
        let far = DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::new(1e-11, 1e11, 1.0 / 3.0)),
            translation: DVec3::new(1e30, -1e-30, -0.0),
        };
        let volume =
            VolumeInit { affine: far, frame_seconds: 1e-7, ..init(Voxels::I8(vec![1; 80]), 2, Space::Lps) };
        let volume = Volume::new(volume).unwrap();
        let found = again(&volume, VolumeFormat::Nrrd, Compression::None);
        assert_eq!((found.affine(), found.frame_seconds()), (volume.affine(), 1e-7));
        let found = again(&volume, VolumeFormat::Mha, Compression::None);
        assert_eq!((found.affine().translation, found.spacing()), (far.translation, volume.spacing()));
    }

    #[test]
    fn the_header_of_a_metaimage_says_where_its_axes_come_from() {
        let letters = |x: DVec3, y: DVec3, z: DVec3, space| {
            let affine = DAffine3::from_cols(x, y, z, DVec3::ZERO);
            let volume = VolumeInit { affine, ..init(Voxels::U8(vec![1; 20]), 1, space) };
            let file =
                write_volume(&Volume::new(volume).unwrap(), VolumeFormat::Mha, Compression::None).unwrap();
            let text = String::from_utf8_lossy(&file).into_owned();
            let line = text.lines().find_map(|line| line.strip_prefix("AnatomicalOrientation = "));
            line.map(str::to_owned)
        };
        assert_eq!(letters(DVec3::X, DVec3::Y, DVec3::Z, Space::Lps).as_deref(), Some("RAI"));
        assert_eq!(letters(DVec3::X, DVec3::Y, DVec3::Z, Space::Ras).as_deref(), Some("LPI"));
        let turned = letters(DVec3::new(0.2, 0.9, 0.1), -DVec3::Z, DVec3::NEG_X, Space::Lps);
        assert_eq!(turned.as_deref(), Some("ASL"));
        let sheared = letters(DVec3::X, DVec3::new(1.0, 0.5, 0.0), DVec3::Z, Space::Lps);
        assert_eq!(sheared, None);
    }
}
