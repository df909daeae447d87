//! Compression as gzip and zlib streams. The same bytes give the same stream everywhere.

use super::FormatError;
use super::gzip::crc32;
use miniz_oxide::deflate::core::{
    CompressorOxide, TDEFLFlush, TDEFLStatus, compress, create_comp_flags_from_zip_params,
};

/// Level of compression, 0 to 10: the usual one of gzip. Higher ones take several times as long for some percent.
const LEVEL: i32 = 6;
/// Size in bytes of the buffer through which compressed data pass.
const BUFFER: usize = 1 << 16;

/// Returns a gzip stream of one member that contains `bytes`, without a name or a time. `format` names the file format in
/// error messages.
///
/// # Errors
/// [`FormatError::TooLarge`] if there is not enough memory.
pub(super) fn gzip(format: &'static str, bytes: &[u8]) -> Result<Vec<u8>, FormatError> {
    let mut out = vec![0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 255];
    deflate(format, bytes, 0, &mut out)?;
    out.extend(crc32(bytes).to_le_bytes());
    // The format stores the length modulo 2^32.
    out.extend((bytes.len() as u32).to_le_bytes());
    Ok(out)
}

/// Returns a zlib stream that contains `bytes`.
///
/// # Errors
/// As [`gzip`].
pub(super) fn zlib(format: &'static str, bytes: &[u8]) -> Result<Vec<u8>, FormatError> {
    let mut out = Vec::new();
    deflate(format, bytes, 15, &mut out)?;
    Ok(out)
}

/// Appends a deflate stream that contains `bytes` to `out`, in a zlib container if `window_bits` is above 0.
fn deflate(
    format: &'static str,
    bytes: &[u8],
    window_bits: i32,
    out: &mut Vec<u8>,
) -> Result<(), FormatError> {
    let mut state = Box::new(CompressorOxide::new(create_comp_flags_from_zip_params(LEVEL, window_bits, 0)));
    let mut buffer = vec![0; BUFFER];
    let mut rest = bytes;
    loop {
        let (status, read, written) = compress(&mut state, rest, &mut buffer, TDEFLFlush::Finish);
        rest = rest.get(read..).unwrap_or(&[]);
        // Room for the trailer as well, so that it needs no further allocation.
        let size = out.len() + written + 8;
        out.try_reserve(written + 8).map_err(|_| FormatError::too_large(format, "gzip", size as u64))?;
        out.extend_from_slice(&buffer[..written]);
        match status {
            TDEFLStatus::Done => return Ok(()),
            TDEFLStatus::Okay => {}
            _ => return Err(FormatError::invalid(format, "gzip", "the voxels could not be compressed")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::gzip::{gunzip, unzlib};
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn content_comes_back_whatever_its_size() {
        let mut random = Random::new(1);
        for count in [0, 1, 100, BUFFER - 1, BUFFER, 3 * BUFFER + 7] {
            let noise: Vec<u8> = (0..count).map(|_| random.next_u32() as u8).collect();
            for content in [noise, vec![7; count]] {
                assert_eq!(gunzip("t", &gzip("t", &content).unwrap(), count).unwrap(), content);
                assert_eq!(unzlib("t", &zlib("t", &content).unwrap(), count).unwrap(), content);
            }
        }
        assert!(gzip("t", &vec![7; 1_000_000]).unwrap().len() < 2000);
    }
}
