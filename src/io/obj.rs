//! Reader and writer of Wavefront OBJ: vertices, texture coordinates, normals and faces. Everything else is ignored.

use super::faces::Faces;
use super::mesh_file::is_text;
use super::notes::{comments, stated_space};
use super::text::{number, numbered_lines};
use super::{FormatError, MeshFile, PointCloud, WriteOptions};
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{TriangleMesh, WorldPositions};
use crate::volume::Space;
use std::fmt::{Display, Write};
use std::mem;

pub(super) const FORMAT: &str = "OBJ";

/// Index of the texture coordinates or the normal of a corner that has none.
const NONE: u32 = u32::MAX;

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
pub(super) fn parse(bytes: &[u8]) -> Result<MeshFile, FormatError> {
    read(bytes)?.into_mesh()
}

/// Reads the vertices of an OBJ file as points; the file needs no faces. If every face corner refers to a normal,
/// normals are read and averaged per vertex. If no corner does and there are as many normals as vertices, the normals
/// belong to the vertices in order.
pub(super) fn parse_points(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    read(bytes)?.into_points()
}

/// Reads all lines of an OBJ file; a backslash at the end of a line joins the next one to it, unless it ends a comment.
fn read(bytes: &[u8]) -> Result<Reader, FormatError> {
    let mut reader = Reader::default();
    let (mut continued, mut last) = (Vec::new(), 0);
    for (number, line) in numbered_lines(bytes) {
        last = number;
        if let Some(start) = line.strip_suffix(b"\\").filter(|start| !start.contains(&b'#')) {
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
    reader.line(&continued, last)?;
    reader.finish()
}

/// A corner of a face: zero-based indices, in the order of the file, of its position, texture coordinates and normal.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    /// [`NONE`] if it has none.
    uv: u32,
    /// [`NONE`] if it has none.
    normal: u32,
}

/// The content of an OBJ file read so far.
#[derive(Default)]
struct Reader {
    space: Option<Space>,
    positions: WorldPositions,
    colors: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// The corners of all faces, and those of each triangle once all is read.
    corners: Vec<Corner>,
    /// The number of corners of each face.
    sizes: Vec<u32>,
    /// The line and the highest index of a face with vertices that are not defined before it.
    ahead: Option<(usize, u32)>,
    faces: Faces,
    /// Whether the file has free-form surfaces, which are not read.
    has_patches: bool,
    /// Whether corners refer to texture coordinates and to normals that the file does not have.
    undefined: [bool; 2],
}

impl Reader {
    /// Reads one line of the file, up to a comment; lines with unknown keywords are ignored. `line` is the line number,
    /// for error messages.
    fn line(&mut self, text: &[u8], line: usize) -> Result<(), FormatError> {
        if text.trim_ascii_start().starts_with(b"#") {
            self.space = self.space.or_else(|| stated_space(text));
            return Ok(());
        }
        let mut words = words(text).take_while(|word| !word.starts_with(b"#"));
        match words.next() {
            Some(b"v") => self.vertex(&numbers(words, line, 3)?),
            Some(b"vt") => {
                let uv = numbers(words, line, 1)?;
                self.uvs.push(Vec2::new(uv[0] as f32, uv.get(1).map_or(0.0, |&v| v as f32)));
            }
            Some(b"vn") => self.normals.push(DVec3::from_slice(&numbers(words, line, 3)?).as_vec3()),
            Some(b"f") => self.face(words, line)?,
            Some(b"surf" | b"bsp" | b"bzp" | b"cdp") => self.has_patches = true,
            _ => {}
        }
        Ok(())
    }

    /// Adds a vertex from the numbers on its line: a position, and a colour if three more numbers follow. Ignored are a
    /// fourth number alone, which is a weight, and one after the colour, its opacity.
    fn vertex(&mut self, numbers: &[f64]) {
        self.positions.push(DVec3::from_slice(numbers));
        match numbers {
            [_, _, _, r, g, b] | [_, _, _, r, g, b, _] => self.colors.push(DVec3::new(*r, *g, *b).as_vec3()),
            _ => {}
        }
    }

    /// Adds the corners of a face, unless they are fewer than three.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, line: usize) -> Result<(), FormatError> {
        let first = self.corners.len();
        for word in words {
            let corner = self.corner(word, line)?;
            self.corners.push(corner);
        }
        let size = self.corners.len() - first;
        if self.faces.is_face(size) {
            self.sizes.push(size as u32);
        } else {
            self.corners.truncate(first);
        }
        Ok(())
    }

    /// Parses a corner of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: &[u8], line: usize) -> Result<Corner, FormatError> {
        let mut parts = word.split(|&b| b == b'/');
        let mut part = |count: usize| match parts.next() {
            None | Some(b"") => Ok(None),
            Some(digits) => index(digits, count, line).map(|index| Some((digits, index))),
        };
        let (position, uv, normal) =
            (part(self.positions.len())?, part(self.uvs.len())?, part(self.normals.len())?);
        let problem = || invalid(line, "a face corner has no vertex index".into());
        let (digits, position) = position.ok_or_else(problem)?;
        let position = position.ok_or_else(|| out_of_range(digits, self.positions.len(), line))?;
        if position as usize >= self.positions.len() && self.ahead.is_none_or(|(_, most)| most < position) {
            self.ahead = Some((line, position));
        }
        let mut attribute = |found: Option<(&[u8], Option<u32>)>, which: usize| {
            let Some((_, index)) = found else { return NONE };
            self.undefined[which] |= index.is_none();
            index.unwrap_or(NONE)
        };
        Ok(Corner { position, uv: attribute(uv, 0), normal: attribute(normal, 1) })
    }

    /// Replaces faces by triangles when all is read, since faces may refer to vertices that follow them.
    fn finish(mut self) -> Result<Self, FormatError> {
        let count = self.positions.len();
        if let Some((line, most)) = self.ahead.filter(|&(_, most)| most as usize >= count) {
            return Err(out_of_range((most as u64 + 1).to_string().as_bytes(), count, line));
        }
        let corners = mem::take(&mut self.corners);
        let (mut rest, positions) = (corners.as_slice(), &self.positions);
        for &size in &self.sizes {
            let (face, after) = rest.split_at(size as usize);
            let at = |k: usize| positions.at(face[k].position as usize);
            self.faces.triangulate(face.len(), at, |triangle| self.corners.extend(triangle.map(|k| face[k])));
            rest = after;
        }
        let counts = [self.uvs.len(), self.normals.len()];
        for corner in &mut self.corners {
            for (which, index) in [&mut corner.uv, &mut corner.normal].into_iter().enumerate() {
                if *index as usize >= counts[which] && *index != NONE {
                    (*index, self.undefined[which]) = (NONE, true);
                }
            }
        }
        Ok(self)
    }

    /// Returns the triangles' corners.
    fn triangles(&self) -> &[[Corner; 3]] {
        self.corners.as_chunks().0
    }

    fn into_mesh(self) -> Result<MeshFile, FormatError> {
        let triangles: Vec<[u32; 3]> = self.triangles().iter().map(|t| t.map(|c| c.position)).collect();
        let corner_uvs = self.per_corner(|corner| self.uvs.get(corner.uv as usize).copied());
        let corner_normals = self.per_corner(|corner| self.normals.get(corner.normal as usize).copied());
        let normals = corner_normals.map(|normals| {
            let mut sums = vec![Vec3::ZERO; self.positions.len()];
            let corners = triangles.as_flattened().iter().zip(normals.as_flattened());
            corners.for_each(|(&v, n)| sums[v as usize] += n.normalize_or_zero());
            sums.into_iter().map(|n| n.normalize_or_zero()).collect()
        });
        let colors = (self.colors.len() == self.positions.len()).then_some(self.colors);
        let relative = self.positions.relative_in(&triangles);
        let (positions, origin) = relative.map_err(|error| FormatError::positions(FORMAT, &error))?;
        let mesh =
            TriangleMesh { positions, origin, triangles, normals, corner_uvs, colors, ..Default::default() };
        let mut file = MeshFile { space: self.space, ..MeshFile::from(mesh) };
        for (is_undefined, name) in self.undefined.into_iter().zip(["texture coordinates", "normals"]) {
            if is_undefined {
                file.warn(format!(
                    "Faces refer to {name} that the file does not have: {name} were left out."
                ));
            }
        }
        if self.has_patches {
            file.warn("Free-form surfaces were left out: save the file as polygons to have them.");
        }
        self.faces.warn(&mut file);
        Ok(file)
    }

    fn into_points(mut self) -> Result<PointCloud, FormatError> {
        let named = self.corners.iter().any(|corner| corner.normal != NONE);
        let in_order = !named && self.normals.len() == self.positions.len();
        let own = in_order.then(|| mem::take(&mut self.normals));
        let MeshFile { mesh, warnings, .. } = self.into_mesh()?;
        let normals = own.or(mesh.normals.filter(|_| named));
        Ok(PointCloud { points: mesh.positions, origin: mesh.origin, normals, colors: mesh.colors, warnings })
    }

    /// Returns the value of `read` at each corner of all triangles; `None` if it is missing at any corner.
    fn per_corner<T>(&self, read: impl Fn(&Corner) -> Option<T>) -> Option<Vec<[T; 3]>> {
        self.triangles().iter().map(|[a, b, c]| Some([read(a)?, read(b)?, read(c)?])).collect()
    }
}

