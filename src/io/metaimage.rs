//! Reader of MetaImage: .mha with the voxels in the same file, .mhd with the voxels in a data file of their own.
//!
//! World space is LPS, in the unit that `DistanceUnits` names. Each row of `TransformMatrix` is the direction of one
//! axis, as in ITK. `CenterOfRotation` and `AnatomicalOrientation` are only descriptive and ignored. The format gives
//! no unit for the step of a fourth axis, so frames have no time. Fields with more numbers than the image has axes are
//! read up to those of its axes. The voxels may be in several files, each with the same number of them: a list
//! (`ElementDataFile = LIST`), or a numbered series. Of colours (three or four channels of bytes) the luminance is read.

use super::beside::{DataFiles, Series, pattern_and_numbers};
use super::colour::{Colours, luminance_of};
use super::gzip::{gunzip, is_gzip, unzlib};
use super::raw::{FieldName, MAX_PADDING, Scalar, decode, decode_text, payload, payload_size, volume_of};
use super::source::Source;
use super::text::{Field, Lines};
use super::units::{metres, thickness_warning, unit_of};
use super::{FormatError, VolumeOptions};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::volume::{LengthUnit, Space, Volume, VolumeInit, Voxels};
use crate::warning::{Warning, WarningCode};
use std::borrow::Cow;

pub(super) const FORMAT: &str = "MetaImage";
const DATA: FieldName = FieldName { format: FORMAT, field: "voxel data" };

/// Returns whether the bytes start like a MetaImage header: with a `key = value` line of one of its usual first keys.
pub(super) fn is_metaimage(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    [&b"ObjectType"[..], b"NDims", b"Comment", b"ObjectSubType"]
        .iter()
        .any(|key| start.strip_prefix(*key).is_some_and(|rest| rest.trim_ascii_start().starts_with(b"=")))
}

/// Reads a MetaImage volume, with the files beside it if its header refers to any.
///
/// # Errors
/// [`FormatError`] that names the header field at fault.
pub(super) fn parse(bytes: &[u8], options: &VolumeOptions<'_>) -> Result<Volume, FormatError> {
    let mut lines = Lines::new(FORMAT, bytes);
    let fields = Fields::read(&mut lines)?;
    let header = Header::check(&fields)?;
    let file = fields.need("ElementDataFile")?;
    if file.text.eq_ignore_ascii_case("LOCAL") {
        return header.volume(&Source::Bytes(lines.rest()));
    }
    header.volume(&options.source(&file, || data_files(&file, lines, &header.sizes))?)
}

/// Returns the data files that the field `ElementDataFile` names, with the lines after it and the sizes of the axes.
fn data_files(file: &Field<'_>, mut lines: Lines<'_>, sizes: &[usize]) -> Result<DataFiles, FormatError> {
    // The number of axes of each file may follow, such as 2D; it is known from the number of files.
    if file.text.split_whitespace().next() == Some("LIST") {
        return lines.names(file);
    }
    match pattern_and_numbers(file.text) {
        Some((pattern, numbers)) => {
            series(pattern, &numbers, sizes).ok_or_else(|| file.invalid("must be like 's%03d.raw 1 20 1'"))
        }
        None => Ok(DataFiles::Names(vec![file.text.to_owned()])),
    }
}

/// Returns a numbered series: first and last number and step, which by default give a file for each slice, from 1 on.
fn series(pattern: &str, numbers: &[i64], sizes: &[usize]) -> Option<DataFiles> {
    let first = numbers.first().copied().unwrap_or(1);
    let slices = i64::try_from(*sizes.last()?).ok()?;
    let last = numbers.get(1).copied().or_else(|| first.checked_add(slices - 1))?;
    let step = numbers.get(2).copied().unwrap_or(1);
    (numbers.len() <= 3).then(|| Series::parse(pattern, first, last, step)).flatten().map(DataFiles::Series)
}

/// The keys that the reader uses.
const KEYS: [&str; 22] = [
    "ObjectType",
    "NDims",
    "DimSize",
    "ElementType",
    "ElementNumberOfChannels",
    "ElementDataFile",
    "ElementSpacing",
    "ElementSize",
    "ElementByteOrderMSB",
    "ElementToIntensityFunctionSlope",
    "ElementToIntensityFunctionOffset",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "CompressedData",
    "HeaderSize",
    "Offset",
    "Position",
    "Origin",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "DistanceUnits",
];

