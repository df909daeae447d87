//! Reader and writer of Wavefront OBJ: vertices, texture coordinates, normals and faces. Everything else is ignored.

use super::mesh_file::is_text;
use super::notes::comments;
use super::text::numbered_lines;
use super::{FormatError, PointCloud};
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{TriangleMesh, WorldPositions};
use std::fmt::{Display, Write};
use std::mem;

pub(super) const FORMAT: &str = "OBJ";

/// Returns whether the bytes are text with at least one vertex line.
pub(super) fn is_obj(bytes: &[u8]) -> bool {
    is_text(bytes) && numbered_lines(bytes).any(|(_, line)| words(line).next() == Some(b"v"))
}

/// Splits a line of an OBJ file at whitespace.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Reads a mesh from an OBJ file. Texture coordinates and normals are kept if every corner of every face has them,
/// colours if every vertex has one; the normals at the corners are averaged per vertex.
pub(super) fn parse(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    read(bytes)?.into_mesh()
}

/// Reads the vertices of an OBJ file as points; the file needs no faces. If every face corner refers to a normal,
/// normals are read and averaged per vertex. If no corner does and there are as many normals as vertices, the normals
/// belong to the vertices in order.
pub(super) fn parse_points(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    read(bytes)?.into_points()
}

/// Reads all lines of an OBJ file; a backslash at the end of a line joins the next one to it.
fn read(bytes: &[u8]) -> Result<Reader, FormatError> {
    let mut reader = Reader::default();
    let mut continued = Vec::new();
    for (number, line) in numbered_lines(bytes) {
        // A backslash at the end joins the next line to this one.
        if let Some(start) = line.strip_suffix(b"\\") {
            continued.extend_from_slice(start);
            continued.push(b' ');
            continue;
        }
        if continued.is_empty() {
            reader.line(line, number)?;
        } else {
            continued.extend_from_slice(line);
            reader.line(&continued, number)?;
            continued.clear();
        }
    }
    Ok(reader)
}

/// A corner of a face: zero-based indices, in the order of the file, of its position, texture coordinates and normal.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    uv: Option<u32>,
    normal: Option<u32>,
}

/// The content of an OBJ file read so far, with faces as triangles.
#[derive(Default)]
struct Reader {
    positions: WorldPositions,
    colors: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    corners: Vec<[Corner; 3]>,
}

impl Reader {
    /// Reads one line of the file, up to a comment; lines with unknown keywords are ignored. `number` is the line
    /// number, for error messages.
    fn line(&mut self, line: &[u8], number: usize) -> Result<(), FormatError> {
        let mut words = words(line).take_while(|word| !word.starts_with(b"#"));
        match words.next() {
            Some(b"v") => self.vertex(&numbers(words, number, 3)?),
            Some(b"vt") => {
                let uv = numbers(words, number, 1)?;
                self.uvs.push(Vec2::new(uv[0] as f32, uv.get(1).map_or(0.0, |&v| v as f32)));
            }
            Some(b"vn") => self.normals.push(DVec3::from_slice(&numbers(words, number, 3)?).as_vec3()),
            Some(b"f") => self.face(words, number)?,
            _ => {}
        }
        Ok(())
    }

    /// Adds a vertex from the numbers on its line: a position, and a colour if three more numbers follow. A fourth
    /// number alone, or before the colour, is a weight, which is ignored.
    fn vertex(&mut self, numbers: &[f64]) {
        self.positions.push(DVec3::from_slice(numbers));
        match numbers {
            [_, _, _, r, g, b] | [_, _, _, _, r, g, b] => self.colors.push(DVec3::new(*r, *g, *b).as_vec3()),
            _ => {}
        }
    }

    /// Adds a face as a fan of triangles.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, line: usize) -> Result<(), FormatError> {
        let corners = words.map(|word| self.corner(word, line)).collect::<Result<Vec<_>, _>>()?;
        let [first, rest @ ..] = corners.as_slice() else { return Err(face_size(line, 0)) };
        if rest.len() < 2 {
            return Err(face_size(line, corners.len()));
        }
        self.corners.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        Ok(())
    }

    /// Parses a corner of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &[u8], line: usize) -> Result<Corner, FormatError> {
        let mut parts = word.split(|&b| b == b'/');
        let mut part = |table: &str, count: usize| match parts.next() {
            None | Some(b"") => Ok(None),
            Some(digits) => index(digits, table, count, line).map(Some),
        };
        let position = part("v", self.positions.len())?;
        let uv = part("vt", self.uvs.len())?;
        let normal = part("vn", self.normals.len())?;
        let problem =
            || FormatError::invalid(FORMAT, format!("line {line}"), "a face corner has no vertex index");
        Ok(Corner { position: position.ok_or_else(problem)?, uv, normal })
    }

    fn into_mesh(self) -> Result<TriangleMesh, FormatError> {
        let triangles: Vec<[u32; 3]> = self.corners.iter().map(|c| c.map(|corner| corner.position)).collect();
        let corner_uvs = self.per_corner(|corner| corner.uv.map(|i| self.uvs[i as usize]));
        let corner_normals = self.per_corner(|corner| corner.normal.map(|i| self.normals[i as usize]));
        let normals = corner_normals.map(|normals| {
            let mut sums = vec![Vec3::ZERO; self.positions.len()];
            let corners = triangles.as_flattened().iter().zip(normals.as_flattened());
            corners.for_each(|(&v, n)| sums[v as usize] += n.normalize_or_zero());
            sums.into_iter().map(|n| n.normalize_or_zero()).collect()
        });
        let colors = (self.colors.len() == self.positions.len()).then_some(self.colors);
        let relative = self.positions.relative_in(&triangles);
        let (positions, origin) = relative.map_err(|error| FormatError::positions(FORMAT, &error))?;
        Ok(TriangleMesh { positions, origin, triangles, normals, corner_uvs, colors, ..Default::default() })
    }

    fn into_points(mut self) -> Result<PointCloud, FormatError> {
        let named = self.corners.as_flattened().iter().any(|corner| corner.normal.is_some());
        let in_order = !named && self.normals.len() == self.positions.len();
        let own = in_order.then(|| mem::take(&mut self.normals));
        let mesh = self.into_mesh()?;
        Ok(PointCloud {
            points: mesh.positions,
            origin: mesh.origin,
            normals: own.or(mesh.normals.filter(|_| named)),
            colors: mesh.colors,
        })
    }

    /// Returns the value of `read` at each corner of all triangles; `None` if it is missing at any corner.
    fn per_corner<T>(&self, read: impl Fn(&Corner) -> Option<T>) -> Option<Vec<[T; 3]>> {
        self.corners.iter().map(|[a, b, c]| Some([read(a)?, read(b)?, read(c)?])).collect()
    }
}

