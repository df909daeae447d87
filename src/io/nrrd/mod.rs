//! Reader and writer of NRRD.
//!
//! Versions 1 to 5 are read, with header and voxels in one file, or the voxels in one or several files of their own, each
//! with the same number of them. Up to three axes are spatial; one more, at any position among them, may count frames, or
//! hold colours, of which the luminance is read. Other vectors per voxel are rejected. Encodings: raw, text, hex, gzip.
//!
//! The space left-posterior-superior stays LPS; right-anterior-superior is RAS; left-anterior-superior becomes RAS by the
//! sign of x. In other spaces, or if none is named, coordinates are kept, and treated as those of the caller's choice, or
//! as LPS, as in ITK; with a warning, unless the file is one of ITK, which does not name the space of images of two and
//! four dimensions. Lengths stay in the file's unit, given by [`Volume::unit`]. Without directions, axes have the lengths
//! in `spacings`, or 1 if `spacings` are unknown, too, and the space is RAS, without a warning: it is no more than a name
//! then.

mod axes;
mod axis;
mod fields;
mod frames;
#[cfg(test)]
mod tests;
mod world;
mod writer;

use super::beside::{DataFiles, Series, pattern_and_numbers};
use super::colour::{Colours, luminance_of};
use super::gzip::gunzip;
use super::raw::{FieldName, MAX_PADDING, Scalar, decode, decode_text, payload, payload_size, volume_of};
use super::source::Source;
use super::text::{Field, Lines};
use super::{FormatError, VolumeOptions};
use crate::math::DAffine3;
use crate::volume::{LengthUnit, Space, Volume, VolumeInit, Voxels};
use crate::warning::Warning;
use axes::Axes;
use fields::Fields;
use frames::deinterleave_frames;
use std::borrow::Cow;
pub(super) use writer::write;

const FORMAT: &str = "NRRD";
const DATA: FieldName = FieldName { format: FORMAT, field: "voxel data" };

/// Returns whether the bytes start with the signature of NRRD, to detect the format.
pub(super) fn is_nrrd(bytes: &[u8]) -> bool {
    bytes.starts_with(b"NRRD")
}

/// Reads an NRRD volume, with the files beside it if its header refers to any.
///
/// # Errors
/// [`FormatError`] that names the header field at fault.
pub(super) fn parse(bytes: &[u8], options: &VolumeOptions<'_>) -> Result<Volume, FormatError> {
    let mut lines = Lines::new(FORMAT, bytes);
    let fields = Fields::read(&mut lines)?;
    let header = Header::check(&fields, options.space)?;
    match fields.get("datafile") {
        None => header.volume(&Source::Bytes(lines.rest())),
        Some(file) => header.volume(&options.source(&file, || data_files(&file, lines, &header.sizes))?),
    }
}

/// Returns the data files that the field `data file` names, with the lines after it and the sizes of the axes.
fn data_files(file: &Field<'_>, mut lines: Lines<'_>, sizes: &[usize]) -> Result<DataFiles, FormatError> {
    if let Some(rank) = list_rank(file.text) {
        return check_count(file, lines.names(file)?, rank, sizes);
    }
    match pattern_and_numbers(file.text) {
        Some((pattern, numbers)) if numbers.len() >= 3 => {
            let series = Series::parse(pattern, numbers[0], numbers[1], numbers[2]);
            let series = series.filter(|_| numbers.len() <= 4).map(DataFiles::Series);
            let series = series.ok_or_else(|| file.invalid("must be like 's%03d.raw 1 20 1'"))?;
            check_count(file, series, numbers.get(3).copied(), sizes)
        }
        _ => Ok(DataFiles::Names(vec![file.text.to_owned()])),
    }
}

/// Returns the number of axes that the files of a list have, if the list says it; `None` if it does not name a list.
fn list_rank(text: &str) -> Option<Option<i64>> {
    let rank = text.strip_prefix("LIST").filter(|rank| !rank.starts_with(|c: char| !c.is_whitespace()))?;
    if rank.is_empty() { Some(None) } else { rank.trim().parse().ok().map(Some) }
}

/// Returns the data files; an error if each has a number of axes by which there must be another number of files.
fn check_count(
    file: &Field<'_>,
    files: DataFiles,
    rank: Option<i64>,
    sizes: &[usize],
) -> Result<DataFiles, FormatError> {
    let Some(rank) = rank else { return Ok(files) };
    let rank = usize::try_from(rank).ok().filter(|rank| (1..=sizes.len()).contains(rank));
    let rank =
        rank.ok_or_else(|| file.invalid("the files must have as many axes as the volume, or fewer"))?;
    // Files of as many axes as the volume are slabs of it.
    let expected = sizes[rank..].iter().fold(1, |product: u64, &n| product.saturating_mul(n as u64));
    if rank == sizes.len() || expected == files.count() {
        return Ok(files);
    }
    let problem = format!("{} files of {rank} axes; the sizes call for {expected}", files.count());
    Err(file.invalid(&problem))
}