fn invalid(line: usize, problem: String) -> FormatError {
    FormatError::invalid(FORMAT, format!("line {line}"), problem)
}

/// Returns the error for the index of a vertex that is not defined, of `count` that are.
fn out_of_range(digits: &[u8], count: usize, line: usize) -> FormatError {
    let found = String::from_utf8_lossy(&digits[..digits.len().min(20)]);
    let accepted = match count {
        0 => "there are no vertices".into(),
        _ => format!("must be 1 to {count}, or −1 to −{count}"),
    };
    invalid(line, format!("v index {found} is out of range; {accepted}"))
}

/// Converts an OBJ index, which counts from 1, or backwards from −1 at the last of the `count` entries read so far, to
/// a zero-based one, which may be that of an entry that follows; `None` if there can't be such an entry. An error for
/// what is no integer.
fn index(digits: &[u8], count: usize, line: usize) -> Result<Option<u32>, FormatError> {
    let number = std::str::from_utf8(digits).ok().and_then(|text| text.parse::<i64>().ok());
    let number = number.ok_or_else(|| {
        let found = String::from_utf8_lossy(&digits[..digits.len().min(20)]);
        invalid(line, format!("index {found} must be an integer"))
    })?;
    let resolved = if number < 0 { number.checked_add(count as i64) } else { number.checked_sub(1) };
    Ok(resolved.and_then(|i| u32::try_from(i).ok()).filter(|&i| i != NONE))
}

/// Parses the words of a line as numbers; an error if one is not a number, or there are fewer than `min_count`.
fn numbers<'a>(
    words: impl Iterator<Item = &'a [u8]>,
    line: usize,
    min_count: usize,
) -> Result<Vec<f64>, FormatError> {
    let found: Option<Vec<f64>> = words.map(number).collect();
    let problem = || invalid(line, format!("must have at least {min_count} numbers"));
    found.filter(|numbers| numbers.len() >= min_count).ok_or_else(problem)
}

/// Returns the text of an OBJ file of the mesh, with numbers in the shortest form that reads back exactly.
pub(super) fn write(mesh: &TriangleMesh, options: &WriteOptions) -> Vec<u8> {
    // Comments at the start of the file are all that some readers look at.
    let mut text = options.frame().comment("# ");
    if !text.is_empty() {
        text.push('\n');
    }
    text.push_str(&comments(options.notes, "# warning ", "\n"));
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
