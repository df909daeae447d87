//! Reader and writer of PLY, text and binary in both byte orders. Elements and properties beyond those of a mesh are
//! ignored.

use super::faces::Faces;
use super::mesh_file::{color_bytes, push_floats};
use super::notes::{comments, stated_space};
use super::text::number;
use super::{FormatError, MeshFile, WriteOptions};
use crate::math::{DVec3, Vec2, Vec3};
use crate::mesh::{TriangleMesh, WorldPositions};
use crate::volume::Space;

pub(super) const FORMAT: &str = "PLY";

/// Returns whether the bytes are a PLY file, by its first line.
pub(super) fn is_ply(bytes: &[u8]) -> bool {
    bytes.strip_prefix(b"ply").is_some_and(|rest| rest.first().is_some_and(u8::is_ascii_whitespace))
}

/// Reads a mesh from a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<MeshFile, FormatError> {
    read(bytes, Reader::faces)
}

/// Reads the vertices of a PLY file with their attributes, for point clouds; faces are skipped, whatever they hold.
pub(super) fn parse_vertices(bytes: &[u8]) -> Result<MeshFile, FormatError> {
    read(bytes, |_, element, body| skip_element(element, body))
}

/// Reads all elements of a PLY file; `faces` reads or skips the faces.
fn read(
    bytes: &[u8],
    faces: impl Fn(&mut Reader, &Element, &mut Body) -> Result<(), FormatError>,
) -> Result<MeshFile, FormatError> {
    let (header, body) = Header::parse(bytes)?;
    let mut body = Body { encoding: header.encoding, bytes: body, splits_lines: false };
    let mut reader = Reader::default();
    for element in &header.elements {
        element.check_size(&body)?;
        match element.name.as_str() {
            "vertex" => reader.vertices(element, &mut body)?,
            "face" | "tristrips" => faces(&mut reader, element, &mut body)?,
            _ => skip_element(element, &mut body)?,
        }
    }
    let mut file = reader.finish()?;
    body.check_end(&mut file)?;
    file.space = header.space;
    if let Some(line) = header.unknown_line {
        file.warn(format!(
            "The line \"{line}\" of the header was ignored: it does not start with \"comment\"."
        ));
    }
    Ok(file)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Number type of a PLY property.
#[derive(Clone, Copy, PartialEq, Eq)]
enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl NumberType {
    fn parse(name: &str) -> Result<Self, FormatError> {
        Ok(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => {
                let accepted = "char, uchar, short, ushort, int, uint, float, double";
                return Err(FormatError::unsupported(FORMAT, "property type", clipped(name), accepted));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the number that stands for full intensity of a colour channel of this type: 255 or 65535 for unsigned
    /// integers of 8 or 16 bits, else 1.
    fn full_channel(self) -> f64 {
        match self {
            Self::U8 => 255.0,
            Self::U16 => 65535.0,
            _ => 1.0,
        }
    }

    /// Decodes a number of this type from the first bytes of `b`, in little-endian order.
    fn decode(self, b: [u8; 8]) -> f64 {
        let [b0, b1, b2, b3, ..] = b;
        match self {
            Self::I8 => f64::from(b0 as i8),
            Self::U8 => f64::from(b0),
            Self::I16 => f64::from(i16::from_le_bytes([b0, b1])),
            Self::U16 => f64::from(u16::from_le_bytes([b0, b1])),
            Self::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            Self::U32 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            Self::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            Self::F64 => f64::from_le_bytes(b),
        }
    }
}

/// A property of a PLY element (such as x of vertices), as declared in the header.
struct Property {
    name: String,
    kind: NumberType,
    /// Number type of the length that precedes the values of a list; `None` if the property is a single value.
    length: Option<NumberType>,
}

/// A PLY element (a kind of record, such as vertices or faces), as declared in the header.
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

impl Element {
    /// Returns an error if the rest of the file is too short for the number of records that the header declares; called
    /// before memory is allocated for them.
    fn check_size(&self, body: &Body) -> Result<(), FormatError> {
        let smallest = |p: &Property| {
            if body.encoding == Encoding::Text { 1 } else { p.length.unwrap_or(p.kind).size() }
        };
        let record: usize = self.properties.iter().map(smallest).sum();
        let needed = (record as u64).saturating_mul(self.count as u64);
        let found = body.bytes.len() as u64;
        if needed <= found {
            return Ok(());
        }
        Err(FormatError::Truncated { format: FORMAT, field: format!("element {}", self.name), needed, found })
    }

    /// Returns the index of the element's first property that has any of the names, if there is one.
    fn index_of(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| names.contains(&p.name.as_str()))
    }

    /// Returns the indices of the properties in the first set of names of which the element has all; `None` if there is
    /// none.
    fn indices_of<const N: usize>(&self, sets: &[[&str; N]]) -> Option<[usize; N]> {
        sets.iter().find_map(|names| {
            let found: Vec<usize> = names.iter().filter_map(|name| self.index_of(&[name])).collect();
            found.try_into().ok()
        })
    }
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// The space that a comment states.
    space: Option<Space>,
    /// The first line before all elements that does not belong in a header, such as a comment without its keyword.
    unknown_line: Option<String>,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), FormatError> {
        let mut rest = bytes;
        let (mut encoding, mut elements) = (None, Vec::new());
        let (mut space, mut unknown_line) = (None, None);
        loop {
            let line = take_line(&mut rest)?;
            if line.starts_with(b"comment") || line.starts_with(b"obj_info") {
                space = space.or_else(|| stated_space(line));
                continue;
            }
            let line = String::from_utf8_lossy(line);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words.as_slice() {
                ["end_header"] => break,
                ["format", name, version] => encoding = Some(parse_encoding(name, version)?),
                ["element", name, count] => elements.push(parse_element(name, count)?),
                ["property", property @ ..] => {
                    let element: Option<&mut Element> = elements.last_mut();
                    let missing = || FormatError::invalid(FORMAT, "property", "must follow an element");
                    element.ok_or_else(missing)?.properties.push(parse_property(property)?);
                }
                [] | ["ply"] => {}
                // Before the first element this cannot be a declaration that matters: what follows would contradict.
                _ if elements.is_empty() => unknown_line = unknown_line.or(Some(clipped(&line))),
                _ => {
                    let problem = format!("\"{}\" is not a header line", clipped(&line));
                    return Err(FormatError::invalid(FORMAT, "header", problem));
                }
            }
        }
        let encoding = encoding.ok_or_else(|| FormatError::invalid(FORMAT, "format", "is missing"))?;
        Ok((Self { encoding, elements, space, unknown_line }, rest))
    }
}

/// Takes a line of the PLY header, without its line ending, from the front of `rest`.
fn take_line<'a>(rest: &mut &'a [u8]) -> Result<&'a [u8], FormatError> {
    let end = rest.iter().position(|&b| b == b'\n' || b == b'\r');
    let end = end.ok_or_else(|| FormatError::invalid(FORMAT, "header", "has no end_header"))?;
    let (line, after) = rest.split_at(end);
    let ended = if after.starts_with(b"\r\n") { 2 } else { 1 };
    *rest = &after[ended..];
    Ok(line)
}

