//! GLB, binary glTF 2.0: the container, and the writer. What the JSON says is read in `gltf`.

use super::mesh_file::push_floats;
use super::{FormatError, gltf};
use crate::math::{Bounds, Vec3};
use crate::mesh::TriangleMesh;

pub(super) const FORMAT: &str = "GLB";

const HEADER: usize = 12;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

/// A parsed document takes some 16 times its text; far more than this is no mesh.
const JSON_LIMIT: usize = 1 << 26;

pub(super) fn parse(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    let (json, binary) = chunks(bytes)?;
    if json.len() > JSON_LIMIT {
        return Err(FormatError::too_large(FORMAT, "JSON chunk", json.len() as u64));
    }
    let root = serde_json::from_slice(json)
        .map_err(|error| FormatError::invalid(FORMAT, "JSON chunk", error.to_string()))?;
    gltf::triangles(&root, binary)
}

/// The JSON and the binary chunk; the latter is empty where there is none.
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
            // Kinds to come are to be passed over.
            _ => {}
        }
        at += 8 + size;
    }
    let json = json.ok_or_else(|| FormatError::invalid(FORMAT, "JSON chunk", "is missing"))?;
    Ok((json, binary.unwrap_or_default()))
}

fn word(bytes: &[u8], at: usize, field: &str) -> Result<u32, FormatError> {
    let found = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
    found.map(u32::from_le_bytes).ok_or_else(|| FormatError::truncated(FORMAT, field, at + 4, bytes.len()))
}

/// One node with one primitive: positions, normals (made where there are none), and what else there is. Without
/// triangles, a scene with an empty node.
pub(super) fn write(mesh: &TriangleMesh) -> Vec<u8> {
    let mesh = mesh.split_at_seams();
    let mut buffer = Buffer::default();
    let json =
        if mesh.triangles.is_empty() { document("", "", &buffer) } else { primitive(&mesh, &mut buffer) };
    container(json, buffer.bytes)
}

#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Buffer {
    /// A view and an accessor of `count` elements from byte `start` to the end; gives back the accessor's index.
    fn close(
        &mut self,
        start: usize,
        target: u32,
        component: u32,
        kind: &str,
        count: usize,
        more: &str,
    ) -> usize {
        let view = self.views.len();
        let length = self.bytes.len() - start;
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{start},"byteLength":{length},"target":{target}}}"#));
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"{more}}}"#
        ));
        self.accessors.len() - 1
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let start = self.bytes.len();
        triangles.as_flattened().iter().for_each(|v| self.bytes.extend(v.to_le_bytes()));
        self.close(start, 34963, 5125, "SCALAR", 3 * triangles.len(), "")
    }

    fn vectors(&mut self, vectors: impl ExactSizeIterator<Item = Vec3>, more: &str) -> usize {
        let (start, count) = (self.bytes.len(), vectors.len());
        vectors.for_each(|v| push_floats(&mut self.bytes, &v.to_array()));
        self.close(start, 34962, 5126, "VEC3", count, more)
    }
}

fn primitive(mesh: &TriangleMesh, buffer: &mut Buffer) -> String {
    let indices = buffer.indices(&mesh.triangles);
    let bounds = Bounds::of(&mesh.positions);
    let [min, max] = [bounds.min, bounds.max].map(|p| format!("[{:?},{:?},{:?}]", p.x, p.y, p.z));
    let position = buffer.vectors(mesh.positions.iter().copied(), &format!(r#","min":{min},"max":{max}"#));
    // The format wants unit normals: up, where a vertex has none.
    let unit = |n: &Vec3| n.try_normalize().unwrap_or(Vec3::Z);
    let made = mesh.normals.is_none().then(|| mesh.vertex_normals());
    let normals = mesh.normals.as_ref().or(made.as_ref());
    let normal = buffer.vectors(normals.map_or(&[][..], Vec::as_slice).iter().map(unit), "");
    let mut attributes = format!(r#""POSITION":{position},"NORMAL":{normal}"#);
    if let Some(uvs) = &mesh.uvs {
        let start = buffer.bytes.len();
        uvs.iter().for_each(|uv| push_floats(&mut buffer.bytes, &uv.to_array()));
        let accessor = buffer.close(start, 34962, 5126, "VEC2", uvs.len(), "");
        attributes += &format!(r#","TEXCOORD_0":{accessor}"#);
    }
    if let Some(colors) = &mesh.colors {
        let accessor = buffer.vectors(colors.iter().map(|c| c.clamp(Vec3::ZERO, Vec3::ONE)), "");
        attributes += &format!(r#","COLOR_0":{accessor}"#);
    }
    let meshes = format!(
        r#","meshes":[{{"primitives":[{{"attributes":{{{attributes}}},"indices":{indices},"mode":4}}]}}]"#
    );
    document(r#""mesh":0"#, &meshes, buffer)
}

fn document(node: &str, meshes: &str, buffer: &Buffer) -> String {
    let mut json = String::from(
        r#"{"asset":{"version":"2.0","generator":"vesicle"},"scene":0,"scenes":[{"nodes":[0]}]"#,
    );
    json += &format!(r#","nodes":[{{{node}}}]{meshes}"#);
    if !buffer.bytes.is_empty() {
        let (views, accessors) = (buffer.views.join(","), buffer.accessors.join(","));
        json += &format!(
            r#","accessors":[{accessors}],"bufferViews":[{views}],"buffers":[{{"byteLength":{}}}]"#,
            buffer.bytes.len()
        );
    }
    json + "}"
}

/// Both chunks filled up to a multiple of four bytes; every array in the buffer is one already.
fn container(json: String, binary: Vec<u8>) -> Vec<u8> {
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary_chunk = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let length = HEADER + 8 + json.len() + binary_chunk;
    let mut out = Vec::with_capacity(length);
    out.extend(b"glTF");
    [2, length as u32, json.len() as u32, JSON].iter().for_each(|word| out.extend(word.to_le_bytes()));
    out.extend(json);
    if !binary.is_empty() {
        [binary.len() as u32, BINARY].iter().for_each(|word| out.extend(word.to_le_bytes()));
        out.extend(binary);
    }
    out
}
