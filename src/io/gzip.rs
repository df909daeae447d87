//! Decompression of gzip and zlib streams, up to a limit that the caller knows from a header.

use super::FormatError;
use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::core::inflate_flags::{
    TINFL_FLAG_COMPUTE_ADLER32, TINFL_FLAG_IGNORE_ADLER32, TINFL_FLAG_PARSE_ZLIB_HEADER,
    TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF,
};
use miniz_oxide::inflate::core::{DecompressorOxide, decompress};

/// Returns whether the bytes start with the signature of gzip.
pub(super) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1F, 0x8B])
}

/// Returns the content of a gzip stream of one or more members, with their checksums verified; zeros may follow the
/// last member. `format` names the file format in error messages.
///
/// # Errors
/// A truncated or corrupt stream, a wrong checksum, content of more than `limit` bytes, which is not inflated any
/// further, or not enough memory.
pub(super) fn gunzip(format: &'static str, bytes: &[u8], limit: usize) -> Result<Vec<u8>, FormatError> {
    let mut out = Vec::new();
    let mut rest = bytes;
    loop {
        let start = out.len();
        if start > 0 && !is_gzip(rest) {
            let problem = format!("is followed by {} bytes that are no gzip stream", rest.len());
            return Err(FormatError::invalid(format, "gzip", problem));
        }
        let body = after_gzip_header(format, rest)?;
        let step = inflate(format, body, &mut out, limit, false)?;
        if step.full {
            return Err(FormatError::invalid(
                format,
                "gzip",
                format!("holds more than the {limit} bytes that the header accounts for"),
            ));
        }
        rest = check_trailer(format, &body[step.consumed..], &out[start..])?;
        if rest.iter().all(|&b| b == 0) {
            return Ok(out);
        }
    }
}

/// Returns the first `count` bytes of the content of a gzip stream's first member, or all of it if shorter, to detect
/// the format or read a header. The checksum is not verified; see [`gunzip`].
///
/// # Errors
/// A corrupt stream, or one that ends before `count` bytes without its end mark.
pub(super) fn gunzip_start(format: &'static str, bytes: &[u8], count: usize) -> Result<Vec<u8>, FormatError> {
    let mut out = Vec::new();
    inflate(format, after_gzip_header(format, bytes)?, &mut out, count, false)?;
    out.truncate(count);
    Ok(out)
}

/// Returns the content of a zlib stream, with its checksum verified.
///
/// # Errors
/// As [`gunzip`].
pub(super) fn unzlib(format: &'static str, bytes: &[u8], limit: usize) -> Result<Vec<u8>, FormatError> {
    let mut out = Vec::new();
    if inflate(format, bytes, &mut out, limit, true)?.full {
        return Err(FormatError::invalid(
            format,
            "zlib",
            format!("holds more than the {limit} bytes that the header accounts for"),
        ));
    }
    Ok(out)
}

/// Result of inflating one deflate or zlib stream: the number of input bytes it took, and whether it was too long.
struct Inflated {
    consumed: usize,
    /// Whether the output exceeds the limit; it may then be incomplete.
    full: bool,
}

/// Initial size of the buffer for inflated data, in bytes. The buffer is doubled as needed, so that a small file costs
/// little whatever size its header claims.
const INITIAL_CAPACITY: usize = 1 << 16;

/// The largest ratio of inflated bytes to deflated ones.
const MOST_INFLATED: usize = 1032;

