//! Detection of the format of a volume file from its bytes.

use super::gzip::{gunzip_start, is_gzip};
use super::mesh_file::known_format;
use super::{FormatError, VolumeOptions, metaimage, nifti, nrrd};
use crate::volume::Volume;

const ANY: &str = "volume file";
const ACCEPTED: &str = "NIfTI (.nii, .nii.gz, .hdr with .img), Analyze 7.5 (.hdr with .img), NRRD (.nrrd, .nhdr with data), MetaImage (.mha, .mhd with data)";
/// Number of bytes inflated from the start of a gzipped volume file to detect its format.
const START: usize = 512;

/// Reads a volume from a NIfTI file, which may be gzipped, or from an Analyze 7.5, NRRD or MetaImage file; the format is
/// detected from the bytes. `detached` is the content of the data file if the voxels are in a file separate from the
/// header in `bytes` (several data files are concatenated in order).
///
/// # Errors
/// [`FormatError`] with the format and the field; for an unsupported format, the error names the format if it is
/// recognised.
pub fn parse_volume(bytes: &[u8], detached: Option<&[u8]>) -> Result<Volume, FormatError> {
    parse_volume_with(bytes, &VolumeOptions { detached, ..VolumeOptions::default() })
}

/// Reads a volume like [`parse_volume`], with the files beside its header, or with a space for files that name none.
///
/// # Errors
/// As [`parse_volume`], and data files that are missing or of another size, by their names.
pub fn parse_volume_with(bytes: &[u8], options: &VolumeOptions<'_>) -> Result<Volume, FormatError> {
    if is_gzip(bytes) {
        let start = gunzip_start(ANY, bytes, START)?;
        if nifti::is_nifti(&start) {
            return nifti::parse(bytes, options);
        }
        if nrrd::is_nrrd(&start) || metaimage::is_metaimage(&start) {
            return Err(FormatError::unsupported(
                ANY,
                "gzip",
                "a whole NRRD or MetaImage in gzip",
                "the file unpacked",
            ));
        }
        return Err(unsupported_format(&start));
    }
    // A mark that text editors set at the start of a header.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if nifti::is_nifti(bytes) {
        nifti::parse(bytes, options)
    } else if nrrd::is_nrrd(bytes) {
        nrrd::parse(bytes, options)
    } else if metaimage::is_metaimage(bytes) {
        metaimage::parse(bytes, options)
    } else {
        Err(unsupported_format(bytes))
    }
}

/// Returns the error for a file of no accepted format, which names the format if its first bytes identify it.
fn unsupported_format(bytes: &[u8]) -> FormatError {
    if bytes.is_empty() {
        return FormatError::truncated(ANY, "signature", 4, 0);
    }
    FormatError::unsupported(ANY, "signature", signature(bytes), ACCEPTED)
}

/// Returns the name of the unsupported volume format that the first bytes of a file identify, for the error message;
/// "an unknown signature" if they identify none.
fn signature(bytes: &[u8]) -> &'static str {
    let at = |offset: usize, mark: &[u8]| bytes.get(offset..).is_some_and(|rest| rest.starts_with(mark));
    let line = |mark: &[u8]| bytes.trim_ascii_start().starts_with(mark);
    match () {
        () if at(0, &[0, 0, 0, 1, 0, 0]) => "MGH",
        () if line(b"type") && bytes.windows(10).take(200).any(|w| w == b"-attribute") => "AFNI header",
        () if at(128, b"DICM") => "DICOM",
        () if at(0, b"II*\0") || at(0, b"MM\0*") => "TIFF",
        () if at(0, b"\x89HDF") => "HDF5",
        () if at(0, b"CDF") => "NetCDF or MINC",
        () if at(0, b"PK\x03\x04") => "zip",
        () if at(0, b"BZh") => "bzip2",
        () if at(0, b"\x89PNG") || at(0, &[0xFF, 0xD8, 0xFF]) => "an image file (PNG or JPEG)",
        () => known_format(bytes).unwrap_or("an unknown signature"),
    }
}
