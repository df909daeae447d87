//! Reader of NIfTI-1 and NIfTI-2: single files (.nii, .nii.gz) and pairs (.hdr with the voxels in an .img of
//! their own); and of Analyze 7.5, whose pairs NIfTI-1 continues.
//!
//! World space is RAS. The affine is the sform if its code is positive and it can be inverted, else the qform if its
//! code is positive, else the voxel sizes with the first voxel at the origin (methods 3, 2 and 1 of the standard), in the
//! space that the caller chooses, if any.
//! Lengths stay in the file's unit, given by [`Volume::unit`]. A slope of 0 or NaN means that stored numbers are
//! intensities. The time between frames is `pixdim[4]` in the file's time unit, or in seconds if it names none. Of
//! colours (RGB24, RGBA32) the luminance is read.

mod analyze;
mod fields;
mod world;

use super::beside::with_single;
use super::colour::{Colours, luminance_of};
use super::gzip::{gunzip, gunzip_start, is_gzip};
use super::raw::{FieldName, MAX_PADDING, Scalar, decode, payload, payload_size, volume_of};
use super::{FormatError, VolumeOptions};
use crate::math::DAffine3;
use crate::volume::{LengthUnit, Space, Volume, VolumeInit};
use crate::warning::{Warning, WarningCode};
use fields::{Container, Fields};
use std::borrow::Cow;

pub(super) const FORMAT: &str = "NIfTI";
const DATA: FieldName = FieldName { format: FORMAT, field: "voxel data" };
/// Size of a NIfTI-1 header in bytes, which is also the first number in the header and identifies the version.
pub(super) const SIZE_1: usize = 348;
/// Size of a NIfTI-2 header in bytes, which is also the first number in the header and identifies the version.
pub(super) const SIZE_2: usize = 540;
/// Size in bytes of the larger NIfTI header with the extension flag after it: the part of a file that is read or
/// inflated to parse its header.
const HEADER_ROOM: usize = SIZE_2 + 4;

/// Returns whether the bytes start like a NIfTI header of either version and byte order.
pub(super) fn is_nifti(bytes: &[u8]) -> bool {
    bytes.first_chunk().is_some_and(|&four| version(four).is_some())
}

/// Returns the NIfTI version, 1 or 2, that the first four bytes indicate, and whether the byte order is big-endian;
/// `None` if they indicate no NIfTI file.
fn version(four: [u8; 4]) -> Option<(u8, bool)> {
    let known = |size: u32| match size as usize {
        SIZE_1 => Some(1),
        SIZE_2 => Some(2),
        _ => None,
    };
    let little = known(u32::from_le_bytes(four)).map(|v| (v, false));
    little.or_else(|| known(u32::from_be_bytes(four)).map(|v| (v, true)))
}

/// Reads a NIfTI or Analyze volume, with the .img file of a pair. Either file may be gzipped.
///
/// # Errors
/// [`FormatError`] that names the header field at fault.
pub(super) fn parse(bytes: &[u8], options: &VolumeOptions<'_>) -> Result<Volume, FormatError> {
    let start = if is_gzip(bytes) {
        gunzip_start(FORMAT, bytes, HEADER_ROOM)?
    } else {
        bytes.iter().take(HEADER_ROOM).copied().collect()
    };
    let fields = Fields::read(&start)?;
    let header = Header::check(&fields, options.space)?;
    match (fields.container()?, options.detached, options.files) {
        (Container::Single, ..) => header.volume(bytes),
        (_, Some(image), _) => header.volume(image),
        (_, None, Some(files)) => {
            with_single(FORMAT, files, is_image, ".img or .img.gz", |image| header.volume(image))
        }
        (_, None, None) => Err(FormatError::invalid(
            FORMAT,
            "magic",
            "this is the header of a pair; pass its .img in `files`, or the bytes of it as `data`",
        )),
    }
}

/// Returns whether a name is that of a file with the voxels of a pair.
fn is_image(name: &str) -> bool {
    let ends_with = |end: &str| {
        let at = name.len().saturating_sub(end.len());
        name.get(at..).is_some_and(|rest| rest.eq_ignore_ascii_case(end))
    };
    ends_with(".img") || ends_with(".img.gz")
}

/// The content of a header, checked for consistency.
struct Header {
    big: bool,
    dims: [usize; 4],
    scalar: Scalar,
    colours: Option<Colours>,
    offset: usize,
    slope: f64,
    intercept: f64,
    affine: DAffine3,
    space: Space,
    frame_seconds: f64,
    unit: LengthUnit,
    warnings: Vec<Warning>,
}

impl Header {
    /// Checks the header fields for consistency and converts them; `space` is that of files without an orientation.
    fn check(fields: &Fields, space: Option<Space>) -> Result<Self, FormatError> {
        let container = fields.container()?;
        let dims = fields.dims()?;
        let mut warnings = fields.type_warnings();
        let (scalar, colours) = fields.numbers()?;
        let (slope, intercept) = if colours.is_some() { (1.0, 0.0) } else { fields.scaling()? };
        let offset = fields.offset(container)?;
        let is_analyze = container == Container::Analyze;
        let affine = match is_analyze {
            true => fields.analyze_affine(dims, space, &mut warnings)?,
            false => fields.affine(&mut warnings)?,
        };
        let space = space.filter(|_| is_analyze || !fields.has_transform()).unwrap_or_default();
        warnings.extend(colours.map(Colours::warning));
        Ok(Self {
            big: fields.big,
            dims,
            scalar,
            colours,
            offset,
            slope,
            intercept,
            affine,
            space,
            frame_seconds: fields.frame_seconds(dims[3])?,
            unit: fields.unit(),
            warnings,
        })
    }

    /// Returns the volume that the header describes, with its voxels decoded from a file, which may be gzipped.
    fn volume(&self, source: &[u8]) -> Result<Volume, FormatError> {
        let size = payload_size(DATA, self.dims, self.scalar)?;
        let size = self.colours.map_or(Ok(size), |colours| colours.size(FORMAT, size))?;
        let end = self.offset.checked_add(size);
        let end = end.ok_or_else(|| FormatError::too_large(FORMAT, "vox_offset", u64::MAX))?;
        if is_gzip(source) {
            let whole = gunzip(FORMAT, source, end.saturating_add(MAX_PADDING))?;
            return self.volume_of(Cow::Owned(whole), size);
        }
        self.volume_of(Cow::Borrowed(source), size)
    }

    /// Returns the volume with its voxels decoded from the `size` bytes after the offset.
    fn volume_of(&self, source: Cow<'_, [u8]>, size: usize) -> Result<Volume, FormatError> {
        if self.offset > source.len() {
            let needed = self.offset.saturating_add(size);
            return Err(FormatError::truncated(FORMAT, "voxel data", needed, source.len()));
        }
        let after_offset = match source {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[self.offset..]),
            Cow::Owned(mut bytes) => {
                bytes.drain(..self.offset);
                Cow::Owned(bytes)
            }
        };
        let numbers = decode(DATA, payload(DATA, after_offset, size)?, self.scalar, self.big)?;
        let init = VolumeInit {
            voxels: luminance_of(self.colours, numbers),
            dims: self.dims,
            affine: self.affine,
            slope: self.slope,
            intercept: self.intercept,
            frame_seconds: self.frame_seconds,
            space: self.space,
        };
        volume_of(FORMAT, init, self.unit, &self.warnings)
    }
}

/// Returns a warning about an assumption of the reader.
fn warning(text: impl Into<String>) -> Warning {
    Warning::new(WarningCode::Reader, text)
}