/// Inflates one deflate stream, in a zlib container if `zlib`, and appends its content to `out`, which becomes at most
/// one byte longer than `limit`.
fn inflate(
    format: &'static str,
    input: &[u8],
    out: &mut Vec<u8>,
    limit: usize,
    zlib: bool,
) -> Result<Inflated, FormatError> {
    let name = if zlib { "zlib" } else { "gzip" };
    let flags = TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF
        | if zlib {
            TINFL_FLAG_PARSE_ZLIB_HEADER | TINFL_FLAG_COMPUTE_ADLER32
        } else {
            TINFL_FLAG_IGNORE_ADLER32
        };
    let mut state = Box::<DecompressorOxide>::default();
    let start = out.len();
    let (mut consumed, mut written) = (0, 0);
    let most = limit.saturating_add(1);
    let mut capacity = INITIAL_CAPACITY;
    // The most that it may become is reserved, as moving a doubled buffer needs room for both. If that fails, doubling may do.
    let reserved = most.saturating_sub(start).min(input.len().saturating_mul(MOST_INFLATED));
    let _ = out.try_reserve_exact(reserved);
    loop {
        grow(format, out, capacity.saturating_add(start).min(most))?;
        let (status, read, wrote) =
            decompress(&mut state, &input[consumed..], &mut out[start..], written, flags);
        consumed += read;
        written += wrote;
        match status {
            TINFLStatus::Done => break,
            TINFLStatus::HasMoreOutput if out.len() < most => capacity = capacity.saturating_mul(2),
            TINFLStatus::HasMoreOutput => break,
            TINFLStatus::FailedCannotMakeProgress | TINFLStatus::NeedsMoreInput => {
                return Err(FormatError::invalid(
                    format,
                    name,
                    format!("the stream is cut off after {} bytes", input.len()),
                ));
            }
            TINFLStatus::Adler32Mismatch => {
                return Err(FormatError::invalid(format, name, "the checksum is wrong"));
            }
            _ => {
                return Err(FormatError::invalid(
                    format,
                    name,
                    format!("the stream is corrupt near byte {consumed}"),
                ));
            }
        }
    }
    out.truncate(start + written);
    Ok(Inflated { consumed, full: out.len() > limit })
}

fn grow(format: &'static str, out: &mut Vec<u8>, len: usize) -> Result<(), FormatError> {
    if len > out.len() {
        let more = len - out.len();
        out.try_reserve_exact(more).map_err(|_| FormatError::too_large(format, "gzip", len as u64))?;
        out.resize(len, 0);
    }
    Ok(())
}

/// Returns the bytes after the header of a gzip member.
fn after_gzip_header<'a>(format: &'static str, bytes: &'a [u8]) -> Result<&'a [u8], FormatError> {
    const EXTRA: u8 = 4;
    const NAME: u8 = 8;
    const COMMENT: u8 = 16;
    const HEADER_CHECKSUM: u8 = 2;
    let cut = || FormatError::truncated(format, "gzip header", 18, bytes.len());
    let flags = *bytes.get(3).ok_or_else(cut)?;
    if !is_gzip(bytes) || bytes[2] != 8 {
        return Err(FormatError::invalid(format, "gzip header", "not a gzip member of method deflate"));
    }
    let mut rest = bytes.get(10..).ok_or_else(cut)?;
    if flags & EXTRA != 0 {
        let length = rest.first_chunk().map(|&two| usize::from(u16::from_le_bytes(two))).ok_or_else(cut)?;
        rest = rest.get(2 + length..).ok_or_else(cut)?;
    }
    for text in [NAME, COMMENT] {
        if flags & text != 0 {
            let end = rest.iter().position(|&b| b == 0).ok_or_else(cut)?;
            rest = &rest[end + 1..];
        }
    }
    if flags & HEADER_CHECKSUM != 0 {
        rest = rest.get(2..).ok_or_else(cut)?;
    }
    Ok(rest)
}

/// Verifies the checksum and length in the trailer of a gzip member and returns the bytes after it.
fn check_trailer<'a>(format: &'static str, rest: &'a [u8], content: &[u8]) -> Result<&'a [u8], FormatError> {
    let cut = || FormatError::truncated(format, "gzip trailer", 8, rest.len());
    let (&crc, after) = rest.split_first_chunk().ok_or_else(cut)?;
    let (&length, after) = after.split_first_chunk().ok_or_else(cut)?;
    if u32::from_le_bytes(length) != content.len() as u32 || u32::from_le_bytes(crc) != crc32(content) {
        return Err(FormatError::invalid(format, "gzip", "the checksum is wrong"));
    }
    Ok(after)
}

/// CRC-32 tables for eight bytes at a time: `CRC[k][b]` is the checksum of byte b followed by k zeros.
const CRC: [[u32; 256]; 8] = crc_tables();

