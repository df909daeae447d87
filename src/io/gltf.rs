//! Reader of the triangles of a glTF 2.0 document.
//!
//! The document is read as plain JSON, field by field, and every index and range is checked before use. The `gltf`
//! crate is not used because it adds 96 kB of compressed wasm (this reader, with those of all other mesh formats, adds
//! 55) and trusts the length in the container's header. In the tests it checks the files that Vesicle writes.

use super::FormatError;
use super::glb::FORMAT;
use super::gltf_material::BaseColor;
use crate::math::{DAffine3, DVec3, Vec2, Vec3};
use crate::mesh::{TriangleMesh, WorldPositions};
use glam::{DMat4, DQuat};
use serde_json::Value;
use std::sync::Arc;

/// Maximum total number of triangle corners that are read from a glTF document: nodes may repeat a mesh, so that a
/// small file may stand for any number of triangles.
const CORNER_LIMIT: u64 = 3 << 23;

/// Accepted alternative named in the errors about compressed data and about required extensions that are not supported.
const UNCOMPRESSED: &str = "files without compression (save the mesh without it)";

/// Minimum number of corners that a primitive counts towards [`CORNER_LIMIT`], so that empty primitives repeated by
/// many nodes also reach the limit.
const PRIMITIVE_COST: u64 = 64;

/// Returns whether a file that requires this glTF extension can be read: true for extensions of materials and textures,
/// and for quantised vertex attributes.
fn is_supported_extension(extension: &str) -> bool {
    extension.starts_with("KHR_materials_")
        || ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_texture_basisu", "EXT_texture_webp"]
            .contains(&extension)
}

/// Returns all triangles of the default scene of a glTF document as one mesh, transformed to world space by their
/// nodes. Normals, texture coordinates and colours are read if every triangle primitive has them. If texture
/// coordinates are, the first base colour texture is read, too, provided that its image is in the file.
pub(super) fn triangles(root: &Value, binary: &[u8]) -> Result<TriangleMesh, FormatError> {
    let document = Document { root, binary };
    document.check_extensions()?;
    let parts = document.parts()?;
    let mut mesh: Option<TriangleMesh> = None;
    let mut positions = WorldPositions::default();
    for part in &parts {
        let read = part.primitive.read()?;
        positions.extend(read.positions.iter().map(|p| part.to_world.transform_point3(p.as_dvec3())));
        let read = read.transformed(&part.to_world);
        mesh = Some(match mesh {
            Some(before) => merged(before, read),
            None => read,
        });
    }
    let mut mesh =
        mesh.ok_or_else(|| FormatError::invalid(FORMAT, "meshes", "the scene has no triangles"))?;
    let relative = positions.relative_in(&mesh.triangles);
    (mesh.positions, mesh.origin) = relative.map_err(|error| FormatError::positions(FORMAT, &error))?;
    let base_color = parts.iter().find_map(|part| part.primitive.base_color.as_ref());
    if let Some(base_color) = base_color.filter(|_| mesh.has_uvs()) {
        mesh.texture = base_color.texture(&document)?.map(Arc::new);
    }
    Ok(mesh)
}

/// Returns both meshes as one, with the attributes that both have.
fn merged(mut mesh: TriangleMesh, part: TriangleMesh) -> TriangleMesh {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(part.positions);
    mesh.triangles.extend(part.triangles.into_iter().map(|t| t.map(|v| v + first)));
    mesh.normals = concatenated(mesh.normals, part.normals);
    mesh.uvs = concatenated(mesh.uvs, part.uvs);
    mesh.colors = concatenated(mesh.colors, part.colors);
    mesh
}

/// Concatenates two attribute arrays; `None` if either is missing.
fn concatenated<T>(a: Option<Vec<T>>, b: Option<Vec<T>>) -> Option<Vec<T>> {
    let mut a = a?;
    a.extend(b?);
    Some(a)
}

/// A glTF document: its JSON (`root`) and the binary chunk of the GLB container.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    root: &'a Value,
    binary: &'a [u8],
}

/// A triangle primitive of the scene, with its transform to world space by its node.
struct Part<'a> {
    to_world: DAffine3,
    primitive: Primitive<'a>,
}

impl<'a> Document<'a> {
    /// Returns an error if the file requires an extension that is not supported.
    fn check_extensions(&self) -> Result<(), FormatError> {
        let required = self.root["extensionsRequired"].as_array().map_or(&[][..], Vec::as_slice);
        match required.iter().filter_map(Value::as_str).find(|name| !is_supported_extension(name)) {
            None => Ok(()),
            Some(name) => Err(FormatError::unsupported(FORMAT, "extensionsRequired", name, UNCOMPRESSED)),
        }
    }