/// The `key = value` lines of a MetaImage header that the reader uses, up to and including the one that names the data file.
struct Fields {
    pairs: Vec<(&'static str, String)>,
    /// Whether the file is a sequence of images: whether it says something about each of them.
    is_sequence: bool,
}

impl Fields {
    /// Reads the `key = value` lines of the header, up to and including the one that names the data file.
    fn read(lines: &mut Lines<'_>) -> Result<Self, FormatError> {
        let mut fields = Self { pairs: Vec::new(), is_sequence: false };
        while let Some(line) = lines.next_line()? {
            if line.trim().is_empty() {
                continue;
            }
            let Some((key, value)) = line.split_once('=') else {
                let shown: String = line.chars().take(40).collect();
                return Err(FormatError::invalid(
                    FORMAT,
                    "header",
                    format!("'{shown}' is not a 'key = value' line"),
                ));
            };
            if fields.add(key.trim(), value.trim())? == Some("ElementDataFile") {
                break;
            }
        }
        Ok(fields)
    }

    /// Adds a field, if the reader uses it, and returns its key.
    fn add(&mut self, key: &str, value: &str) -> Result<Option<&'static str>, FormatError> {
        self.is_sequence |= key.starts_with("Seq_Frame");
        let Some(&key) = KEYS.iter().find(|&&known| known == key) else { return Ok(None) };
        match self.get(key) {
            Some(before) if before.text != value => {
                return Err(FormatError::invalid(FORMAT, key, "is given twice, with different values"));
            }
            Some(_) => {}
            None => self.pairs.push((key, value.to_owned())),
        }
        Ok(Some(key))
    }

    /// Returns a field by its key, if the header has it.
    fn get(&self, key: &'static str) -> Option<Field<'_>> {
        let (_, text) = self.pairs.iter().find(|&&(name, _)| name == key)?;
        Some(Field { format: FORMAT, name: key, text })
    }

    /// Returns the field under the first of several synonymous keys that the header has, if any.
    fn any(&self, keys: &[&'static str]) -> Option<Field<'_>> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// Returns a field by its key; an error if it is missing.
    fn need(&self, key: &'static str) -> Result<Field<'_>, FormatError> {
        self.get(key).ok_or_else(|| FormatError::invalid(FORMAT, key, "missing"))
    }

    /// Returns the value of the True or False field under any of several synonymous keys; false if the header has none
    /// of them.
    fn flag(&self, keys: &[&'static str]) -> Result<bool, FormatError> {
        let Some(field) = self.any(keys) else { return Ok(false) };
        match field.text.to_ascii_lowercase().as_str() {
            "true" | "1" => Ok(true),
            "false" | "0" => Ok(false),
            _ => Err(field.invalid("must be True or False")),
        }
    }

    /// Returns the number in a field, or `default` if it is missing.
    fn number(&self, key: &'static str, default: f64) -> Result<f64, FormatError> {
        self.get(key).map_or(Ok(default), |field| Ok(field.finite(1)?[0]))
    }
}

/// The content of a MetaImage header, checked for consistency.
struct Header {
    scalar: Scalar,
    colours: Option<Colours>,
    /// Number of voxels along each axis that the file has.
    sizes: Vec<usize>,
    dims: [usize; 4],
    big: bool,
    text: bool,
    compressed: bool,
    /// Number of bytes in the data file before the voxels; `None` (-1 in the file) if the voxels are its last bytes.
    skip: Option<usize>,
    slope: f64,
    intercept: f64,
    affine: DAffine3,
    unit: LengthUnit,
    warnings: Vec<Warning>,
}

impl Header {
    /// Converts all fields of the header and checks them for consistency.
    fn check(fields: &Fields) -> Result<Self, FormatError> {
        check_object(fields)?;
        let rank = rank(fields)?;
        let mut dims = [1; 4];
        let sizes = fields.need("DimSize")?.sizes(rank)?;
        dims[..rank].copy_from_slice(&sizes);
        let scalar = scalar(&fields.need("ElementType")?)?;
        let colours = colours(fields, scalar)?;
        let mut warnings: Vec<Warning> =
            colours.map(Colours::warning).into_iter().chain(sequence_warning(fields, rank)).collect();
        let affine = affine(fields, &sizes, &mut warnings)?;
        Ok(Self {
            scalar,
            colours,
            sizes,
            dims,
            big: fields.flag(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])?,
            text: fields.get("BinaryData").is_some() && !fields.flag(&["BinaryData"])?,
            compressed: fields.flag(&["CompressedData"])?,
            skip: skip(fields)?,
            slope: fields.number("ElementToIntensityFunctionSlope", 1.0)?,
            intercept: fields.number("ElementToIntensityFunctionOffset", 0.0)?,
            affine,
            unit: unit(fields),
            warnings,
        })
    }

    /// Returns the volume that the header describes, with its voxels read from `source`.
    fn volume(&self, source: &Source<'_>) -> Result<Volume, FormatError> {
        let numbers = self.numbers(source)?;
        let init = VolumeInit {
            voxels: luminance_of(self.colours, numbers),
            dims: self.dims,
            affine: self.affine,
            slope: self.slope,
            intercept: self.intercept,
            frame_seconds: 0.0,
            space: Space::Lps,
        };
        volume_of(FORMAT, init, self.unit, &self.warnings)
    }

    /// Reads the numbers of the voxels from `source`.
    fn numbers(&self, source: &Source<'_>) -> Result<Voxels, FormatError> {
        let size = payload_size(DATA, self.dims, self.scalar)?;
        let size = self.colours.map_or(Ok(size), |colours| colours.size(FORMAT, size))?;
        let decoded = |bytes: Cow<'_, [u8]>| decode(DATA, bytes, self.scalar, self.big);
        let all = |bytes: &[u8]| match self.text {
            true => decode_text(DATA, self.after_skip(bytes, size)?, self.scalar, size / self.scalar.size()),
            false => decoded(payload(DATA, self.binary(bytes, size)?, size)?),
        };
        source.voxels(FORMAT, size, all, |bytes, size| self.binary(bytes, size), decoded)
    }

    /// Returns the binary numbers in a file, `size` bytes if it has as many as the header says: those after the bytes to
    /// skip, inflated if they are compressed.
    fn binary<'a>(&self, bytes: &'a [u8], size: usize) -> Result<Cow<'a, [u8]>, FormatError> {
        if self.text {
            return Err(FormatError::unsupported(FORMAT, "BinaryData", "text in several files", "one file"));
        }
        if !self.compressed {
            return Ok(Cow::Borrowed(self.after_skip(bytes, size)?));
        }
        let source = self.after_skip(bytes, bytes.len())?;
        // The format says zlib; some writers put a gzip stream there.
        let inflate = if is_gzip(source) { gunzip } else { unzlib };
        Ok(Cow::Owned(inflate(FORMAT, source, size.saturating_add(MAX_PADDING))?))
    }

    /// Returns the bytes of `source` after the number of bytes that the header says to skip (`HeaderSize`); if that is
    /// -1, the last `size` bytes.
    fn after_skip<'a>(&self, source: &'a [u8], size: usize) -> Result<&'a [u8], FormatError> {
        let skip = self.skip.unwrap_or_else(|| source.len().saturating_sub(size));
        source.get(skip..).ok_or_else(|| FormatError::truncated(FORMAT, "HeaderSize", skip, source.len()))
    }
}