/// Encoding of the voxels in an NRRD.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Raw,
    Text,
    Hex,
    Gzip,
}

/// The content of an NRRD header, checked for consistency.
struct Header {
    scalar: Scalar,
    /// Sizes of all axes, in the order of the file.
    sizes: Vec<usize>,
    /// Number of voxels along x, y and z, and of frames.
    dims: [usize; 4],
    colours: Option<Colours>,
    /// Number of consecutive numbers in the file that belong to the same frame; the voxels are reordered by it.
    run: usize,
    encoding: Encoding,
    big: bool,
    line_skip: usize,
    /// Number of bytes to skip before the voxels; `None` (-1 in the file) if the voxels are the last bytes.
    byte_skip: Option<usize>,
    affine: DAffine3,
    space: Space,
    unit: LengthUnit,
    frame_seconds: f64,
    warnings: Vec<Warning>,
}

impl Header {
    /// Converts all fields of the header and checks them for consistency; `space` is that of files that name none.
    fn check(fields: &Fields, space: Option<Space>) -> Result<Self, FormatError> {
        let scalar = scalar(&fields.need("type")?)?;
        let encoding = encoding(&fields.need("encoding")?)?;
        let axes = Axes::read(fields, space)?;
        Ok(Self {
            scalar,
            sizes: axes.sizes().to_vec(),
            dims: axes.dims(),
            colours: axes.colours(),
            run: axes.run(),
            encoding,
            big: big_endian(fields, scalar, encoding)?,
            line_skip: fields.get("lineskip").map_or(Ok(0), |f| f.offset())?,
            byte_skip: byte_skip(fields, encoding)?,
            affine: axes.affine(),
            space: axes.space(),
            unit: axes.unit(),
            frame_seconds: axes.frame_seconds(),
            warnings: axes.warnings(),
        })
    }

    /// Returns the volume that the header describes, with its voxels read from `source`.
    fn volume(&self, source: &Source<'_>) -> Result<Volume, FormatError> {
        let numbers = self.numbers(source)?;
        let voxels = luminance_of(self.colours, numbers);
        let init = VolumeInit {
            affine: self.affine,
            frame_seconds: self.frame_seconds,
            space: self.space,
            ..VolumeInit::new(deinterleave_frames(voxels, self.run, self.dims[3])?, self.dims)
        };
        volume_of(FORMAT, init, self.unit, &self.warnings)
    }

    /// Returns the bytes of `source` after the number of lines that the header says to skip (`line skip`).
    fn after_lines<'a>(&self, source: &'a [u8]) -> Result<&'a [u8], FormatError> {
        let mut rest = source;
        for _ in 0..self.line_skip {
            let end = rest.iter().position(|&b| b == b'\n');
            let end =
                end.ok_or_else(|| FormatError::invalid(FORMAT, "line skip", "more lines than the file has"))?;
            rest = &rest[end + 1..];
        }
        Ok(rest)
    }

    /// Reads the numbers of the voxels from `source`.
    fn numbers(&self, source: &Source<'_>) -> Result<Voxels, FormatError> {
        let size = payload_size(DATA, self.dims, self.scalar)?;
        let size = self.colours.map_or(Ok(size), |colours| colours.size(FORMAT, size))?;
        let decoded = |bytes: Cow<'_, [u8]>| decode(DATA, bytes, self.scalar, self.big);
        let all = |bytes: &[u8]| match self.encoding {
            Encoding::Text => {
                let text = self.after_bytes(self.after_lines(bytes)?, size)?;
                decode_text(DATA, text, self.scalar, size / self.scalar.size())
            }
            _ => decoded(payload(DATA, self.binary(bytes, size)?, size)?),
        };
        source.voxels(FORMAT, size, all, |bytes, size| self.binary(bytes, size), decoded)
    }

    /// Returns the binary numbers in a file, `size` bytes if it has as many as the header says: those after the lines and
    /// bytes to skip, decoded from hex or inflated.
    fn binary<'a>(&self, bytes: &'a [u8], size: usize) -> Result<Cow<'a, [u8]>, FormatError> {
        let bytes = self.after_lines(bytes)?;
        match self.encoding {
            Encoding::Raw => Ok(Cow::Borrowed(self.after_bytes(bytes, size)?)),
            Encoding::Hex => Ok(Cow::Owned(unhex(self.after_bytes(bytes, size)?, size)?)),
            Encoding::Gzip => {
                let skip = self.byte_skip.unwrap_or(0);
                let limit = size.saturating_add(skip).saturating_add(MAX_PADDING);
                let mut whole = gunzip(FORMAT, bytes, limit)?;
                self.after_bytes(&whole, size)?;
                whole.drain(..skip);
                Ok(Cow::Owned(whole))
            }
            Encoding::Text => {
                Err(FormatError::unsupported(FORMAT, "encoding", "text in several files", "one file"))
            }
        }
    }

    /// Returns the bytes after the number of bytes that the header says to skip (`byte skip`); if that is -1, the last
    /// `size` bytes.
    fn after_bytes<'a>(&self, bytes: &'a [u8], size: usize) -> Result<&'a [u8], FormatError> {
        let skip = self.byte_skip.unwrap_or_else(|| bytes.len().saturating_sub(size));
        bytes.get(skip..).ok_or_else(|| FormatError::truncated(FORMAT, "byte skip", skip, bytes.len()))
    }
}