    /// Returns entry `index` of one of the document's arrays, such as `meshes`.
    pub(super) fn entry(&self, table: &'static str, index: u64) -> Result<&'a Value, FormatError> {
        let entries = self.root[table].as_array().map_or(&[][..], Vec::as_slice);
        let found = usize::try_from(index).ok().and_then(|i| entries.get(i));
        let problem = || format!("index {index} is out of range; there are {} entries", entries.len());
        found.ok_or_else(|| FormatError::invalid(FORMAT, table, problem()))
    }

    /// Returns all triangle primitives of the default scene, in the order of its nodes. An error if the nodes are not a
    /// tree, or the primitives exceed [`CORNER_LIMIT`].
    fn parts(&self) -> Result<Vec<Part<'a>>, FormatError> {
        let nodes = self.root["nodes"].as_array().map_or(0, Vec::len);
        let mut seen = vec![false; nodes];
        let mut stack: Vec<(u64, DAffine3)> =
            self.roots()?.into_iter().map(|n| (n, DAffine3::IDENTITY)).collect();
        stack.reverse();
        let (mut parts, mut corners) = (Vec::new(), 0_u64);
        while let Some((index, parent)) = stack.pop() {
            let node = self.entry("nodes", index)?;
            if std::mem::replace(&mut seen[index as usize], true) {
                let problem = "is reached twice; nodes must form a tree";
                return Err(FormatError::invalid(FORMAT, format!("nodes[{index}]"), problem));
            }
            let to_world = parent * transform(node, index)?;
            for value in self.primitives(node)? {
                let primitive = Primitive::new(self, value)?;
                let cost = primitive.as_ref().map_or(0, |p| p.corners).max(PRIMITIVE_COST);
                corners = corners.saturating_add(cost);
                if corners > CORNER_LIMIT {
                    return Err(FormatError::too_large(FORMAT, "accessors", corners.saturating_mul(12)));
                }
                parts.extend(primitive.map(|primitive| Part { to_world, primitive }));
            }
            let children = unsigned_list(&node["children"], "children")?;
            stack.extend(children.into_iter().rev().map(|child| (child, to_world)));
        }
        Ok(parts)
    }

    /// Returns the indices of the root nodes of the default scene; without a default, of the first scene; without
    /// scenes, of the document.
    fn roots(&self) -> Result<Vec<u64>, FormatError> {
        if self.root["scenes"].as_array().is_some_and(|scenes| !scenes.is_empty()) {
            let scene = unsigned(self.root, "scene")?.unwrap_or(0);
            return unsigned_list(&self.entry("scenes", scene)?["nodes"], "nodes");
        }
        let nodes = self.root["nodes"].as_array().map_or(&[][..], Vec::as_slice);
        let mut is_child = vec![false; nodes.len()];
        for node in nodes {
            for child in unsigned_list(&node["children"], "children")? {
                self.entry("nodes", child)?;
                is_child[child as usize] = true;
            }
        }
        Ok((0..).zip(is_child).filter_map(|(n, is)| (!is).then_some(n)).collect())
    }