/// Returns an error if the file declares an object other than an image.
fn check_object(fields: &Fields) -> Result<(), FormatError> {
    match fields.get("ObjectType").filter(|field| field.text != "Image") {
        Some(field) => {
            Err(FormatError::unsupported(FORMAT, field.name, format!("'{}'", field.text), "Image"))
        }
        None => Ok(()),
    }
}

/// Returns the colours of voxels with several channels, `None` if there is one; an error unless these are red, green,
/// blue and perhaps opacity, as bytes.
fn colours(fields: &Fields, scalar: Scalar) -> Result<Option<Colours>, FormatError> {
    let Some(field) = fields.get("ElementNumberOfChannels") else { return Ok(None) };
    match field.text {
        "1" => Ok(None),
        "3" if scalar == Scalar::U8 => Ok(Some(Colours::interleaved(3))),
        "4" if scalar == Scalar::U8 => Ok(Some(Colours::interleaved(4))),
        other => {
            let accepted = "1, or 3 or 4 of MET_UCHAR, which are colours";
            Err(FormatError::unsupported(FORMAT, field.name, format!("'{other}'"), accepted))
        }
    }
}

/// Returns a warning about a sequence of slices, such as the frames of an ultrasound probe, whose third axis counts them.
fn sequence_warning(fields: &Fields, rank: usize) -> Option<Warning> {
    let text = "The file is a sequence of images (Seq_Frame…). They are read as the slices of a volume along the third axis, \
                whatever their positions and times.";
    (rank == 3 && fields.is_sequence).then(|| Warning::new(WarningCode::Reader, text))
}

