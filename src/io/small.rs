//! How much small files may unpack to: a few kilobytes can stand for gigabytes of equal voxels, and methods take many times
//! that.

use super::FormatError;

/// Bytes of files that are small, all files of a volume together.
pub(super) const SMALL: usize = 1 << 17;

/// Most bytes that small files may unpack to.
pub(super) const MOST_OF_SMALL: usize = 1 << 25;

/// Returns an error if files of `stored` bytes, which are compressed, may not unpack to `unpacked` bytes of voxels.
pub(super) fn check_unpacked(
    format: &'static str,
    stored: usize,
    unpacked: usize,
) -> Result<(), FormatError> {
    if stored > SMALL || unpacked <= MOST_OF_SMALL {
        return Ok(());
    }
    let field = "voxels: compressed files of up to 128 KiB may unpack to 32 MiB; store them uncompressed";
    Err(FormatError::too_large(format, field, unpacked as u64))
}
