//! Reader and writer of NRRD.
//!
//! Versions 1 to 5 are read, with header and voxels in one file, or the voxels in a data file of their own. Up to three
//! axes are spatial; one more, at any position among them, may count frames. Vectors and colours per voxel are rejected.
//! Encodings: raw, text, hex, gzip. The space left-posterior-superior stays LPS; right-anterior-superior is RAS;
//! left-anterior-superior becomes RAS by the sign of x; in other spaces, or if none is named, coordinates are kept and
//! treated as RAS. Lengths stay in the file's unit, given by [`Volume::unit`]. Without directions, axes have the lengths
//! in `spacings`, or 1 if `spacings` are unknown, too. The files of a list of data files are concatenated in order.

mod axes;
mod axis;
mod fields;
mod frames;
#[cfg(test)]
mod tests;
mod world;
mod writer;

use super::FormatError;
use super::gzip::gunzip;
use super::raw::{FieldName, MAX_PADDING, Scalar, decode, decode_text, payload, payload_size, volume_error};
use super::text::{Field, Lines};
use crate::math::DAffine3;
use crate::volume::{LengthUnit, Space, Volume, VolumeInit, Voxels};
use axes::Axes;
use fields::Fields;
use frames::deinterleave_frames;
pub(super) use writer::write;

const FORMAT: &str = "NRRD";
const DATA: FieldName = FieldName { format: FORMAT, field: "voxel data" };

/// Returns whether the bytes start with the signature of NRRD, to detect the format.
pub(super) fn is_nrrd(bytes: &[u8]) -> bool {
    bytes.starts_with(b"NRRD")
}

/// Reads an NRRD volume; `detached` is the content of the data file, if the header refers to one.
///
/// # Errors
/// [`FormatError`] that names the header field at fault.
pub(super) fn parse(bytes: &[u8], detached: Option<&[u8]>) -> Result<Volume, FormatError> {
    let mut lines = Lines::new(bytes);
    let fields = Fields::read(&mut lines)?;
    let header = Header::check(&fields)?;
    let source = match (fields.get("datafile"), detached) {
        (None, _) => lines.rest(),
        (Some(_), Some(payload)) => payload,
        (Some(file), None) => {
            return Err(file.invalid("the voxels are in another file; pass its bytes as `data`"));
        }
    };
    header.volume(source)
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
    /// Number of voxels along x, y and z, and of frames.
    dims: [usize; 4],
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
}

impl Header {
    /// Converts all fields of the header and checks them for consistency.
    fn check(fields: &Fields) -> Result<Self, FormatError> {
        let scalar = scalar(&fields.need("type")?)?;
        let encoding = encoding(&fields.need("encoding")?)?;
        let axes = Axes::read(fields)?;
        Ok(Self {
            scalar,
            dims: axes.dims(),
            run: axes.run(),
            encoding,
            big: big_endian(fields, scalar, encoding)?,
            line_skip: fields.get("lineskip").map_or(Ok(0), |f| f.offset())?,
            byte_skip: byte_skip(fields, encoding)?,
            affine: axes.affine(),
            space: axes.space(),
            unit: axes.unit(),
            frame_seconds: axes.frame_seconds(),
        })
    }

    /// Returns the volume that the header describes, with its voxels read from `source`: the bytes after the header, or
    /// the data file.
    fn volume(&self, source: &[u8]) -> Result<Volume, FormatError> {
        let voxels = self.voxels(self.after_lines(source)?)?;
        let volume = Volume::new(VolumeInit {
            affine: self.affine,
            frame_seconds: self.frame_seconds,
            space: self.space,
            ..VolumeInit::new(deinterleave_frames(voxels, self.run, self.dims[3])?, self.dims)
        });
        Ok(volume.map_err(|error| volume_error(FORMAT, error))?.with_unit(self.unit))
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

    /// Decodes the voxels from `source`, the bytes after the lines that the header says to skip.
    fn voxels(&self, source: &[u8]) -> Result<Voxels, FormatError> {
        let size = payload_size(DATA, self.dims, self.scalar)?;
        let count = size / self.scalar.size();
        match self.encoding {
            Encoding::Raw => self.binary(source, size),
            Encoding::Gzip => {
                let limit = size.saturating_add(self.byte_skip.unwrap_or(0)).saturating_add(MAX_PADDING);
                self.binary(&gunzip(FORMAT, source, limit)?, size)
            }
            Encoding::Hex => self.binary(&unhex(self.after_bytes(source, size)?, size)?, size),
            Encoding::Text => decode_text(DATA, self.after_bytes(source, size)?, self.scalar, count),
        }
    }

    /// Decodes the voxels from binary data, after skipping the bytes that the header says to skip (in hex, they were
    /// skipped before conversion to binary); `size` is the number of bytes of the voxels.
    fn binary(&self, bytes: &[u8], size: usize) -> Result<Voxels, FormatError> {
        let skipped = if self.encoding == Encoding::Hex { bytes } else { self.after_bytes(bytes, size)? };
        decode(DATA, payload(DATA, skipped, size)?, self.scalar, self.big)
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
