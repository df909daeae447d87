//! Conversion of the numbers in a volume file, binary or text, to voxels, and of voxels to binary numbers.

use super::FormatError;
use crate::volume::{LengthUnit, Volume, VolumeError, VolumeInit, Voxels};
use crate::warning::Warning;
use std::borrow::Cow;

/// Number type of the voxels in a volume file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

/// Maximum number of bytes that the voxel data of a file may have beyond the size given by the header: writers pad the
/// end of files.
pub(super) const MAX_PADDING: usize = 512;

/// Largest integer up to which `f64` represents every integer; 64-bit voxels, which are converted to `f64`, must not
/// exceed it.
const MAX_EXACT: u64 = 1 << 53;

/// Names of the file format and of the header field that voxels belong to, for error messages.
#[derive(Clone, Copy)]
pub(super) struct FieldName {
    pub(super) format: &'static str,
    pub(super) field: &'static str,
}

impl Scalar {
    /// Returns the size of a number of this type in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Scalar::U8 | Scalar::I8 => 1,
            Scalar::U16 | Scalar::I16 => 2,
            Scalar::U32 | Scalar::I32 | Scalar::F32 => 4,
            Scalar::U64 | Scalar::I64 | Scalar::F64 => 8,
        }
    }
}

/// Returns the number of bytes that the voxels of a file take when uncompressed and binary.
///
/// # Errors
/// A dimension of 0, or a size that cannot be addressed.
pub(super) fn payload_size(name: FieldName, dims: [usize; 4], scalar: Scalar) -> Result<usize, FormatError> {
    if dims.contains(&0) {
        return Err(FormatError::invalid(
            name.format,
            name.field,
            format!("must all be at least 1, got {dims:?}"),
        ));
    }
    let bytes = dims.iter().fold(scalar.size() as u128, |product, &n| product.saturating_mul(n as u128));
    if bytes <= isize::MAX as u128 {
        return Ok(bytes as usize);
    }
    let needed = u64::try_from(bytes).unwrap_or(u64::MAX);
    Err(FormatError::too_large(name.format, name.field, needed))
}

/// Returns the first `needed` of the bytes of voxel data, those that hold the voxels, without a copy.
///
/// # Errors
/// Fewer bytes than `needed`, or more than [`MAX_PADDING`] beyond it, or as many again that are not padding: header and
/// payload then do not match.
pub(super) fn payload(
    name: FieldName,
    bytes: Cow<'_, [u8]>,
    needed: usize,
) -> Result<Cow<'_, [u8]>, FormatError> {
    let Some(rest) = bytes.get(needed..) else {
        return Err(FormatError::truncated(name.format, name.field, needed, bytes.len()));
    };
    if rest.len() > MAX_PADDING || rest.len() >= needed && rest.iter().any(|&byte| byte != 0) {
        let problem = format!("{} bytes of voxels, the header accounts for {needed}", bytes.len());
        return Err(FormatError::invalid(name.format, name.field, problem));
    }
    Ok(match bytes {
        Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..needed]),
        Cow::Owned(mut bytes) => {
            bytes.truncate(needed);
            Cow::Owned(bytes)
        }
    })
}