const fn crc_tables() -> [[u32; 256]; 8] {
    let mut tables = [[0; 256]; 8];
    let mut i = 0;
    while i < 256 {
        let mut crc = i as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
            bit += 1;
        }
        tables[0][i] = crc;
        i += 1;
    }
    let mut k = 1;
    while k < 8 {
        let mut i = 0;
        while i < 256 {
            let before = tables[k - 1][i];
            tables[k][i] = (before >> 8) ^ tables[0][(before & 255) as usize];
            i += 1;
        }
        k += 1;
    }
    tables
}

/// Returns the CRC-32 checksum of the bytes, as gzip uses it.
pub(super) fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: u8| (crc >> 8) ^ CRC[0][((crc ^ u32::from(byte)) & 255) as usize];
    let (eights, rest) = bytes.as_chunks::<8>();
    let crc = eights.iter().fold(!0, |crc: u32, eight| {
        let head = crc.to_le_bytes();
        let mixed = |i: usize| if i < 4 { eight[i] ^ head[i] } else { eight[i] };
        (0..8).fold(0, |sum, i| sum ^ CRC[7 - i][usize::from(mixed(i))])
    });
    !rest.iter().fold(crc, |crc, &byte| step(crc, byte))
}

#[cfg(test)]
mod tests {
    use super::*;
    use miniz_oxide::deflate::{compress_to_vec, compress_to_vec_zlib};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn member(content: &[u8], flags: u8, extra: &[u8]) -> Vec<u8> {
        let mut out = vec![0x1F, 0x8B, 8, flags, 0, 0, 0, 0, 0, 255];
        out.extend_from_slice(extra);
        out.extend(compress_to_vec(content, 6));
        out.extend(crc32(content).to_le_bytes());
        out.extend((content.len() as u32).to_le_bytes());
        out
    }

    fn text(n: usize) -> Vec<u8> {
        (0..n as u64).map(|i| (i * i / 7) as u8).collect()
    }

    #[test]
    fn checksum_of_the_usual_example() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
        assert_eq!(crc32(b""), 0);
    }

    #[test]
    fn content_comes_back_from_one_member_or_several() {
        for n in [0, 1, 1000, 200_000] {
            let content = text(n);
            let one = member(&content, 0, b"");
            assert_eq!(gunzip("t", &one, n).unwrap(), content);
            let two = [one.clone(), one, vec![0; 20]].concat();
            assert_eq!(gunzip("t", &two, 2 * n).unwrap(), [content.clone(), content].concat());
        }
    }

    #[test]
    fn optional_header_parts_are_skipped() {
        let content = text(50);
        let extra = [&[3, 0, 9, 9, 9][..], b"name\0", b"comment\0", &[1, 2]].concat();
        assert_eq!(gunzip("t", &member(&content, 2 + 4 + 8 + 16, &extra), 50).unwrap(), content);
    }

    #[test]
    fn a_bomb_stops_at_the_limit() {
        let bomb = member(&vec![0; 50_000_000], 0, b"");
        assert!(bomb.len() < 100_000);
        let error = gunzip("t", &bomb, 1000).unwrap_err();
        assert!(error.to_string().contains("more than the 1000 bytes"), "{error}");
        assert_eq!(gunzip_start("t", &bomb, 10).unwrap(), [0; 10]);
        let zlib = compress_to_vec_zlib(&vec![0; 1_000_000], 6);
        assert!(unzlib("t", &zlib, 999_999).is_err());
        assert_eq!(unzlib("t", &zlib, 1_000_000).unwrap().len(), 1_000_000);
    }

    #[test]
    fn every_truncation_and_every_flip_that_matters_is_an_error() {
        let whole = member(&text(3000), 0, b"");
        for n in 0..whole.len() {
            assert!(gunzip("t", &whole[..n], 3000).is_err(), "cut at {n}");
        }
        for at in 10..whole.len() {
            let mut broken = whole.clone();
            broken[at] ^= 0x10;
            // The last bits before the trailer are padding; flipping one leaves the content unchanged.
            let same = |content| content == text(3000);
            assert!(gunzip("t", &broken, 3000).is_ok_and(same) == (at == whole.len() - 9), "flip at {at}");
        }
    }
}
