//! Reader and writer of the container of GLB (binary glTF 2.0): a chunk of JSON, which `gltf` reads and `glb_writer`
//! writes, and a chunk of binary data.

use super::{FormatError, gltf};
use crate::mesh::{MeshError, TriangleMesh};

pub(super) const FORMAT: &str = "GLB";

const HEADER: usize = 12;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

/// Largest JSON chunk of a GLB file that is parsed, in bytes: a parsed document takes some 16 times the memory of its
/// text, and no mesh needs this much.
const JSON_LIMIT: usize = 1 << 26;

/// Reads all triangles of a GLB file as one mesh, in world space.
pub(super) fn parse(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    let (json, binary) = chunks(bytes)?;
    if json.len() > JSON_LIMIT {
        return Err(FormatError::too_large(FORMAT, "JSON chunk", json.len() as u64));
    }
    let root = serde_json::from_slice(json)
        .map_err(|error| FormatError::invalid(FORMAT, "JSON chunk", error.to_string()))?;
    gltf::triangles(&root, binary)
}

/// Returns the JSON chunk and the binary chunk of a GLB; the latter is empty if the file has none.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), FormatError> {
    let version = word(bytes, 4, "version")?;
    if version != 2 {
        return Err(FormatError::unsupported(FORMAT, "version", version.to_string(), "2"));
    }
    let length = word(bytes, 8, "length")? as usize;
    let content =
        bytes.get(..length).ok_or_else(|| FormatError::truncated(FORMAT, "length", length, bytes.len()))?;
    let (mut at, mut json, mut binary) = (HEADER, None, None);
    while at < content.len() {
        let (size, kind) =
            (word(content, at, "chunk length")? as usize, word(content, at + 4, "chunk type")?);
        let rest = &content[at + 8..];
        let chunk =
            rest.get(..size).ok_or_else(|| FormatError::truncated(FORMAT, "chunk", size, rest.len()))?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BINARY if binary.is_none() => binary = Some(chunk),
            // The format requires unknown chunk types to be ignored.
            _ => {}
        }
        at += 8 + size;
    }
    let json = json.ok_or_else(|| FormatError::invalid(FORMAT, "JSON chunk", "is missing"))?;
    Ok((json, binary.unwrap_or_default()))
}

/// Reads the little-endian 32-bit number at byte `at`.
fn word(bytes: &[u8], at: usize, field: &str) -> Result<u32, FormatError> {
    let found = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
    found.map(u32::from_le_bytes).ok_or_else(|| FormatError::truncated(FORMAT, field, at + 4, bytes.len()))
}

/// Returns the bytes of a GLB file with a JSON chunk and a binary chunk, each padded to a multiple of four bytes.
///
/// # Errors
/// [`MeshError::TooLarge`] if there is not enough memory for the file, or its length does not fit in 32 bits.
pub(super) fn container(json: String, mut binary: Vec<u8>) -> Result<Vec<u8>, MeshError> {
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let binary_chunk = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let bytes = (HEADER + 8 + json.len()) as u64 + binary_chunk as u64;
    let length = u32::try_from(bytes).map_err(|_| MeshError::TooLarge { bytes })?;
    let mut out = Vec::new();
    out.try_reserve_exact(length as usize).map_err(|_| MeshError::TooLarge { bytes })?;
    out.extend(b"glTF");
    [2, length, json.len() as u32, JSON].iter().for_each(|word| out.extend(word.to_le_bytes()));
    out.extend(json);
    if !binary.is_empty() {
        [binary.len() as u32, BINARY].iter().for_each(|word| out.extend(word.to_le_bytes()));
        out.extend(binary);
    }
    Ok(out)
}