/// Returns the number type of the voxels, which the field `type` names.
fn scalar(field: &Field<'_>) -> Result<Scalar, FormatError> {
    let words: Vec<&str> = field.text.split_whitespace().collect();
    Ok(match words.join(" ").as_str() {
        "signed char" | "int8" | "int8_t" => Scalar::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
        "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => Scalar::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        other => {
            return Err(FormatError::unsupported(
                FORMAT,
                "type",
                format!("'{other}'"),
                "integers of 8 to 64 bits, float, double",
            ));
        }
    })
}

fn encoding(field: &Field<'_>) -> Result<Encoding, FormatError> {
    match field.text.to_ascii_lowercase().as_str() {
        "raw" => Ok(Encoding::Raw),
        "txt" | "text" | "ascii" => Ok(Encoding::Text),
        "hex" => Ok(Encoding::Hex),
        "gz" | "gzip" => Ok(Encoding::Gzip),
        other => {
            Err(FormatError::unsupported(FORMAT, "encoding", format!("'{other}'"), "raw, text, hex, gzip"))
        }
    }
}

/// Returns whether the voxels in the file are big-endian; false if the byte order does not matter, as for 8-bit numbers
/// and text.
fn big_endian(fields: &Fields, scalar: Scalar, encoding: Encoding) -> Result<bool, FormatError> {
    if scalar.size() == 1 || encoding == Encoding::Text {
        return Ok(false);
    }
    let field = fields.need("endian")?;
    match field.text.to_ascii_lowercase().as_str() {
        "big" => Ok(true),
        "little" => Ok(false),
        _ => Err(field.invalid("must be 'big' or 'little'")),
    }
}

/// Returns the number of bytes before the voxels from the field `byte skip`, 0 if it is missing; `None` for -1, which
/// means that the voxels are the last bytes, and is valid only in the raw encoding.
fn byte_skip(fields: &Fields, encoding: Encoding) -> Result<Option<usize>, FormatError> {
    let Some(field) = fields.get("byteskip") else { return Ok(Some(0)) };
    match field.integer(-1)? {
        -1 if encoding == Encoding::Raw => Ok(None),
        -1 => Err(field.invalid("-1 is only valid with encoding raw")),
        _ => Ok(Some(field.offset()?)),
    }
}

/// Decodes pairs of hexadecimal digits to bytes, ignoring whitespace; an error for any other character, or if there are
/// more bytes than `size` plus [`MAX_PADDING`].
fn unhex(text: &[u8], size: usize) -> Result<Vec<u8>, FormatError> {
    let digits = text.iter().filter(|b| !b.is_ascii_whitespace());
    let mut out = Vec::new();
    let mut high = None;
    for &digit in digits {
        let Some(value) = char::from(digit).to_digit(16) else {
            return Err(FormatError::invalid(
                FORMAT,
                "voxel data",
                "contains a character that is not a hexadecimal digit",
            ));
        };
        match high.take() {
            None => high = Some(value as u8),
            Some(first) => out.push(first << 4 | value as u8),
        }
        if out.len() > size.saturating_add(MAX_PADDING) {
            return Err(FormatError::invalid(
                FORMAT,
                "voxel data",
                format!("more than the {size} bytes the header accounts for"),
            ));
        }
    }
    Ok(out)
}