/// Decodes the voxels in `bytes`, whose length is a multiple of the size of a number. 64-bit integers become 32-bit ones
/// if all of them fit, so that they may be labels, else `f64`. `big` means big-endian. Bytes that are owned are not copied
/// if they are the voxels.
///
/// # Errors
/// A 64-bit integer beyond ±2⁵³, which `f64` may not represent exactly; not enough memory.
pub(super) fn decode(
    name: FieldName,
    bytes: Cow<'_, [u8]>,
    scalar: Scalar,
    big: bool,
) -> Result<Voxels, FormatError> {
    let bytes = match bytes {
        Cow::Owned(bytes) if scalar == Scalar::U8 => return Ok(Voxels::U8(bytes)),
        ref bytes => &bytes[..],
    };
    Ok(match scalar {
        Scalar::U8 => Voxels::U8(numbers(name, bytes, |[b]| b)?),
        Scalar::I8 => Voxels::I8(numbers(name, bytes, i8::from_ne_bytes)?),
        Scalar::U16 => {
            Voxels::U16(numbers(name, bytes, if big { u16::from_be_bytes } else { u16::from_le_bytes })?)
        }
        Scalar::I16 => {
            Voxels::I16(numbers(name, bytes, if big { i16::from_be_bytes } else { i16::from_le_bytes })?)
        }
        Scalar::U32 => {
            Voxels::U32(numbers(name, bytes, if big { u32::from_be_bytes } else { u32::from_le_bytes })?)
        }
        Scalar::I32 => {
            Voxels::I32(numbers(name, bytes, if big { i32::from_be_bytes } else { i32::from_le_bytes })?)
        }
        Scalar::F32 => {
            Voxels::F32(numbers(name, bytes, if big { f32::from_be_bytes } else { f32::from_le_bytes })?)
        }
        Scalar::F64 => {
            Voxels::F64(numbers(name, bytes, if big { f64::from_be_bytes } else { f64::from_le_bytes })?)
        }
        Scalar::U64 => {
            let read = if big { u64::from_be_bytes } else { u64::from_le_bytes };
            if all(bytes, |b| u32::try_from(read(b)).is_ok()) {
                return Ok(Voxels::U32(numbers(name, bytes, |b| read(b) as u32)?));
            }
            check_exact(name, bytes, read)?;
            Voxels::F64(numbers(name, bytes, |b| read(b) as f64)?)
        }
        Scalar::I64 => {
            let read = if big { i64::from_be_bytes } else { i64::from_le_bytes };
            if all(bytes, |b| i32::try_from(read(b)).is_ok()) {
                return Ok(Voxels::I32(numbers(name, bytes, |b| read(b) as i32)?));
            }
            check_exact(name, bytes, |b| read(b).unsigned_abs())?;
            Voxels::F64(numbers(name, bytes, |b| read(b) as f64)?)
        }
    })
}

/// Returns whether all 64-bit numbers in `bytes` fit.
fn all(bytes: &[u8], fits: impl Fn([u8; 8]) -> bool) -> bool {
    bytes.as_chunks().0.iter().all(|&b| fits(b))
}