    /// Returns the primitives of the mesh of a node; none if the node has no mesh.
    fn primitives(&self, node: &Value) -> Result<&'a [Value], FormatError> {
        let Some(mesh) = unsigned(node, "mesh")? else { return Ok(&[]) };
        Ok(self.entry("meshes", mesh)?["primitives"].as_array().map_or(&[][..], Vec::as_slice))
    }

    /// Returns the data of accessor `index`. An error if the number of components of its elements is not one of
    /// `widths`, if its data is sparse, or if its buffer view is too short.
    fn accessor(&self, index: u64, widths: &[usize]) -> Result<Accessor<'a>, FormatError> {
        let value = self.entry("accessors", index)?;
        let field = format!("accessors[{index}]");
        if !value["sparse"].is_null() {
            return Err(FormatError::unsupported(FORMAT, field, "sparse data", "data without gaps"));
        }
        let component = Component::parse(value, &field)?;
        let width = element_width(value, widths, &field)?;
        let count = required(value, "count", &field)?;
        let view = self.view(required(value, "bufferView", &field)?)?;
        let element = component.size() * width;
        let stride = view.stride.unwrap_or(element as u64);
        if stride < element as u64 {
            return Err(FormatError::invalid(
                FORMAT,
                field,
                format!("elements of {element} bytes are {stride} apart"),
            ));
        }
        let start = unsigned(value, "byteOffset")?.unwrap_or(0);
        let last = count.saturating_sub(1).saturating_mul(stride);
        let needed = if count == 0 { 0 } else { start.saturating_add(last).saturating_add(element as u64) };
        if needed > view.bytes.len() as u64 {
            let found = view.bytes.len() as u64;
            return Err(FormatError::Truncated { format: FORMAT, field, needed, found });
        }
        let normalized = value["normalized"].as_bool().unwrap_or(false);
        let bytes = view.bytes.get(start as usize..).unwrap_or_default();
        Ok(Accessor { bytes, count: count as usize, stride: stride as usize, width, component, normalized })
    }

    /// Returns the bytes of buffer view `index`; an error unless they are in the binary chunk, uncompressed.
    pub(super) fn view(&self, index: u64) -> Result<View<'a>, FormatError> {
        let value = self.entry("bufferViews", index)?;
        let field = format!("bufferViews[{index}]");
        let buffer = required(value, "buffer", &field)?;
        let outside = buffer != 0 || !self.entry("buffers", buffer)?["uri"].is_null();
        if let Some(name) = compression(value).filter(|name| outside || self.is_fallback_buffer(buffer, name))
        {
            return Err(FormatError::unsupported(FORMAT, field, name, UNCOMPRESSED));
        }
        if outside {
            let accepted = "the file's own binary chunk";
            return Err(FormatError::unsupported(
                FORMAT,
                field,
                format!("buffer {buffer}, outside the file"),
                accepted,
            ));
        }
        let (start, length) =
            (unsigned(value, "byteOffset")?.unwrap_or(0), required(value, "byteLength", &field)?);
        let (needed, found) = (start.saturating_add(length), self.binary.len() as u64);
        let bytes = self.binary.get(start as usize..needed as usize).filter(|_| needed <= found);
        let bytes = bytes.ok_or(FormatError::Truncated { format: FORMAT, field, needed, found })?;
        Ok(View { bytes, stride: unsigned(value, "byteStride")? })
    }

    /// Returns whether a buffer is only a placeholder without data: the buffer views in it are compressed by
    /// `extension`, and their compressed bytes are in another buffer.
    fn is_fallback_buffer(&self, buffer: u64, extension: &str) -> bool {
        let buffer = self.entry("buffers", buffer);
        buffer.is_ok_and(|buffer| buffer["extensions"][extension]["fallback"] == true)
    }

    /// Returns whether an accessor has no buffer view. In a primitive compressed by Draco, its elements are then in the
    /// compressed data of the primitive's extension only.
    fn lacks_buffer_view(&self, accessor: u64) -> bool {
        self.entry("accessors", accessor).is_ok_and(|accessor| accessor["bufferView"].is_null())
    }
}

/// Returns the name of the extension by which a primitive or buffer view is compressed; `None` if it has none of the
/// known ones. A file may hold the same data uncompressed as well, for readers without the extension.
fn compression(value: &Value) -> Option<&'static str> {
    let known = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
    known.into_iter().find(|name| !value["extensions"][name].is_null())
}

/// The bytes of a glTF buffer view, and the number of bytes from one element to the next (`stride`) if the file gives
/// it.
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    stride: Option<u64>,
}

/// How consecutive vertices of a glTF primitive form triangles: as a list, a strip or a fan.
#[derive(Clone, Copy)]
enum Mode {
    List,
    Strip,
    Fan,
}

/// A triangle primitive of a glTF mesh, with its accessors. The accessors' byte ranges have been checked, but not the
/// vertex indices.
struct Primitive<'a> {
    document: Document<'a>,
    attributes: &'a Value,
    mode: Mode,
    positions: Accessor<'a>,
    indices: Option<Accessor<'a>>,
    base_color: Option<BaseColor<'a>>,
    /// Upper bound on the numbers of triangle corners and of vertices, counted towards [`CORNER_LIMIT`].
    corners: u64,
}

impl<'a> Primitive<'a> {
    /// Reads a primitive of a glTF mesh; `None` if it consists of points or lines.
    fn new(document: &Document<'a>, value: &'a Value) -> Result<Option<Self>, FormatError> {
        let mode = match unsigned(value, "mode")?.unwrap_or(4) {
            4 => Mode::List,
            5 => Mode::Strip,
            6 => Mode::Fan,
            _ => return Ok(None),
        };
        let attributes = &value["attributes"];
        check_compression(document, value)?;
        let positions = document.accessor(required(attributes, "POSITION", "attributes")?, &[3])?;
        let indices = unsigned(value, "indices")?.map(|i| document.accessor(i, &[1])).transpose()?;
        let vertices = indices.as_ref().map_or(positions.count, |indices| indices.count) as u64;
        let corners = match mode {
            Mode::List => vertices,
            Mode::Strip | Mode::Fan => vertices.saturating_mul(3),
        };
        let corners = corners.max(positions.count as u64);
        let base_color = BaseColor::of(document, value)?;
        Ok(Some(Self { document: *document, attributes, mode, positions, indices, base_color, corners }))
    }