fn parse_encoding(name: &str, version: &str) -> Result<Encoding, FormatError> {
    let encoding = match name {
        "ascii" => Some(Encoding::Text),
        "binary_little_endian" => Some(Encoding::LittleEndian),
        "binary_big_endian" => Some(Encoding::BigEndian),
        _ => None,
    };
    encoding.filter(|_| version == "1.0").ok_or_else(|| {
        let accepted = "ascii, binary_little_endian and binary_big_endian, all 1.0";
        FormatError::unsupported(FORMAT, "format", clipped(&format!("{name} {version}")), accepted)
    })
}

fn parse_element(name: &str, count: &str) -> Result<Element, FormatError> {
    // Indices have 32 bits.
    let parsed = count.parse::<u32>().map_err(|_| {
        FormatError::invalid(
            FORMAT,
            format!("element {}", clipped(name)),
            format!("count must be 0 to {}, got {}", u32::MAX, clipped(count)),
        )
    })?;
    Ok(Element { name: name.into(), count: parsed as usize, properties: Vec::new() })
}

fn parse_property(words: &[&str]) -> Result<Property, FormatError> {
    match words {
        ["list", length, kind, name] => {
            let length = NumberType::parse(length)?;
            if matches!(length, NumberType::F32 | NumberType::F64) {
                return Err(FormatError::invalid(
                    FORMAT,
                    format!("property {}", clipped(name)),
                    "a list's length is an integer",
                ));
            }
            Ok(Property { name: (*name).into(), kind: NumberType::parse(kind)?, length: Some(length) })
        }
        [kind, name] => Ok(Property { name: (*name).into(), kind: NumberType::parse(kind)?, length: None }),
        _ => Err(FormatError::invalid(
            FORMAT,
            "property",
            format!("\"{}\" must be a type and a name", clipped(&words.join(" "))),
        )),
    }
}