fn face_size(line: usize, corners: usize) -> FormatError {
    let problem = format!("a face must have at least three corners, got {corners}");
    FormatError::invalid(FORMAT, format!("line {line}"), problem)
}

/// Converts an OBJ index, which counts from 1, or backwards from −1 at the last of the `count` entries read so far, to
/// a zero-based one.
fn index(digits: &[u8], table: &str, count: usize, line: usize) -> Result<u32, FormatError> {
    let number = std::str::from_utf8(digits).ok().and_then(|text| text.parse::<i64>().ok());
    let resolved = number.and_then(|n| if n < 0 { n.checked_add(count as i64) } else { n.checked_sub(1) });
    resolved.and_then(|i| u32::try_from(i).ok()).filter(|&i| (i as usize) < count).ok_or_else(|| {
        let found = String::from_utf8_lossy(&digits[..digits.len().min(20)]).into_owned();
        let problem = format!(
            "{table} index {found} is out of range; 1 to {count} (or −1 to −{count}) are defined so far"
        );
        FormatError::invalid(FORMAT, format!("line {line}"), problem)
    })
}

/// Parses the words of a line as numbers; an error if one is not a number, or there are fewer than `min_count`.
fn numbers<'a>(
    words: impl Iterator<Item = &'a [u8]>,
    line: usize,
    min_count: usize,
) -> Result<Vec<f64>, FormatError> {
    let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<f64>().ok();
    let found: Option<Vec<f64>> = words.map(number).collect();
    found.filter(|numbers| numbers.len() >= min_count).ok_or_else(|| {
        FormatError::invalid(
            FORMAT,
            format!("line {line}"),
            format!("must have at least {min_count} numbers"),
        )
    })
}

/// Returns the text of an OBJ file of the mesh, with numbers in the shortest form that reads back exactly.
pub(super) fn write(mesh: &TriangleMesh, notes: &str) -> Vec<u8> {
    let mut text = comments(notes, "# warning ", "\n");
    text.push_str("# vertices and faces\n");
    for (i, p) in mesh.positions.iter().enumerate() {
        if mesh.origin == DVec3::ZERO {
            line(&mut text, "v", &p.to_array());
        } else {
            line(&mut text, "v", &mesh.world_position(i).to_array());
        }
        if let Some(c) = mesh.colors.as_ref().map(|colors| colors[i]) {
            text.pop();
            line(&mut text, "", &[c.x, c.y, c.z]);
        }
    }
    let uvs = mesh.corner_uvs.as_ref().map(|corners| corners.as_flattened()).or(mesh.uvs.as_deref());
    uvs.into_iter().flatten().for_each(|uv| line(&mut text, "vt", &[uv.x, uv.y]));
    mesh.normals.iter().flatten().for_each(|n| line(&mut text, "vn", &[n.x, n.y, n.z]));
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        text.push('f');
        (0..3).for_each(|k| face_corner(&mut text, mesh, 3 * t + k, triangle[k]));
        text.push('\n');
    }
    text.into_bytes()
}

fn line(text: &mut String, keyword: &str, numbers: &[impl Display]) {
    text.push_str(keyword);
    for x in numbers {
        // Writing to a string cannot fail.
        let _ = write!(text, " {x}");
    }
    text.push('\n');
}

/// Appends one corner of a face to the text of an OBJ file, with its texture coordinates and normal if the mesh has
/// them. `corner` counts the corners of all faces.
fn face_corner(text: &mut String, mesh: &TriangleMesh, corner: usize, vertex: u32) {
    let v = vertex as usize + 1;
    let vt = if mesh.corner_uvs.is_some() { Some(corner + 1) } else { mesh.uvs.as_ref().map(|_| v) };
    let _ = match (vt, &mesh.normals) {
        (None, None) => write!(text, " {v}"),
        (Some(vt), None) => write!(text, " {v}/{vt}"),
        (None, Some(_)) => write!(text, " {v}//{v}"),
        (Some(vt), Some(_)) => write!(text, " {v}/{vt}/{v}"),
    };
}
