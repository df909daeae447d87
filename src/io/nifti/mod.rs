//! Reader of NIfTI-1 and NIfTI-2: single files (.nii, .nii.gz) and pairs (.hdr with the voxels in an .img of
//! their own).
//!
//! World space is RAS. The affine is the sform if its code is positive, else the qform if its code is positive, else
//! the voxel sizes with the first voxel at the origin (methods 3, 2 and 1 of the standard). Lengths stay in the file's
//! unit, given by [`Volume::unit`]. A slope of 0 or NaN means that stored numbers are intensities. The time between
//! frames is `pixdim[4]` in the file's time unit, or in seconds if it names none.

use super::FormatError;
use super::gzip::{gunzip, gunzip_start, is_gzip};
use super::raw::{FieldName, MAX_PADDING, Scalar, decode, payload, payload_size, volume_error};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::volume::{LengthUnit, Space, Volume, VolumeInit};

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

/// Reads a NIfTI volume; `detached` is the .img file of a pair. Either file may be gzipped.
///
/// # Errors
/// [`FormatError`] that names the header field at fault.
pub(super) fn parse(bytes: &[u8], detached: Option<&[u8]>) -> Result<Volume, FormatError> {
    let start = if is_gzip(bytes) {
        gunzip_start(FORMAT, bytes, HEADER_ROOM)?
    } else {
        bytes.iter().take(HEADER_ROOM).copied().collect()
    };
    let fields = Fields::read(&start)?;
    let header = Header::check(&fields)?;
    let (source, offset) = match (header.pair, detached) {
        (false, _) => (bytes, header.offset),
        (true, Some(image)) => (image, header.offset),
        (true, None) => {
            return Err(FormatError::invalid(
                FORMAT,
                "magic",
                "this is the header of a pair; pass the bytes of its .img as `data`",
            ));
        }
    };
    let size = payload_size(DATA, header.dims, header.scalar)?;
    let end =
        offset.checked_add(size).ok_or_else(|| FormatError::too_large(FORMAT, "vox_offset", u64::MAX))?;
    if is_gzip(source) {
        let whole = gunzip(FORMAT, source, end.saturating_add(MAX_PADDING))?;
        return header.volume(&whole, offset, size);
    }
    header.volume(source, offset, size)
}

/// The bytes of a NIfTI header and their byte order.
struct Bytes<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl Bytes<'_> {
    /// Returns the `N` bytes of a number at `offset`, in little-endian order. The header's length has been checked, so
    /// none is missing.
    fn at<const N: usize>(&self, offset: usize) -> [u8; N] {
        let mut out = [0; N];
        if let Some(part) = self.bytes.get(offset..offset + N) {
            out.copy_from_slice(part);
        }
        if self.big {
            out.reverse();
        }
        out
    }
    fn i16(&self, offset: usize) -> i64 {
        i16::from_le_bytes(self.at(offset)).into()
    }
    fn i32(&self, offset: usize) -> i64 {
        i32::from_le_bytes(self.at(offset)).into()
    }
    fn i64(&self, offset: usize) -> i64 {
        i64::from_le_bytes(self.at(offset))
    }
    fn f32(&self, offset: usize) -> f64 {
        f32::from_le_bytes(self.at(offset)).into()
    }
    fn f64(&self, offset: usize) -> f64 {
        f64::from_le_bytes(self.at(offset))
    }
}

/// The fields of a NIfTI-1 or NIfTI-2 header that the reader uses, as stored.
struct Fields {
    version: u8,
    big: bool,
    magic: [u8; 4],
    dim: [i64; 8],
    datatype: i64,
    bitpix: i64,
    pixdim: [f64; 8],
    vox_offset: f64,
    slope: f64,
    intercept: f64,
    units: i64,
    qform_code: i64,
    sform_code: i64,
    quaternion: [f64; 3],
    qoffset: [f64; 3],
    srow: [[f64; 4]; 3],
}

impl Fields {
    /// Reads the fields of a NIfTI-1 or NIfTI-2 header from the first bytes of a file.
    fn read(bytes: &[u8]) -> Result<Self, FormatError> {
        let cut = |needed| FormatError::truncated(FORMAT, "header", needed, bytes.len());
        let four = *bytes.first_chunk().ok_or_else(|| cut(SIZE_1))?;
        let Some((version, big)) = version(four) else {
            return Err(FormatError::invalid(
                FORMAT,
                "sizeof_hdr",
                format!("{four:?} is neither 348 nor 540"),
            ));
        };
        let size = if version == 1 { SIZE_1 } else { SIZE_2 };
        if bytes.len() < size {
            return Err(cut(size));
        }
        let bytes = Bytes { bytes, big };
        Ok(if version == 1 { Self::version_1(&bytes) } else { Self::version_2(&bytes) })
    }