/// Truncates text for an error message, to 60 characters.
fn clipped(text: &str) -> String {
    text.chars().take(60).collect()
}

/// The part of a PLY file after the header that has not been read yet.
struct Body<'a> {
    encoding: Encoding,
    bytes: &'a [u8],
    /// Whether a record of text ended before its line did.
    splits_lines: bool,
}

impl Body<'_> {
    /// Notes whether the line of a record of text goes on after it.
    fn end_record(&mut self) {
        if self.encoding == Encoding::Text {
            let next = self.bytes.iter().find(|&&b| !b.is_ascii_whitespace() || b == b'\n' || b == b'\r');
            self.splits_lines |= next.is_some_and(|&b| b != b'\n' && b != b'\r');
        }
    }

    /// Adds a warning if there are numbers after the last record of text; an error if lines have more numbers than records:
    /// numbers were then read as those of other properties.
    fn check_end(&self, file: &mut MeshFile) -> Result<(), FormatError> {
        let rest = self.bytes.trim_ascii();
        if self.encoding != Encoding::Text || rest.is_empty() || rest == b"\x1a" {
            return Ok(());
        }
        if self.splits_lines {
            let problem = "has more numbers in a line than the header declares properties";
            return Err(FormatError::invalid(FORMAT, "body", problem));
        }
        file.warn("What follows the elements that the header declares was left out.");
        Ok(())
    }

    /// Reads the next number, of type `kind` in a binary file; `field` is its name in error messages.
    fn number(&mut self, kind: NumberType, field: &str) -> Result<f64, FormatError> {
        if self.encoding == Encoding::Text {
            return self.text_number(field);
        }
        let size = kind.size();
        let Some((head, rest)) = self.bytes.split_at_checked(size) else {
            return Err(FormatError::truncated(FORMAT, field, size, self.bytes.len()));
        };
        self.bytes = rest;
        let mut buffer = [0; 8];
        buffer[..size].copy_from_slice(head);
        if self.encoding == Encoding::BigEndian {
            buffer[..size].reverse();
        }
        Ok(kind.decode(buffer))
    }

    fn text_number(&mut self, field: &str) -> Result<f64, FormatError> {
        let text = self.bytes.trim_ascii_start();
        let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        self.bytes = rest;
        if word.is_empty() {
            return Err(FormatError::truncated(FORMAT, field, 1, 0));
        }
        number(word).ok_or_else(|| {
            let found = clipped(&String::from_utf8_lossy(word));
            FormatError::invalid(FORMAT, field, format!("\"{found}\" is not a number"))
        })
    }

    /// Reads the value or list of one property of the next record into `values`.
    fn property(&mut self, property: &Property, values: &mut Vec<f64>) -> Result<(), FormatError> {
        values.clear();
        let Some(length) = property.length else {
            values.push(self.number(property.kind, &property.name)?);
            return Ok(());
        };
        let count = self.number(length, &property.name)?;
        // Each value takes at least one byte, so this bounds the memory.
        if !(0.0..=self.bytes.len() as f64).contains(&count) {
            let problem = format!("a list of {count} values; {} bytes are left", self.bytes.len());
            return Err(FormatError::invalid(FORMAT, property.name.as_str(), problem));
        }
        for _ in 0..count as usize {
            values.push(self.number(property.kind, &property.name)?);
        }
        Ok(())
    }
}

/// Reads past all records of an element whose values are not needed.
fn skip_element(element: &Element, body: &mut Body) -> Result<(), FormatError> {
    let mut values = Vec::new();
    // An element without properties has no bytes, whatever its count.
    let count = if element.properties.is_empty() { 0 } else { element.count };
    for _ in 0..count {
        element.properties.iter().try_for_each(|property| body.property(property, &mut values))?;
        body.end_record();
    }
    Ok(())
}

