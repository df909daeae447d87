//! Reader and writer of STL, binary and text: a list of triangles, each with its own corners.

use super::FormatError;
use super::mesh_file::{is_text, push_floats};
use super::notes::short;
use crate::math::{DVec3, Vec3, triangle};
use crate::mesh::{MeshError, TriangleMesh, WorldPositions};

const FORMAT: &str = "STL";

/// Size of the header of a binary STL file in bytes, including the number of triangles.
pub(super) const HEADER: usize = 84;

/// Size of a triangle in a binary STL file, in bytes: normal, three corners, two unused bytes.
const RECORD: usize = 50;

/// Returns whether the bytes are a binary STL file: whether their length matches the number of triangles in the header,
/// since binary STL has no signature.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    triangle_count(bytes).is_some_and(|count| HEADER as u64 + count * RECORD as u64 == bytes.len() as u64)
}

/// Returns the number of triangles that the header of a binary STL file states; `None` if the file is shorter than a
/// header.
fn triangle_count(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..HEADER)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

/// Returns the error for bytes that can only be a binary STL but have the wrong length.
pub(super) fn wrong_length(bytes: &[u8]) -> FormatError {
    let needed = triangle_count(bytes).map_or(0, |count| HEADER as u64 + count * RECORD as u64);
    let found = bytes.len() as u64;
    if needed > found {
        return FormatError::Truncated { format: FORMAT, field: "triangles".into(), needed, found };
    }
    let problem =
        format!("implies {needed} bytes, the file has {found} (and is in no other known mesh format)");
    FormatError::invalid(FORMAT, "triangle count", problem)
}

/// Reads the triangles of a binary STL file.
pub(super) fn parse_binary(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    let records = bytes.get(HEADER..).ok_or_else(|| wrong_length(bytes))?;
    let corners = records.chunks_exact(RECORD).flat_map(|r| [12, 24, 36].map(|at| point(&r[at..at + 12])));
    Ok(from_corners(corners.collect()).located())
}

fn point(bytes: &[u8]) -> Vec3 {
    let number = |k: usize| f32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[4 * k + i]));
    Vec3::new(number(0), number(1), number(2))
}

/// Returns a mesh in which each three consecutive positions are the corners of a triangle, as in STL, which shares no
/// vertices.
fn from_corners(positions: Vec<Vec3>) -> TriangleMesh {
    let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh { positions, triangles, ..Default::default() }
}

/// Returns whether the bytes look like a text STL file: text that starts with the word `solid`.
pub(super) fn is_text_stl(bytes: &[u8]) -> bool {
    let bytes = bytes.trim_ascii_start();
    let starts = bytes.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    starts && bytes.get(5).is_none_or(u8::is_ascii_whitespace) && is_text(bytes)
}

/// Reads the triangles of a text STL file.
pub(super) fn parse_text(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    let mut corners = WorldPositions::default();
    let mut ended = false;
    for (number, line) in (1..).zip(bytes.split(|&b| b == b'\n' || b == b'\r')) {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { continue };
        if keyword.eq_ignore_ascii_case(b"vertex") {
            corners.push(text_point(words, number)?);
        } else if keyword.eq_ignore_ascii_case(b"endloop") && corners.len() % 3 != 0 {
            let problem = "closes a facet that does not have three vertices";
            return Err(FormatError::invalid(FORMAT, format!("line {number}"), problem));
        }
        ended |= keyword.eq_ignore_ascii_case(b"endsolid");
    }
    if !ended || corners.len() % 3 != 0 {
        return Err(FormatError::invalid(FORMAT, "endsolid", "is missing: the file ends too early"));
    }
    let (positions, origin) = corners.relative();
    Ok(TriangleMesh { origin, ..from_corners(positions) })
}

/// Parses the three coordinates on a `vertex` line of a text STL file; `line` is its number, for the error message.
fn text_point<'a>(words: impl Iterator<Item = &'a [u8]>, line: usize) -> Result<DVec3, FormatError> {
    let mut numbers = words.map(|word| std::str::from_utf8(word).ok()?.parse::<f64>().ok());
    let mut next = || numbers.next().flatten();
    match (next(), next(), next()) {
        (Some(x), Some(y), Some(z)) => Ok(DVec3::new(x, y, z)),
        _ => Err(FormatError::invalid(FORMAT, format!("line {line}"), "a vertex has three numbers")),
    }
}

/// Returns the bytes of a binary STL file of the mesh, with the unit normals of the triangles, 0 for a triangle without
/// area.
///
/// # Errors
/// [`MeshError::Precision`] if single precision is too coarse for the mesh where it is in world space.
pub(super) fn write(mesh: &TriangleMesh, notes: &str) -> Result<Vec<u8>, MeshError> {
    let positions = mesh.world_positions()?;
    let mut out = Vec::with_capacity(HEADER + RECORD * mesh.triangles.len());
    // Not "solid", which would be detected as text.
    out.extend(b"binary STL");
    out.extend(short(notes, 80 - out.len()).into_bytes());
    out.resize(80, b' ');
    out.extend((mesh.triangles.len() as u32).to_le_bytes());
    for (corners, indices) in mesh.corners().zip(&mesh.triangles) {
        let normal = triangle::area_vector(corners).normalize_or_zero().as_vec3();
        push_floats(&mut out, &normal.to_array());
        indices.iter().for_each(|&v| push_floats(&mut out, &positions[v as usize].to_array()));
        out.extend([0, 0]);
    }
    Ok(out)
}