    fn version_1(b: &Bytes<'_>) -> Self {
        Self {
            version: 1,
            big: b.big,
            magic: [344, 345, 346, 347].map(|at| b.bytes[at]),
            dim: std::array::from_fn(|i| b.i16(40 + 2 * i)),
            datatype: b.i16(70),
            bitpix: b.i16(72),
            pixdim: std::array::from_fn(|i| b.f32(76 + 4 * i)),
            vox_offset: b.f32(108),
            slope: b.f32(112),
            intercept: b.f32(116),
            units: b.bytes[123].into(),
            qform_code: b.i16(252),
            sform_code: b.i16(254),
            quaternion: [256, 260, 264].map(|at| b.f32(at)),
            qoffset: [268, 272, 276].map(|at| b.f32(at)),
            srow: [280, 296, 312].map(|at| std::array::from_fn(|i| b.f32(at + 4 * i))),
        }
    }

    fn version_2(b: &Bytes<'_>) -> Self {
        Self {
            version: 2,
            big: b.big,
            magic: [4, 5, 6, 7].map(|at| b.bytes[at]),
            dim: std::array::from_fn(|i| b.i64(16 + 8 * i)),
            datatype: b.i16(12),
            bitpix: b.i16(14),
            pixdim: std::array::from_fn(|i| b.f64(104 + 8 * i)),
            vox_offset: b.i64(168) as f64,
            slope: b.f64(176),
            intercept: b.f64(184),
            units: b.i32(500),
            qform_code: b.i32(344),
            sform_code: b.i32(348),
            quaternion: [352, 360, 368].map(|at| b.f64(at)),
            qoffset: [376, 384, 392].map(|at| b.f64(at)),
            srow: [400, 432, 464].map(|at| std::array::from_fn(|i| b.f64(at + 8 * i))),
        }
    }

    /// Returns whether the voxels are in a file separate from the header; an error if the magic bytes are unknown.
    fn is_pair(&self) -> Result<bool, FormatError> {
        match (&self.magic, self.version) {
            (b"n+1\0", 1) | (b"n+2\0", 2) => Ok(false),
            (b"ni1\0", 1) | (b"ni2\0", 2) => Ok(true),
            (b"\0\0\0\0", 1) => Err(FormatError::unsupported(
                FORMAT,
                "magic",
                "an Analyze 7.5 header",
                "'n+1', 'ni1', 'n+2', 'ni2'",
            )),
            (other, _) => {
                let shown = String::from_utf8_lossy(other).escape_debug().to_string();
                Err(FormatError::invalid(
                    FORMAT,
                    "magic",
                    format!("must be one of 'n+1', 'ni1', 'n+2', 'ni2', got '{shown}'"),
                ))
            }
        }
    }

    /// Returns the number of voxels along x, y and z, and the number of frames; an error if an axis after the fourth
    /// has more than one entry.
    fn dims(&self) -> Result<[usize; 4], FormatError> {
        let rank = self.dim[0];
        if !(1..=7).contains(&rank) {
            return Err(FormatError::invalid(FORMAT, "dim[0]", format!("must be 1 to 7, got {rank}")));
        }
        let mut dims = [1; 4];
        for axis in 1..=rank as usize {
            let n = self.dim[axis];
            let field = format!("dim[{axis}]");
            match usize::try_from(n) {
                Ok(n) if n >= 1 && axis <= 4 => dims[axis - 1] = n,
                Ok(1) => {}
                Ok(n) if n > 1 => {
                    return Err(FormatError::unsupported(FORMAT, field, n.to_string(), "1 (no vector data)"));
                }
                Err(_) if n > 0 => return Err(FormatError::too_large(FORMAT, field, n as u64)),
                _ => return Err(FormatError::invalid(FORMAT, field, format!("must be at least 1, got {n}"))),
            }
        }
        Ok(dims)
    }

    /// Returns the number type of the voxels; an error if it is not supported or contradicts the stated number of bits.
    fn scalar(&self) -> Result<Scalar, FormatError> {
        let scalar = match self.datatype {
            2 => Scalar::U8,
            4 => Scalar::I16,
            8 => Scalar::I32,
            16 => Scalar::F32,
            64 => Scalar::F64,
            256 => Scalar::I8,
            512 => Scalar::U16,
            768 => Scalar::U32,
            1024 => Scalar::I64,
            1280 => Scalar::U64,
            code => return Err(unsupported_datatype(code)),
        };
        if self.bitpix == 8 * scalar.size() as i64 {
            return Ok(scalar);
        }
        let problem = format!("{} bits, datatype {} has {}", self.bitpix, self.datatype, 8 * scalar.size());
        Err(FormatError::invalid(FORMAT, "bitpix", problem))
    }