/// The mesh read so far from a PLY file.
#[derive(Default)]
struct Reader {
    mesh: TriangleMesh,
    positions: WorldPositions,
    corner_uvs: Vec<[Vec2; 3]>,
    faces: Faces,
}

impl Reader {
    /// Reads the vertices with the attributes that they have; an error if they have no x, y and z.
    fn vertices(&mut self, element: &Element, body: &mut Body) -> Result<(), FormatError> {
        let Some(position) = element.indices_of(&[["x", "y", "z"]]) else {
            return Err(FormatError::invalid(FORMAT, "element vertex", "has no properties x, y and z"));
        };
        let normal = element.indices_of(&[["nx", "ny", "nz"]]);
        let uv = element.indices_of(&[["s", "t"], ["u", "v"], ["texture_u", "texture_v"]]);
        let color = element.indices_of(&[["red", "green", "blue"], ["r", "g", "b"]]);
        let (mut record, mut values) = (vec![0.0; element.properties.len()], Vec::new());
        for _ in 0..element.count {
            for (slot, property) in record.iter_mut().zip(&element.properties) {
                body.property(property, &mut values)?;
                *slot = values.first().copied().unwrap_or(0.0);
            }
            body.end_record();
            let vector = |at: [usize; 3]| Vec3::from_array(at.map(|i| record[i] as f32));
            self.positions.push(DVec3::from_array(position.map(|i| record[i])));
            if let Some(at) = normal {
                self.mesh.normals.get_or_insert_default().push(vector(at));
            }
            if let Some(at) = uv {
                let uv = Vec2::from_array(at.map(|i| record[i] as f32));
                self.mesh.uvs.get_or_insert_default().push(uv);
            }
            if let Some(at) = color {
                let channel = |i: usize| (record[i] / element.properties[i].kind.full_channel()) as f32;
                self.mesh.colors.get_or_insert_default().push(Vec3::from_array(at.map(channel)));
            }
        }
        Ok(())
    }

    /// Reads faces, or strips of triangles, as triangles, with the texture coordinates at the corners of faces if the file
    /// has them.
    fn faces(&mut self, element: &Element, body: &mut Body) -> Result<(), FormatError> {
        let Some(indices_at) = element.index_of(&["vertex_indices", "vertex_index"]) else {
            let field = format!("element {}", element.name);
            return Err(FormatError::invalid(FORMAT, field, "has no property vertex_indices"));
        };
        let uvs_at = element.index_of(&["texcoord"]);
        let (mut indices, mut uvs, mut other) = (Vec::new(), Vec::new(), Vec::new());
        for face in 0..element.count {
            for (i, property) in element.properties.iter().enumerate() {
                let target = match i {
                    _ if i == indices_at => &mut indices,
                    _ if Some(i) == uvs_at => &mut uvs,
                    _ => &mut other,
                };
                body.property(property, target)?;
            }
            body.end_record();
            if element.name == "face" {
                self.face(&indices, &uvs, face)?;
            } else {
                indices.split(|&index| index == -1.0).try_for_each(|strip| self.strip(strip, face))?;
            }
        }
        Ok(())
    }

    /// Returns an error unless all indices are of vertices; `place` names where they are.
    fn check_indices(&self, indices: &[f64], place: impl Fn() -> String) -> Result<(), FormatError> {
        let limit = self.positions.len() as f64;
        let Some(bad) = indices.iter().find(|&&i| !(i >= 0.0 && i < limit && i.fract() == 0.0)) else {
            return Ok(());
        };
        let problem = format!("vertex index {bad} is out of range; must be an integer in 0..{limit}");
        Err(FormatError::invalid(FORMAT, place(), problem))
    }

    /// Adds a strip of triangles, each of the last two vertices and the next; `at` is the number of its record.
    fn strip(&mut self, strip: &[f64], at: usize) -> Result<(), FormatError> {
        self.check_indices(strip, || format!("tristrips {at}"))?;
        let triangles = strip.windows(3).zip(0..).map(|(w, i)| [w[0], w[1 + i % 2], w[2 - i % 2]]);
        self.mesh.triangles.extend(triangles.map(|t| t.map(|index| index as u32)));
        Ok(())
    }

