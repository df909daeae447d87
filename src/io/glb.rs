//! Reader and writer of the container of GLB (binary glTF 2.0): a chunk of JSON, which `gltf` reads and `glb_writer`
//! writes, and a chunk of binary data.

use super::gltf_buffer::Buffers;
use super::{FormatError, MeshFile, gltf};
use crate::mesh::MeshError;
use serde_json::Value;

pub(super) const FORMAT: &str = "GLB";

/// Name of the format as text: the JSON alone.
pub(super) const TEXT_FORMAT: &str = "glTF";

const HEADER: usize = 12;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

/// Largest JSON of a glTF document that is parsed, in bytes without data URIs: a parsed document takes some 16 times the
/// memory of its text, and no mesh needs this much.
const JSON_LIMIT: usize = 1 << 26;

/// Reads all triangles of a GLB file as one mesh, in world space; `files` are those beside it.
pub(super) fn parse(bytes: &[u8], files: &[(&str, &[u8])]) -> Result<MeshFile, FormatError> {
    let (json, binary) = chunks(bytes)?;
    let root = document(json, "JSON chunk")?;
    gltf::triangles(&root, &Buffers::new(&root, Some(binary), files), json.len())
}

/// Returns whether the bytes may be a glTF document as text: whether they are a JSON object.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().starts_with(b"{")
}

/// Reads all triangles of a glTF document as [`parse`] does.
pub(super) fn parse_text(bytes: &[u8], files: &[(&str, &[u8])]) -> Result<MeshFile, FormatError> {
    let read = || {
        let root = document(bytes, "JSON")?;
        let version = root["asset"]["version"].as_str().unwrap_or("JSON text without a version of glTF");
        if !version.starts_with("2.") {
            return Err(FormatError::unsupported(TEXT_FORMAT, "asset", version, "2.0"));
        }
        gltf::triangles(&root, &Buffers::new(&root, None, files), bytes.len())
    };
    read().map_err(|error| error.of_format(TEXT_FORMAT))
}

fn document(json: &[u8], field: &str) -> Result<Value, FormatError> {
    if json.len() > JSON_LIMIT && json.len() - data_size(json) > JSON_LIMIT {
        return Err(FormatError::too_large(FORMAT, field, json.len() as u64));
    }
    // Some programs start it with a byte order mark, or pad it with zeros.
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let end = json.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    serde_json::from_slice(&json[..end])
        .map_err(|error| FormatError::invalid(FORMAT, field, error.to_string()))
}

/// Returns the number of bytes in data URIs in JSON text.
fn data_size(json: &[u8]) -> usize {
    const START: &[u8] = b"\"data:";
    let (mut rest, mut size) = (json, 0);
    while let Some(at) = rest.windows(START.len()).position(|part| part == START) {
        let uri = &rest[at + START.len()..];
        let length = uri.iter().position(|&byte| byte == b'"').unwrap_or(uri.len());
        size += length;
        rest = &uri[length..];
    }
    size
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
        at = next_chunk(content, at + 8 + size);
    }
    let json = json.ok_or_else(|| FormatError::invalid(FORMAT, "JSON chunk", "is missing"))?;
    Ok((json, binary.unwrap_or_default()))
}

/// Returns where the chunk after one that ends at `end` starts: there, as the length of a chunk includes its padding. Some
/// programs do not count it.
fn next_chunk(content: &[u8], end: usize) -> usize {
    let is_binary = |at: usize| word(content, at + 4, "chunk type").is_ok_and(|kind| kind == BINARY);
    let aligned = end.next_multiple_of(4);
    if !is_binary(end) && is_binary(aligned) { aligned } else { end }
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