    /// Returns the offset of the voxels from the start of their file, in bytes. In a single file (not a `pair`), a
    /// stored 0 means the end of the header.
    fn offset(&self, pair: bool) -> Result<usize, FormatError> {
        let least = if self.version == 1 { 352 } else { 544 };
        let stated = self.vox_offset;
        let whole = (0.0..=MAX_OFFSET).contains(&stated) && stated == libm::trunc(stated);
        match (whole, pair) {
            (true, true) => Ok(stated as usize),
            (true, false) if stated == 0.0 => Ok(least),
            (true, false) if stated >= least as f64 => Ok(stated as usize),
            _ => {
                let problem = format!("must be an integer from {least} to {MAX_OFFSET}, got {stated}");
                Err(FormatError::invalid(FORMAT, "vox_offset", problem))
            }
        }
    }

    /// Returns slope and intercept, by which stored values become intensities; 1 and 0 if the stored slope is 0 or NaN.
    fn scaling(&self) -> Result<(f64, f64), FormatError> {
        if self.slope == 0.0 || self.slope.is_nan() {
            return Ok((1.0, 0.0));
        }
        if self.slope.is_finite() && self.intercept.is_finite() {
            return Ok((self.slope, self.intercept));
        }
        let (field, value) =
            if self.slope.is_finite() { ("scl_inter", self.intercept) } else { ("scl_slope", self.slope) };
        Err(FormatError::invalid(FORMAT, field, format!("must be finite, got {value}")))
    }

    /// Returns the transform from voxel indices to world space: the sform if the file has one, else the qform, else a
    /// scaling by the voxel sizes.
    fn affine(&self) -> Result<DAffine3, FormatError> {
        if self.sform_code > 0 {
            return self.sform();
        }
        if self.qform_code > 0 {
            return self.qform();
        }
        Ok(DAffine3::from_scale(DVec3::from(self.voxel_sizes()?)))
    }

    /// Returns the affine that the file stores as a matrix (sform).
    fn sform(&self) -> Result<DAffine3, FormatError> {
        for (row, name) in self.srow.iter().zip(["srow_x", "srow_y", "srow_z"]) {
            if row.iter().any(|v| !v.is_finite()) {
                return Err(FormatError::invalid(FORMAT, name, format!("must be finite, got {row:?}")));
            }
        }
        let column = |i: usize| DVec3::new(self.srow[0][i], self.srow[1][i], self.srow[2][i]);
        let matrix = DMat3::from_cols(column(0), column(1), column(2));
        Ok(DAffine3::from_mat3_translation(matrix, column(3)))
    }

    /// Returns the affine that the file stores as a quaternion (qform): scaling by the voxel sizes, rotation by the
    /// quaternion (a, b, c, d) with a ≥ 0, then translation. A negative `pixdim[0]` flips z.
    fn qform(&self) -> Result<DAffine3, FormatError> {
        let finite = |field: &str, values: [f64; 3]| {
            if values.iter().all(|v| v.is_finite()) {
                return Ok(values);
            }
            Err(FormatError::invalid(FORMAT, field, format!("must be finite, got {values:?}")))
        };
        let [b, c, d] = finite("quatern_b, c, d", self.quaternion)?;
        let origin = finite("qoffset_x, y, z", self.qoffset)?;
        let rest = 1.0 - (b * b + c * c + d * d);
        if rest < -QUATERNION_TOLERANCE {
            let problem = format!("{:?} is longer than 1", self.quaternion);
            return Err(FormatError::invalid(FORMAT, "quatern_b, c, d", problem));
        }
        let a = if rest > 0.0 { rest.sqrt() } else { 0.0 };
        let rotation = DMat3::from_quat(glam::DQuat::from_xyzw(b, c, d, a).normalize());
        let mut sizes = self.voxel_sizes()?;
        if self.pixdim[0] < 0.0 {
            sizes[2] = -sizes[2];
        }
        Ok(DAffine3::from_mat3_translation(rotation * DMat3::from_diagonal(sizes.into()), origin.into()))
    }