/// Returns the number of axes of the image; an error unless it is 1 to 4.
fn rank(fields: &Fields) -> Result<usize, FormatError> {
    match fields.need("NDims")?.integer(1)? {
        n @ 1..=4 => Ok(n as usize),
        n => Err(FormatError::unsupported(FORMAT, "NDims", n.to_string(), "1 to 4")),
    }
}

/// Returns the number type of the voxels, which the field `ElementType` names.
fn scalar(field: &Field<'_>) -> Result<Scalar, FormatError> {
    Ok(match field.text {
        "MET_CHAR" => Scalar::I8,
        "MET_UCHAR" => Scalar::U8,
        "MET_SHORT" => Scalar::I16,
        "MET_USHORT" => Scalar::U16,
        // The format's LONG has four bytes on every machine.
        "MET_INT" | "MET_LONG" => Scalar::I32,
        "MET_UINT" | "MET_ULONG" => Scalar::U32,
        "MET_LONG_LONG" => Scalar::I64,
        "MET_ULONG_LONG" => Scalar::U64,
        "MET_FLOAT" => Scalar::F32,
        "MET_DOUBLE" => Scalar::F64,
        other => {
            let accepted =
                "MET_CHAR, SHORT, INT, LONG, LONG_LONG and their unsigned variants, MET_FLOAT, MET_DOUBLE";
            return Err(FormatError::unsupported(FORMAT, "ElementType", format!("'{other}'"), accepted));
        }
    })
}

/// Returns the number of bytes before the voxels from `HeaderSize`, 0 if it is missing; `None` for -1, which means that
/// the voxels are the last bytes.
fn skip(fields: &Fields) -> Result<Option<usize>, FormatError> {
    let Some(field) = fields.get("HeaderSize") else { return Ok(Some(0)) };
    if field.integer(-1)? == -1 { Ok(None) } else { Ok(Some(field.offset()?)) }
}

/// Returns the transform from voxel indices to world space (LPS) of an image with these numbers of voxels. A single slice
/// without a thickness has one of 1, with a warning.
fn affine(fields: &Fields, sizes: &[usize], warnings: &mut Vec<Warning>) -> Result<DAffine3, FormatError> {
    let rank = sizes.len();
    let mut columns = axes(fields, rank)?;
    if let Some(field) = fields.any(&["ElementSpacing", "ElementSize"]) {
        for (axis, (column, spacing)) in columns.iter_mut().zip(field.finite_first(rank)?).enumerate() {
            if spacing == 0.0 && sizes[axis] == 1 {
                warnings.push(thickness_warning(axis));
            } else {
                *column *= spacing;
            }
        }
    }
    let mut origin = [0.0; 3];
    if let Some(field) = fields.any(&["Offset", "Position", "Origin"]) {
        origin.iter_mut().zip(field.finite_first(rank)?).for_each(|(o, v)| *o = v);
    }
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(columns[0], columns[1], columns[2]), origin.into()))
}

/// Returns the directions of the image's axes, which are the rows of `TransformMatrix`; the world axes if the header
/// has no matrix, and in place of axes that the image does not have.
fn axes(fields: &Fields, rank: usize) -> Result<[DVec3; 3], FormatError> {
    let mut columns = [DVec3::X, DVec3::Y, DVec3::Z];
    let Some(field) = fields.any(&["TransformMatrix", "Rotation", "Orientation"]) else { return Ok(columns) };
    let (matrix, width) = square(&field, rank)?;
    for (column, row) in columns.iter_mut().zip(matrix.chunks(width)).take(rank) {
        let mut direction = [0.0; 3];
        direction.iter_mut().zip(row).take(rank).for_each(|(d, &v)| *d = v);
        *column = direction.into();
    }
    Ok(columns)
}

/// Returns the numbers of a matrix with at least `rank` rows, and the length of its rows.
fn square(field: &Field<'_>, rank: usize) -> Result<(Vec<f64>, usize), FormatError> {
    let count = field.text.split_whitespace().count();
    let width = (rank..=MOST_ROWS).find(|width| width * width == count).unwrap_or(rank);
    Ok((field.finite(width * width)?, width))
}

/// Largest number of rows of a matrix, whatever the number of axes.
const MOST_ROWS: usize = 4;

/// Returns the unit of length that `DistanceUnits` names; unknown if volumes do not have it, or if the field is missing.
fn unit(fields: &Fields) -> LengthUnit {
    let named = fields.get("DistanceUnits").and_then(|field| metres(field.text));
    named.map_or(LengthUnit::Unknown, unit_of)
}