    /// Adds the triangles of a polygon, unless it has fewer than three corners; `face` is its index, for error messages.
    fn face(&mut self, indices: &[f64], uvs: &[f64], face: usize) -> Result<(), FormatError> {
        self.check_indices(indices, || format!("face {face}"))?;
        if !self.faces.is_face(indices.len()) {
            return Ok(());
        }
        let (triangles, corner_uvs) = (&mut self.mesh.triangles, &mut self.corner_uvs);
        let uv = |i: usize| Vec2::new(uvs[2 * i] as f32, uvs[2 * i + 1] as f32);
        let at = |corner: usize| self.positions.at(indices[corner] as usize);
        self.faces.triangulate(indices.len(), at, |corners| {
            triangles.push(corners.map(|i| indices[i] as u32));
            if uvs.len() == 2 * indices.len() {
                corner_uvs.push(corners.map(uv));
            }
        });
        Ok(())
    }

    /// Returns the mesh that was read; texture coordinates per corner are kept if every face has them.
    fn finish(self) -> Result<MeshFile, FormatError> {
        let per_corner = !self.corner_uvs.is_empty() && self.corner_uvs.len() == self.mesh.triangles.len();
        let relative = self.positions.relative_in(&self.mesh.triangles);
        let (positions, origin) = relative.map_err(|error| FormatError::positions(FORMAT, &error))?;
        let corner_uvs = per_corner.then_some(self.corner_uvs);
        let mut file = MeshFile::from(TriangleMesh { positions, origin, corner_uvs, ..self.mesh });
        self.faces.warn(&mut file);
        Ok(file)
    }
}

/// Returns the bytes of a binary little-endian PLY file of the mesh, with colours in 8 bits, and positions in double
/// precision if the mesh has an origin.
pub(super) fn write(mesh: &TriangleMesh, options: &WriteOptions) -> Vec<u8> {
    let mut out = header(mesh, options).into_bytes();
    for (i, p) in mesh.positions.iter().enumerate() {
        if is_double(mesh) {
            mesh.world_position(i).to_array().iter().for_each(|x| out.extend(x.to_le_bytes()));
        } else {
            push_floats(&mut out, &p.to_array());
        }
        if let Some(normals) = &mesh.normals {
            push_floats(&mut out, &normals[i].to_array());
        }
        if let Some(uvs) = &mesh.uvs {
            push_floats(&mut out, &uvs[i].to_array());
        }
        if let Some(colors) = &mesh.colors {
            out.extend(color_bytes(colors[i]));
        }
    }
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        out.push(3);
        triangle.iter().for_each(|v| out.extend(v.to_le_bytes()));
        if let Some(uvs) = &mesh.corner_uvs {
            out.push(6);
            uvs[t].iter().for_each(|uv| push_floats(&mut out, &uv.to_array()));
        }
    }
    out
}

/// Returns whether positions need double precision.
fn is_double(mesh: &TriangleMesh) -> bool {
    mesh.origin != DVec3::ZERO
}

fn header(mesh: &TriangleMesh, options: &WriteOptions) -> String {
    let space = options.frame().comment("\ncomment ");
    let comments = comments(options.notes, "\ncomment warning ", "");
    let mut lines = vec!["ply".into(), format!("format binary_little_endian 1.0{space}{comments}")];
    let properties = |lines: &mut Vec<String>, kind: &str, names: &[&str]| {
        lines.extend(names.iter().map(|name| format!("property {kind} {name}")));
    };
    lines.push(format!("element vertex {}", mesh.positions.len()));
    properties(&mut lines, if is_double(mesh) { "double" } else { "float" }, &["x", "y", "z"]);
    if mesh.normals.is_some() {
        properties(&mut lines, "float", &["nx", "ny", "nz"]);
    }
    if mesh.uvs.is_some() {
        properties(&mut lines, "float", &["s", "t"]);
    }
    if mesh.colors.is_some() {
        properties(&mut lines, "uchar", &["red", "green", "blue"]);
    }
    lines.push(format!("element face {}", mesh.triangles.len()));
    properties(&mut lines, "list uchar int", &["vertex_indices"]);
    if mesh.corner_uvs.is_some() {
        properties(&mut lines, "list uchar float", &["texcoord"]);
    }
    lines.push("end_header\n".into());
    lines.join("\n")
}
