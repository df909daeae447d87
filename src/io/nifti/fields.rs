//! The fields of NIfTI and Analyze headers, and what they mean one by one.

use super::{FORMAT, SIZE_1, SIZE_2, version, warning};
use crate::io::FormatError;
use crate::io::colour::Colours;
use crate::io::raw::Scalar;
use crate::volume::LengthUnit;
use crate::warning::Warning;

/// Where the voxels of a header are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Container {
    /// In the same file.
    Single,
    /// In an .img file.
    Pair,
    /// In an .img file, with a header of Analyze 7.5.
    Analyze,
}

/// The bytes of a header and their byte order.
pub(super) struct Bytes<'a> {
    pub(super) bytes: &'a [u8],
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
    pub(super) fn i16(&self, offset: usize) -> i64 {
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

/// The fields of a NIfTI-1, NIfTI-2 or Analyze header that the reader uses, as stored.
pub(super) struct Fields {
    version: u8,
    pub(super) big: bool,
    magic: [u8; 4],
    pub(super) dim: [i64; 8],
    datatype: i64,
    bitpix: i64,
    pub(super) pixdim: [f64; 8],
    vox_offset: f64,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    pub(super) units: i64,
    pub(super) qform_code: i64,
    pub(super) sform_code: i64,
    pub(super) quaternion: [f64; 3],
    pub(super) qoffset: [f64; 3],
    pub(super) srow: [[f64; 4]; 3],
    /// Index of the voxel at the origin, counted from 1, in Analyze files of SPM; 0 in others.
    pub(super) originator: [i64; 3],
}

impl Fields {
    /// Reads the fields of a header from the first bytes of a file.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, FormatError> {
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
        let fields = if version == 1 { Self::version_1(&bytes) } else { Self::version_2(&bytes) };
        Ok(if fields.is_analyze() { fields.of_analyze(&bytes) } else { fields })
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
            originator: [0; 3],
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
            originator: [0; 3],
        }
    }

    /// Returns where the voxels are; an error if the magic bytes are unknown.
    pub(super) fn container(&self) -> Result<Container, FormatError> {
        match (&self.magic, self.version) {
            (b"n+1\0", 1) | (b"n+2\0", 2) => Ok(Container::Single),
            (b"ni1\0", 1) | (b"ni2\0", 2) => Ok(Container::Pair),
            _ if self.is_analyze() => Ok(Container::Analyze),
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

    /// Returns whether the header is one of Analyze 7.5: where NIfTI-1 has its magic letters, it has a number.
    fn is_analyze(&self) -> bool {
        self.version == 1 && !self.magic[..3].iter().all(u8::is_ascii_graphic)
    }

    /// Returns the number of voxels along x, y and z, and the number of frames; an error if an axis after the fourth
    /// has more than one entry. After the third axis, 0 entries mean one, as in nifti_clib.
    pub(super) fn dims(&self) -> Result<[usize; 4], FormatError> {
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
                Ok(0 | 1) if axis > 3 => {}
                Ok(n) if n > 1 => {
                    return Err(FormatError::unsupported(FORMAT, field, n.to_string(), "1 (no vector data)"));
                }
                Err(_) if n > 0 => return Err(FormatError::too_large(FORMAT, field, n as u64)),
                _ => return Err(FormatError::invalid(FORMAT, field, format!("must be at least 1, got {n}"))),
            }
        }
        Ok(dims)
    }

    /// Returns the type of the numbers of the voxels, and how they are colours, if they are; an error if the type is not
    /// supported.
    pub(super) fn numbers(&self) -> Result<(Scalar, Option<Colours>), FormatError> {
        let scalar = match self.datatype {
            2 => Scalar::U8,
            4 => Scalar::I16,
            8 => Scalar::I32,
            16 => Scalar::F32,
            64 => Scalar::F64,
            128 => return Ok((Scalar::U8, Some(Colours::interleaved(3)))),
            256 => Scalar::I8,
            512 => Scalar::U16,
            768 => Scalar::U32,
            1024 => Scalar::I64,
            1280 => Scalar::U64,
            2304 => return Ok((Scalar::U8, Some(Colours::interleaved(4)))),
            code => return Err(unsupported_datatype(code)),
        };
        Ok((scalar, None))
    }

    /// Returns a warning if the number of bits is not that of the type of the voxels; 0 bits mean that it is not stated.
    pub(super) fn type_warnings(&self) -> Vec<Warning> {
        let Ok((scalar, colours)) = self.numbers() else { return Vec::new() };
        let bits = 8 * scalar.size() * colours.map_or(1, |colours| colours.channels);
        if self.bitpix == 0 || self.bitpix == bits as i64 {
            return Vec::new();
        }
        let (stated, datatype) = (self.bitpix, self.datatype);
        vec![warning(format!(
            "The header says that a voxel has {stated} bits (bitpix), but its datatype, {datatype}, has {bits}. The datatype was followed."
        ))]
    }

    /// Returns the offset of the voxels from the start of their file, in bytes. In a single file, a stored 0 means the end
    /// of the header.
    pub(super) fn offset(&self, container: Container) -> Result<usize, FormatError> {
        let least = if self.version == 1 { 352 } else { 544 };
        let stated = self.vox_offset;
        let whole = (0.0..=MAX_OFFSET).contains(&stated) && stated == libm::trunc(stated);
        match (whole, container != Container::Single) {
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
    pub(super) fn scaling(&self) -> Result<(f64, f64), FormatError> {
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

    /// Returns the seconds between frames; 0 if there is only one frame, `pixdim[4]` is not positive, or the fourth
    /// axis is not time. Without a unit of time, `pixdim[4]` is in seconds.
    pub(super) fn frame_seconds(&self, frames: usize) -> Result<f64, FormatError> {
        let step = self.pixdim[4];
        if frames < 2 {
            return Ok(0.0);
        }
        if !step.is_finite() {
            return Err(FormatError::invalid(FORMAT, "pixdim[4]", format!("must be finite, got {step}")));
        }
        let second = match self.units & 0x38 {
            // Analyze has no unit of time.
            _ if self.is_analyze() => 0.0,
            0 | 8 => 1.0,
            16 => 1e-3,
            24 => 1e-6,
            _ => 0.0,
        };
        Ok(if step > 0.0 { step * second } else { 0.0 })
    }

    /// Returns the unit of length of the world space; unknown if the file gives none.
    pub(super) fn unit(&self) -> LengthUnit {
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
/// Returns the error about a NIfTI datatype that is not supported, with the name of the type.
fn unsupported_datatype(code: i64) -> FormatError {
    let name = match code {
        1 => "binary",
        32 => "complex64",
        1536 => "float128",
        1792 => "complex128",
        2048 => "complex256",
        _ => "no known type",
    };
    FormatError::unsupported(
        FORMAT,
        "datatype",
        format!("{code} ({name})"),
        "integers of 8 to 64 bits, float32, float64, RGB24, RGBA32",
    )
}