    /// Returns the absolute voxel sizes along x, y and z; 1 along axes that the file does not have.
    fn voxel_sizes(&self) -> Result<[f64; 3], FormatError> {
        let mut sizes = [1.0; 3];
        for (axis, size) in sizes.iter_mut().enumerate().filter(|(axis, _)| (*axis as i64) < self.dim[0]) {
            *size = self.pixdim[axis + 1].abs();
            if !(*size > 0.0 && size.is_finite()) {
                let problem = format!("must be finite and not 0, got {}", self.pixdim[axis + 1]);
                return Err(FormatError::invalid(FORMAT, format!("pixdim[{}]", axis + 1), problem));
            }
        }
        Ok(sizes)
    }

    /// Returns the seconds between frames; 0 if there is only one frame, `pixdim[4]` is not positive, or the fourth
    /// axis is not time. Without a unit of time, `pixdim[4]` is in seconds.
    fn frame_seconds(&self, frames: usize) -> Result<f64, FormatError> {
        let step = self.pixdim[4];
        if frames < 2 {
            return Ok(0.0);
        }
        if !step.is_finite() {
            return Err(FormatError::invalid(FORMAT, "pixdim[4]", format!("must be finite, got {step}")));
        }
        let second = match self.units & 0x38 {
            0 | 8 => 1.0,
            16 => 1e-3,
            24 => 1e-6,
            _ => 0.0,
        };
        Ok(if step > 0.0 { step * second } else { 0.0 })
    }

    /// Returns the unit of length of the world space; unknown if the file gives none.
    fn unit(&self) -> LengthUnit {
        match self.units & 7 {
            1 => LengthUnit::Metre,
            2 => LengthUnit::Millimetre,
            3 => LengthUnit::Micrometre,
            _ => LengthUnit::Unknown,
        }
    }
}

/// Largest accepted offset of the voxels from the start of their file, in bytes. A NIfTI-1 header stores the offset as
/// `f32`, which cannot represent every larger integer, and no header extension is as long.
const MAX_OFFSET: f64 = 16_777_216.0;
/// Tolerance by which the squared length of the stored part (b, c, d) of a unit quaternion may exceed 1 through
/// rounding in `f32`; longer ones are rejected.
const QUATERNION_TOLERANCE: f64 = 1e-5;

/// Returns the error about a NIfTI datatype that is not supported, with the name of the type.
fn unsupported_datatype(code: i64) -> FormatError {
    let name = match code {
        1 => "binary",
        32 => "complex64",
        128 => "RGB24",
        1536 => "float128",
        1792 => "complex128",
        2048 => "complex256",
        2304 => "RGBA32",
        _ => "no known type",
    };
    FormatError::unsupported(
        FORMAT,
        "datatype",
        format!("{code} ({name})"),
        "integers of 8 to 64 bits, float32, float64",
    )
}

/// The content of a NIfTI header, checked for consistency.
struct Header {
    pair: bool,
    big: bool,
    dims: [usize; 4],
    scalar: Scalar,
    offset: usize,
    slope: f64,
    intercept: f64,
    affine: DAffine3,
    frame_seconds: f64,
    unit: LengthUnit,
}

impl Header {
    /// Checks the header fields for consistency and converts them.
    fn check(fields: &Fields) -> Result<Self, FormatError> {
        let pair = fields.is_pair()?;
        let dims = fields.dims()?;
        let (slope, intercept) = fields.scaling()?;
        Ok(Self {
            pair,
            big: fields.big,
            dims,
            scalar: fields.scalar()?,
            offset: fields.offset(pair)?,
            slope,
            intercept,
            affine: fields.affine()?,
            frame_seconds: fields.frame_seconds(dims[3])?,
            unit: fields.unit(),
        })
    }

    /// Returns the volume that the header describes, with its voxels decoded from the `size` bytes of `source` from
    /// `offset`.
    fn volume(&self, source: &[u8], offset: usize, size: usize) -> Result<Volume, FormatError> {
        let Some(rest) = source.get(offset..) else {
            return Err(FormatError::truncated(
                FORMAT,
                "voxel data",
                offset.saturating_add(size),
                source.len(),
            ));
        };
        let payload = payload(DATA, rest, size)?;
        let volume = Volume::new(VolumeInit {
            voxels: decode(DATA, payload, self.scalar, self.big)?,
            dims: self.dims,
            affine: self.affine,
            slope: self.slope,
            intercept: self.intercept,
            frame_seconds: self.frame_seconds,
            space: Space::Ras,
        });
        Ok(volume.map_err(|error| volume_error(FORMAT, error))?.with_unit(self.unit))
    }
}