    /// Returns the primitive's triangles with its normals, texture coordinates and colours.
    fn read(&self) -> Result<TriangleMesh, FormatError> {
        let vectors = |a: Accessor| (0..a.count).map(|i| a.vector(i)).collect();
        Ok(TriangleMesh {
            positions: (0..self.positions.count).map(|i| self.positions.vector(i)).collect(),
            triangles: self.triangles()?,
            normals: self.attribute("NORMAL", &[3])?.map(vectors),
            uvs: self.uvs()?,
            colors: self.attribute("COLOR_0", &[3, 4])?.map(vectors),
            ..TriangleMesh::default()
        })
    }

    /// Returns the texture coordinates for the primitive's base colour texture, with its texture transform applied;
    /// those of set 0 if the primitive has no such texture. `None` if the primitive lacks the set.
    fn uvs(&self) -> Result<Option<Vec<Vec2>>, FormatError> {
        let set = self.base_color.as_ref().map_or(0, |base| base.set);
        let Some(a) = self.attribute(&format!("TEXCOORD_{set}"), &[2])? else { return Ok(None) };
        let uvs = (0..a.count).map(|i| Vec2::new(a.number(i, 0) as f32, a.number(i, 1) as f32));
        Ok(Some(match &self.base_color {
            Some(base) => uvs.map(|uv| base.transform_uv(uv)).collect(),
            None => uvs.collect(),
        }))
    }

    /// Returns the accessor of the vertex attribute `name`, if the primitive has it; an error unless it has one element
    /// per position, of a number of components in `widths`.
    fn attribute(&self, name: &str, widths: &[usize]) -> Result<Option<Accessor<'a>>, FormatError> {
        let Some(index) = unsigned(self.attributes, name)? else { return Ok(None) };
        let accessor = self.document.accessor(index, widths)?;
        if accessor.count != self.positions.count {
            let problem = format!("has {} entries for {} positions", accessor.count, self.positions.count);
            return Err(FormatError::invalid(FORMAT, name, problem));
        }
        Ok(Some(accessor))
    }

    /// Returns the triangles of the primitive as vertex indices, with strips and fans expanded.
    fn triangles(&self) -> Result<Vec<[u32; 3]>, FormatError> {
        let vertices = self.positions.count;
        let order: Vec<u32> = match &self.indices {
            Some(indices) => (0..indices.count).map(|i| indices.number(i, 0) as u32).collect(),
            None => (0..vertices as u32).collect(),
        };
        if let Some(bad) = order.iter().find(|&&v| v as usize >= vertices) {
            let problem = format!("vertex index {bad} is out of range; there are {vertices} vertices");
            return Err(FormatError::invalid(FORMAT, "indices", problem));
        }
        Ok(match self.mode {
            Mode::List => order.as_chunks().0.to_vec(),
            Mode::Strip => {
                (0..).zip(order.windows(3)).map(|(i, w)| [w[0], w[1 + i % 2], w[2 - i % 2]]).collect()
            }
            Mode::Fan => order.windows(2).skip(1).map(|w| [order[0], w[0], w[1]]).collect(),
        })
    }
}

/// Returns an error if a glTF primitive has only compressed data, which this reader cannot decode.
fn check_compression(document: &Document, primitive: &Value) -> Result<(), FormatError> {
    let Some(name) = compression(primitive) else { return Ok(()) };
    let attributes = &primitive["attributes"];
    let used = [unsigned(attributes, "POSITION")?, unsigned(primitive, "indices")?];
    if used[0].is_none() || used.into_iter().flatten().any(|accessor| document.lacks_buffer_view(accessor)) {
        return Err(FormatError::unsupported(FORMAT, "primitives", name, UNCOMPRESSED));
    }
    Ok(())
}

/// Number type of the components of a glTF accessor's elements.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn parse(accessor: &Value, field: &str) -> Result<Self, FormatError> {
        Ok(match required(accessor, "componentType", field)? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => {
                let accepted = "5120 to 5123, 5125 and 5126";
                return Err(FormatError::unsupported(
                    FORMAT,
                    format!("{field}.componentType"),
                    other.to_string(),
                    accepted,
                ));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Returns the stored number of this type that represents 1 in normalised data.
    fn normalization_scale(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 => 4294967295.0,
            Self::F32 => 1.0,
        }
    }
}

