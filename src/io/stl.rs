//! Reader and writer of STL, binary and text: a list of triangles, each with its own corners.

use super::faces::Faces;
use super::mesh_file::{is_text, push_floats};
use super::notes::{short, stated_space};
use super::text::{number, numbered_lines};
use super::{FormatError, MeshFile, WriteOptions};
use crate::math::{DVec3, Vec3, triangle};
use crate::mesh::{MeshError, TriangleMesh, WorldPositions};

pub(super) const FORMAT: &str = "STL";

/// Size of the header of a binary STL file in bytes, including the number of triangles.
const HEADER: usize = 84;

/// Size of a triangle in a binary STL file, in bytes: normal, three corners, two unused bytes.
const RECORD: usize = 50;

/// Number of triangles by which a file of another length is recognised as a binary STL.
const SAMPLE: usize = 64;

/// How many times as long as it is a file can be said to have been: with more, it is no STL.
const LARGEST_CUT: u64 = 1000;

/// Returns whether the bytes are a binary STL file: whether their length matches the number of triangles in the header,
/// since binary STL has no signature.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    stated_length(bytes) == Some(bytes.len() as u64)
}

/// Returns whether bytes that have no format's signature look like a binary STL file that was cut off or has bytes after
/// its triangles: whether the first triangles have coordinates as real ones have.
pub(super) fn resembles_binary(bytes: &[u8]) -> bool {
    let Some(length) = stated_length(bytes) else { return false };
    let count = (length.saturating_sub(HEADER as u64) / RECORD as u64) as usize;
    let records =
        bytes[HEADER..].chunks_exact(RECORD).take(if count == 0 { SAMPLE } else { count.min(SAMPLE) });
    let is_usual = |x: f32| x == 0.0 || (1e-30..1e15).contains(&x.abs());
    records.len() > 0
        && length <= bytes.len() as u64 * LARGEST_CUT
        && records.flat_map(corners).all(|p| p.to_array().into_iter().all(is_usual))
}

/// Returns the length of a binary STL file with the number of triangles that its header states; `None` if the file is
/// shorter than a header.
fn stated_length(bytes: &[u8]) -> Option<u64> {
    let count = u32::from_le_bytes(bytes.get(80..HEADER)?.try_into().ok()?);
    Some(HEADER as u64 + u64::from(count) * RECORD as u64)
}

/// Returns the error for a binary STL of the wrong length.
fn wrong_length(needed: u64, found: u64) -> FormatError {
    if needed > found {
        return FormatError::Truncated { format: FORMAT, field: "triangles".into(), needed, found };
    }
    let problem =
        format!("implies {needed} bytes, the file has {found} (and is in no other known mesh format)");
    FormatError::invalid(FORMAT, "triangle count", problem)
}

/// Reads the triangles of a binary STL file. Bytes after the last one are left out, with a warning unless they are too
/// few for a triangle or padding.
pub(super) fn parse_binary(bytes: &[u8]) -> Result<MeshFile, FormatError> {
    let (length, found) = (stated_length(bytes).unwrap_or(HEADER as u64), bytes.len() as u64);
    if length > found || (length == HEADER as u64 && length < found) {
        return Err(wrong_length(length, found));
    }
    let (triangles, rest) = bytes.split_at(length as usize);
    let positions: Vec<Vec3> = triangles[HEADER..].chunks_exact(RECORD).flat_map(corners).collect();
    let mut file = MeshFile::from(from_corners(positions).located());
    file.space = stated_space(&bytes[..80]);
    if rest.len() >= RECORD && rest.iter().any(|&byte| byte != rest[0]) {
        let (left_out, count) = (rest.len(), file.mesh.triangles.len());
        file.warn(format!(
            "{left_out} bytes after the {count} triangles that the header states were left out. If triangles are missing, \
             save the file again from the program that it is from."
        ));
    }
    Ok(file)
}

/// Returns the corners of a triangle in a binary STL file.
fn corners(record: &[u8]) -> [Vec3; 3] {
    [12, 24, 36].map(|at| point(&record[at..at + 12]))
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

/// Reads the triangles of a text STL file. Facets of more than three vertices, which the format does not have, are read as
/// polygons.
pub(super) fn parse_text(bytes: &[u8]) -> Result<MeshFile, FormatError> {
    let (mut corners, mut facet, mut faces) = (WorldPositions::default(), Vec::new(), Faces::default());
    let mut ended = false;
    for (number, line) in numbered_lines(bytes) {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { continue };
        let is = |name: &[u8]| keyword.eq_ignore_ascii_case(name);
        if is(b"vertex") {
            facet.push(text_point(words, number)?);
        } else if is(b"endloop") {
            if [1, 2].contains(&facet.len()) {
                let problem = "closes a facet that does not have three vertices";
                return Err(FormatError::invalid(FORMAT, format!("line {number}"), problem));
            }
            faces.triangulate(facet.len(), |k| facet[k], |t| corners.extend(t.map(|k| facet[k])));
            facet.clear();
        } else {
            // Some programs write two words.
            let in_two_words =
                is(b"end") && words.next().is_some_and(|next| next.eq_ignore_ascii_case(b"solid"));
            ended |= is(b"endsolid") || in_two_words;
        }
    }
    if !ended || facet.len() % 3 != 0 {
        return Err(FormatError::invalid(FORMAT, "endsolid", "is missing: the file ends too early"));
    }
    // Without lines that end loops, each three vertices are a facet.
    corners.extend(facet);
    let (positions, origin) = corners.relative();
    let mut file = MeshFile::from(TriangleMesh { origin, ..from_corners(positions) });
    file.space = numbered_lines(bytes.trim_ascii_start()).next().and_then(|(_, line)| stated_space(line));
    faces.warn(&mut file);
    Ok(file)
}

/// Parses the three coordinates on a `vertex` line of a text STL file; `line` is its number, for the error message.
fn text_point<'a>(words: impl Iterator<Item = &'a [u8]>, line: usize) -> Result<DVec3, FormatError> {
    let mut numbers = words.map(number);
    let mut next = || numbers.next().flatten();
    match (next(), next(), next()) {
        (Some(x), Some(y), Some(z)) => Ok(DVec3::new(x, y, z)),
        _ => Err(FormatError::invalid(
            FORMAT,
            format!("line {line}"),
            "a vertex has three numbers, with decimal points",
        )),
    }
}

/// Returns the bytes of a binary STL file of the mesh, with the unit normals of the triangles, 0 for a triangle without
/// area.
///
/// # Errors
/// [`MeshError::Precision`] if single precision is too coarse for the mesh where it is in world space.
pub(super) fn write(mesh: &TriangleMesh, options: &WriteOptions) -> Result<Vec<u8>, MeshError> {
    let positions = mesh.world_positions()?;
    let mut out = Vec::with_capacity(HEADER + RECORD * mesh.triangles.len());
    // Not "solid", which would be detected as text.
    out.extend(b"binary STL");
    out.extend(options.frame().comment(", ").into_bytes());
    out.extend(short(options.notes, 80 - out.len()).into_bytes());
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