/// Decodes all numbers in `bytes`, each of `N` bytes, with `read`.
fn numbers<const N: usize, T>(
    name: FieldName,
    bytes: &[u8],
    read: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, FormatError> {
    let (parts, _) = bytes.as_chunks::<N>();
    let mut out = Vec::new();
    let too_large = |_| FormatError::too_large(name.format, name.field, bytes.len() as u64);
    out.try_reserve_exact(parts.len()).map_err(too_large)?;
    out.extend(parts.iter().map(|&part| read(part)));
    Ok(out)
}

/// Returns an error if a 64-bit integer in `bytes`, whose absolute value `size` returns, exceeds [`MAX_EXACT`].
fn check_exact(name: FieldName, bytes: &[u8], size: impl Fn([u8; 8]) -> u64) -> Result<(), FormatError> {
    match bytes.as_chunks().0.iter().map(|&b| size(b)).find(|&v| v > MAX_EXACT) {
        None => Ok(()),
        Some(v) => {
            let problem = format!("64-bit voxels must be at most {MAX_EXACT} (2^53) in size, got {v}");
            Err(FormatError::invalid(name.format, name.field, problem))
        }
    }
}

/// Appends the voxels to the bytes of a file, as little-endian numbers.
pub(super) fn append_voxels(out: &mut Vec<u8>, voxels: &Voxels) {
    match voxels {
        Voxels::U8(values) => out.extend_from_slice(values),
        Voxels::I8(values) => out.extend(values.iter().map(|v| v.cast_unsigned())),
        Voxels::U16(values) => out.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Voxels::I16(values) => out.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Voxels::U32(values) => out.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Voxels::I32(values) => out.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Voxels::F32(values) => out.extend(values.iter().flat_map(|v| v.to_le_bytes())),
        Voxels::F64(values) => out.extend(values.iter().flat_map(|v| v.to_le_bytes())),
    }
}

/// Parses `count` voxels written as text, separated by whitespace or commas. All become `f64`, after a check that they
/// are in the range of the type `scalar`.
///
/// # Errors
/// Too few or too many numbers, a word that is not a number, a number that `scalar` cannot represent, or not enough
/// memory.
pub(super) fn decode_text(
    name: FieldName,
    bytes: &[u8],
    scalar: Scalar,
    count: usize,
) -> Result<Voxels, FormatError> {
    // A number and its separator take at least two bytes: more numbers cannot be present.
    if count > bytes.len() / 2 + 1 {
        return Err(FormatError::truncated(name.format, name.field, count.saturating_mul(2), bytes.len()));
    }
    let mut out = Vec::new();
    let too_large = |_| FormatError::too_large(name.format, name.field, count as u64 * 8);
    out.try_reserve_exact(count).map_err(too_large)?;
    let words = bytes.split(|&b| b.is_ascii_whitespace() || b == b',').filter(|word| !word.is_empty());
    for word in words {
        if out.len() == count {
            return Err(FormatError::invalid(
                name.format,
                name.field,
                format!("more than the {count} numbers the header accounts for"),
            ));
        }
        out.push(text_number(name, word, scalar)?);
    }
    if out.len() == count {
        return Ok(Voxels::F64(out));
    }
    Err(FormatError::invalid(
        name.format,
        name.field,
        format!("{} numbers, the header accounts for {count}", out.len()),
    ))
}

fn text_number(name: FieldName, word: &[u8], scalar: Scalar) -> Result<f64, FormatError> {
    let text = String::from_utf8_lossy(word);
    let value = text.parse::<f64>().ok().filter(|&v| can_represent(scalar, v));
    value.ok_or_else(|| {
        let shown: String = text.chars().take(20).collect();
        FormatError::invalid(name.format, name.field, format!("'{shown}' is not a number of type {scalar:?}"))
    })
}

/// Returns whether a value written as text is accepted as a number of the type that the header states: for integers,
/// one within the range of the type (at most ±2⁵³ for 64 bits); for floats, any.
fn can_represent(scalar: Scalar, v: f64) -> bool {
    let within = |low: f64, high: f64| v >= low && v <= high && v == libm::trunc(v);
    match scalar {
        Scalar::U8 => within(0.0, 255.0),
        Scalar::I8 => within(-128.0, 127.0),
        Scalar::U16 => within(0.0, 65_535.0),
        Scalar::I16 => within(-32_768.0, 32_767.0),
        Scalar::U32 => within(0.0, f64::from(u32::MAX)),
        Scalar::I32 => within(f64::from(i32::MIN), f64::from(i32::MAX)),
        Scalar::U64 => within(0.0, MAX_EXACT as f64),
        Scalar::I64 => within(-(MAX_EXACT as f64), MAX_EXACT as f64),
        Scalar::F32 | Scalar::F64 => true,
    }
}

/// Returns the volume of a file, with the unit and the warnings of its header.
pub(super) fn volume_of(
    format: &'static str,
    init: VolumeInit,
    unit: LengthUnit,
    warnings: &[Warning],
) -> Result<Volume, FormatError> {
    let volume = Volume::new(init).map_err(|error| volume_error(format, error))?.with_unit(unit);
    Ok(warnings.iter().cloned().fold(volume, Volume::with_warning))
}

/// Converts an error of [`crate::volume::Volume::new`] to an error about the file being read.
pub(super) fn volume_error(format: &'static str, error: VolumeError) -> FormatError {
    match error {
        VolumeError::InvalidArgument { parameter, problem } => {
            FormatError::invalid(format, parameter, problem)
        }
        VolumeError::TooLarge { bytes } => FormatError::too_large(format, "voxels", bytes),
        // Readers make no contours.
        other @ VolumeError::TooManyTriangles { .. } => {
            FormatError::invalid(format, "voxels", other.to_string())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const NAME: FieldName = FieldName { format: "test", field: "data" };

    #[test]
    fn integers_of_64_bits_become_shorter_ones_if_all_fit() {
        let decoded = |values: [i64; 2], scalar, big| {
            let bytes = values.map(|value| if big { value.to_be_bytes() } else { value.to_le_bytes() });
            decode(NAME, Cow::Borrowed(bytes.as_flattened()), scalar, big)
        };
        let (least, most) = (i64::from(i32::MIN), i64::from(u32::MAX));
        for big in [false, true] {
            let signed = |values| decoded(values, Scalar::I64, big).unwrap();
            let unsigned = |values| decoded(values, Scalar::U64, big).unwrap();
            assert_eq!(signed([least, 7]), Voxels::I32(vec![i32::MIN, 7]));
            assert_eq!(signed([least - 1, 7]), Voxels::F64(vec![-2_147_483_649.0, 7.0]));
            assert_eq!(unsigned([most, 7]), Voxels::U32(vec![u32::MAX, 7]));
            assert_eq!(unsigned([most + 1, 7]), Voxels::F64(vec![4_294_967_296.0, 7.0]));
            assert!(decoded([(1 << 53) + 1, 0], Scalar::I64, big).is_err());
        }
    }
}