/// The elements of a glTF accessor, such as positions or indices; their byte range has been checked.
struct Accessor<'a> {
    bytes: &'a [u8],
    count: usize,
    stride: usize,
    width: usize,
    component: Component,
    normalized: bool,
}

impl Accessor<'_> {
    /// Returns component `k` of element `i`, scaled to −1..1 or 0..1 if the file marks the accessor as normalised.
    fn number(&self, i: usize, k: usize) -> f64 {
        debug_assert!(i < self.count && k < self.width);
        let at = i * self.stride + k * self.component.size();
        let byte = |n: usize| self.bytes.get(at + n).copied().unwrap_or(0);
        let value = match self.component {
            Component::I8 => f64::from(byte(0) as i8),
            Component::U8 => f64::from(byte(0)),
            Component::I16 => f64::from(i16::from_le_bytes([byte(0), byte(1)])),
            Component::U16 => f64::from(u16::from_le_bytes([byte(0), byte(1)])),
            Component::U32 => f64::from(u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
            Component::F32 => f64::from(f32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
        };
        if self.normalized { (value / self.component.normalization_scale()).max(-1.0) } else { value }
    }

    fn vector(&self, i: usize) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|k| self.number(i, k) as f32))
    }
}

/// Returns the number of components of the elements of a glTF accessor; an error unless it is one of `widths`.
fn element_width(accessor: &Value, widths: &[usize], field: &str) -> Result<usize, FormatError> {
    let name = accessor["type"].as_str().unwrap_or("nothing");
    let width = match name {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 0,
    };
    if widths.contains(&width) {
        return Ok(width);
    }
    let found: String = name.chars().take(20).collect();
    let problem = format!("must have elements of {widths:?} components, got {found}");
    Err(FormatError::invalid(FORMAT, format!("{field}.type"), problem))
}

/// Returns the transform of a glTF node relative to its parent, from its matrix or from scale, rotation and
/// translation.
fn transform(node: &Value, index: u64) -> Result<DAffine3, FormatError> {
    let field = |name: &str| format!("nodes[{index}].{name}");
    if let Some(m) = numbers::<16>(&node["matrix"], || field("matrix"))? {
        let matrix = DMat4::from_cols_array(&m);
        return Ok(DAffine3::from_mat4(matrix));
    }
    let scale = numbers(&node["scale"], || field("scale"))?.unwrap_or([1.0; 3]);
    let rotation = numbers(&node["rotation"], || field("rotation"))?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let translation = numbers(&node["translation"], || field("translation"))?.unwrap_or([0.0; 3]);
    let rotation = DQuat::from_array(rotation);
    if rotation.length_squared() <= 0.0 {
        return Err(FormatError::invalid(FORMAT, field("rotation"), "must be a unit quaternion, got 0"));
    }
    Ok(DAffine3::from_scale_rotation_translation(
        DVec3::from_array(scale),
        rotation.normalize(),
        DVec3::from_array(translation),
    ))
}

/// Reads a JSON array of `N` numbers; `None` if it is missing. `field` gives its name for the error message.
pub(super) fn numbers<const N: usize>(
    value: &Value,
    field: impl Fn() -> String,
) -> Result<Option<[f64; N]>, FormatError> {
    if value.is_null() {
        return Ok(None);
    }
    let list = value.as_array().map(|all| all.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
    let found = list.and_then(|all| <[f64; N]>::try_from(all).ok());
    found
        .map(Some)
        .ok_or_else(|| FormatError::invalid(FORMAT, field(), format!("must be an array of {N} numbers")))
}

/// Reads the member `key` of a JSON object, which must be a non-negative integer; `None` if it is missing.
pub(super) fn unsigned(object: &Value, key: &str) -> Result<Option<u64>, FormatError> {
    let value = &object[key];
    if value.is_null() {
        return Ok(None);
    }
    value
        .as_u64()
        .map(Some)
        .ok_or_else(|| FormatError::invalid(FORMAT, key, "must be a non-negative integer"))
}

/// Reads the member `key` of a JSON object, which must be a non-negative integer; an error if it is missing.
pub(super) fn required(object: &Value, key: &str, field: &str) -> Result<u64, FormatError> {
    unsigned(object, key)?.ok_or_else(|| FormatError::invalid(FORMAT, format!("{field}.{key}"), "is missing"))
}

fn unsigned_list(value: &Value, field: &str) -> Result<Vec<u64>, FormatError> {
    let Some(list) = value.as_array() else { return Ok(Vec::new()) };
    let found: Option<Vec<u64>> = list.iter().map(Value::as_u64).collect();
    found.ok_or_else(|| FormatError::invalid(FORMAT, field, "must be an array of non-negative integers"))
}
