//! Reader of the triangles of a glTF 2.0 document, in the pose and shape that a viewer shows without animation.
//!
//! The document is read as plain JSON, field by field, and every index and range is checked before use. The `gltf`
//! crate is not used because it adds 96 kB of compressed wasm (this reader, with those of all other mesh formats, adds
//! 55) and trusts the length in the container's header. In the tests it checks the files that Vesicle writes.

use super::glb::FORMAT;
use super::gltf_accessor::{Accessor, compression};
use super::gltf_buffer::Buffers;
use super::gltf_material::BaseColor;
use super::gltf_scene::Part;
use super::{FormatError, MeshFile};
use crate::math::order::sort_by_rank;
use crate::math::{Vec2, Vec3};
use crate::mesh::{TriangleMesh, WorldPositions};
use serde_json::Value;
use std::sync::Arc;

/// Accepted alternative named in the errors about compressed data.
pub(super) const UNCOMPRESSED: &str = "files without compression (save the mesh again without Draco or meshopt \
    compression; in Blender's export, untick Compression)";

/// Extensions, or starts of their names, that a file may require although they are not read, since they do not change
/// the shape of a mesh, and those that are read.
const SUPPORTED: [&str; 11] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_xmp",
    "KHR_techniques_webgl",
    "KHR_animation_pointer",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "EXT_mesh_gpu_instancing",
];

/// Returns all triangles of the default scene of a glTF document as one mesh, transformed to world space by their
/// nodes, morphed by their default weights, and posed by their skins; in the space that the root states, if it does. Normals, texture coordinates and colours are read
/// if every triangle primitive has them. If texture coordinates are, the first base colour texture is read, too, provided
/// that its image is in the document or a file beside it. `text` is the number of bytes of the document without its buffers.
pub(super) fn triangles(root: &Value, buffers: &Buffers, text: usize) -> Result<MeshFile, FormatError> {
    let document = Document { root, buffers };
    document.check_extensions()?;
    let parts = document.parts()?;
    if parts.is_empty() {
        return Err(FormatError::invalid(FORMAT, "meshes", "the scene has no triangles"));
    }
    let (mut mesh, mut positions) = Size::of(&parts).allocate(buffers.size, text as u64)?;
    for part in &parts {
        append(&mut mesh, part.read(&mut positions)?, positions.len());
    }
    let relative = positions.relative_in(&mesh.triangles);
    (mesh.positions, mesh.origin) = relative.map_err(|error| FormatError::positions(FORMAT, &error))?;
    let frame = document.frame()?.unwrap_or_default();
    let mut file = MeshFile { space: frame.space, unit: frame.unit, ..MeshFile::from(mesh) };
    let base_color = parts.iter().find_map(|part| part.primitive.base_color.as_ref());
    if let Some(base_color) = base_color.filter(|_| file.mesh.has_uvs()) {
        match base_color.texture(&document)? {
            Ok(texture) => file.mesh.texture = Some(Arc::new(texture)),
            Err(missing) => missing.into_iter().for_each(|name| {
                file.warn(format!(
                    "The texture is in the file '{name}', which is not there: it was left out."
                ));
            }),
        }
    }
    Ok(file)
}

/// Adds a part to a mesh that has `vertices` vertices with those of the part, without its positions and the attributes that
/// the mesh does not have.
fn append(mesh: &mut TriangleMesh, part: TriangleMesh, vertices: usize) {
    let first = (vertices - part.positions.len()) as u32;
    mesh.triangles.extend(part.triangles.into_iter().map(|t| t.map(|v| v + first)));
    extend(&mut mesh.normals, part.normals);
    extend(&mut mesh.uvs, part.uvs);
    extend(&mut mesh.colors, part.colors);
}

fn extend<T>(all: &mut Option<Vec<T>>, part: Option<Vec<T>>) {
    if let (Some(all), Some(part)) = (all, part) {
        all.extend(part);
    }
}

/// Largest number of bytes of a mesh whose file is not large: nodes may repeat a mesh, so that a file may stand for any number
/// of triangles.
const REPEATED_LIMIT: u64 = 1 << 27;

/// Number of bytes of files that are small, and largest number of bytes of their meshes: of the half million triangles, a
/// method may make several times as many.
const SMALL: u64 = 1 << 17;
const REPEATED_LIMIT_OF_SMALL: u64 = 1 << 23;

/// Number of bytes of a mesh for each byte of its file that may always be read: no file without repetition needs more.
const GROWTH: u64 = 12;

/// The size of a scene as one mesh, known before any of it is read.
struct Size {
    vertices: u64,
    triangles: u64,
    /// Whether all parts have normals, texture coordinates and colours.
    attributes: [bool; 3],
}

impl Size {
    fn of(parts: &[Part]) -> Self {
        let mut size = Self { vertices: 0, triangles: 0, attributes: [true; 3] };
        for Part { primitive, .. } in parts {
            size.vertices += primitive.vertex_count();
            size.triangles += primitive.triangle_count();
            let own = primitive.has_attributes();
            size.attributes = std::array::from_fn(|k| size.attributes[k] && own[k]);
        }
        size
    }

    /// Returns a mesh without elements and positions, with memory for all of the scene, whose file has buffers of `buffers`
    /// bytes, and `text` others.
    ///
    /// # Errors
    /// [`FormatError::TooLarge`] for a scene that is far larger than its file, or does not fit in memory.
    fn allocate(&self, buffers: u64, text: u64) -> Result<(TriangleMesh, WorldPositions), FormatError> {
        let [normals, uvs, colors] = self.attributes;
        let vertex = 12 + 12 * u64::from(normals) + 8 * u64::from(uvs) + 12 * u64::from(colors);
        let bytes = self.vertices.saturating_mul(vertex).saturating_add(self.triangles.saturating_mul(12));
        let too_large = || FormatError::too_large(FORMAT, "nodes", bytes);
        let is_small = buffers.saturating_add(text) <= SMALL;
        if is_small && bytes > REPEATED_LIMIT_OF_SMALL {
            let field = "nodes: of a file of up to 128 KiB, they may repeat meshes up to 8 MiB";
            return Err(FormatError::too_large(FORMAT, field, bytes));
        }
        if bytes > REPEATED_LIMIT.max(buffers.saturating_mul(GROWTH)) {
            return Err(too_large());
        }
        let vertices = self.vertices as usize;
        let mut mesh = TriangleMesh {
            normals: normals.then(Vec::new),
            uvs: uvs.then(Vec::new),
            colors: colors.then(Vec::new),
            ..TriangleMesh::default()
        };
        let mut positions = WorldPositions::default();
        let reserved = [
            mesh.triangles.try_reserve_exact(self.triangles as usize),
            mesh.normals.as_mut().map_or(Ok(()), |all| all.try_reserve_exact(vertices)),
            mesh.uvs.as_mut().map_or(Ok(()), |all| all.try_reserve_exact(vertices)),
            mesh.colors.as_mut().map_or(Ok(()), |all| all.try_reserve_exact(vertices)),
            positions.try_reserve(vertices),
        ];
        if reserved.iter().any(Result::is_err) { Err(too_large()) } else { Ok((mesh, positions)) }
    }
}

/// A glTF document: its JSON (`root`) and its buffers.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    pub(super) root: &'a Value,
    pub(super) buffers: &'a Buffers<'a>,
}

impl<'a> Document<'a> {
    /// Returns an error if the file requires an extension that is not supported.
    fn check_extensions(&self) -> Result<(), FormatError> {
        let required = self.root["extensionsRequired"].as_array().map_or(&[][..], Vec::as_slice);
        let is_supported = |name: &&str| !SUPPORTED.iter().any(|supported| name.starts_with(supported));
        let Some(name) = required.iter().filter_map(Value::as_str).find(is_supported) else { return Ok(()) };
        let is_compression = name.ends_with("_compression");
        let without = "files that do not require it (save the mesh without this extension)";
        let accepted = if is_compression { UNCOMPRESSED } else { without };
        Err(FormatError::unsupported(FORMAT, "extensionsRequired", name, accepted))
    }

    /// Returns entry `index` of one of the document's arrays, such as `meshes`.
    pub(super) fn entry(&self, table: &'static str, index: u64) -> Result<&'a Value, FormatError> {
        let entries = self.root[table].as_array().map_or(&[][..], Vec::as_slice);
        let found = usize::try_from(index).ok().and_then(|i| entries.get(i));
        let problem = || format!("index {index} is out of range; there are {} entries", entries.len());
        found.ok_or_else(|| FormatError::invalid(FORMAT, table, problem()))
    }

    /// Returns whether an accessor has no buffer view. In a primitive compressed by Draco, its elements are then in the
    /// compressed data of the primitive's extension only.
    fn lacks_buffer_view(&self, accessor: u64) -> bool {
        self.entry("accessors", accessor).is_ok_and(|accessor| accessor["bufferView"].is_null())
    }
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
pub(super) struct Primitive<'a> {
    document: Document<'a>,
    attributes: &'a Value,
    targets: &'a [Value],
    mode: Mode,
    pub(super) positions: Accessor<'a>,
    indices: Option<Accessor<'a>>,
    base_color: Option<BaseColor<'a>>,
    /// Upper bound on the number of triangle corners.
    pub(super) corners: u64,
}

impl<'a> Primitive<'a> {
    /// Reads a primitive of a glTF mesh; `None` if it consists of points or lines.
    pub(super) fn new(document: &Document<'a>, value: &'a Value) -> Result<Option<Self>, FormatError> {
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
        let base_color = BaseColor::of(document, value)?;
        let targets = value["targets"].as_array().map_or(&[][..], Vec::as_slice);
        let document = *document;
        Ok(Some(Self { document, attributes, targets, mode, positions, indices, base_color, corners }))
    }

    /// Returns an upper bound on the number of triangles.
    fn triangle_count(&self) -> u64 {
        let vertices = self.indices.as_ref().map_or(self.positions.count, |indices| indices.count) as u64;
        match self.mode {
            Mode::List => vertices / 3,
            Mode::Strip | Mode::Fan => vertices.saturating_sub(2),
        }
    }

    /// Returns whether the primitive has normals, texture coordinates and colours.
    fn has_attributes(&self) -> [bool; 3] {
        ["NORMAL", &self.uv_set(), "COLOR_0"].map(|name| !self.attributes[name].is_null())
    }

    /// Returns the name of the texture coordinates for the primitive's base colour texture; those of set 0 if it has none.
    fn uv_set(&self) -> String {
        format!("TEXCOORD_{}", self.base_color.as_ref().map_or(0, |base| base.set))
    }

    /// Returns the primitive's triangles with its normals, texture coordinates and colours, morphed by the weights of its
    /// targets.
    pub(super) fn read(&self, weights: &[f64]) -> Result<PrimitiveMesh, FormatError> {
        let (vertices, order) = self.order()?;
        let vectors = |a: Accessor| vertices.iter().map(|&v| a.vector(v as usize)).collect();
        let mut mesh = TriangleMesh {
            positions: vertices.iter().map(|&v| self.positions.vector(v as usize)).collect(),
            triangles: self.triangles(&order),
            normals: self.attribute("NORMAL", &[3])?.map(vectors),
            uvs: self.uvs(&vertices)?,
            colors: self.attribute("COLOR_0", &[3, 4])?.map(vectors),
            ..TriangleMesh::default()
        };
        self.morph("POSITION", weights, &vertices, &mut mesh.positions)?;
        if let Some(normals) = &mut mesh.normals {
            self.morph("NORMAL", weights, &vertices, normals)?;
        }
        Ok(PrimitiveMesh { mesh, vertices })
    }

    /// Adds the displacements of an attribute by the morph targets, times their weights.
    fn morph(
        &self,
        name: &str,
        weights: &[f64],
        vertices: &[u32],
        vectors: &mut [Vec3],
    ) -> Result<(), FormatError> {
        for (target, &weight) in self.targets.iter().zip(weights).filter(|&(_, &weight)| weight != 0.0) {
            let Some(accessor) = self.attribute_of(target, name, &[3])? else { continue };
            for (vector, &v) in vectors.iter_mut().zip(vertices) {
                let moved = vector.as_dvec3() + accessor.vector(v as usize).as_dvec3() * weight;
                *vector = moved.as_vec3();
            }
        }
        Ok(())
    }

    /// Returns the texture coordinates for the primitive's base colour texture, with its texture transform applied;
    /// those of set 0 if the primitive has no such texture. `None` if the primitive lacks the set.
    fn uvs(&self, vertices: &[u32]) -> Result<Option<Vec<Vec2>>, FormatError> {
        let Some(a) = self.attribute(&self.uv_set(), &[2])? else { return Ok(None) };
        let uv = |v: usize| Vec2::new(a.number(v, 0) as f32, a.number(v, 1) as f32);
        let uvs = vertices.iter().map(|&v| uv(v as usize));
        Ok(Some(match &self.base_color {
            Some(base) => uvs.map(|uv| base.transform_uv(uv)).collect(),
            None => uvs.collect(),
        }))
    }

    /// Returns the accessor of the vertex attribute `name`, if the primitive has it; an error unless it has one element
    /// per position, of a number of components in `widths`.
    pub(super) fn attribute(
        &self,
        name: &str,
        widths: &[usize],
    ) -> Result<Option<Accessor<'a>>, FormatError> {
        self.attribute_of(self.attributes, name, widths)
    }

    /// Returns an attribute of the primitive, or of one of its morph targets, as [`Self::attribute`].
    fn attribute_of(
        &self,
        attributes: &Value,
        name: &str,
        widths: &[usize],
    ) -> Result<Option<Accessor<'a>>, FormatError> {
        let Some(index) = unsigned(attributes, name)? else { return Ok(None) };
        let accessor = self.document.accessor(index, widths)?;
        if accessor.count != self.positions.count {
            let problem = format!("has {} entries for {} positions", accessor.count, self.positions.count);
            return Err(FormatError::invalid(FORMAT, name, problem));
        }
        Ok(Some(accessor))
    }

    /// Returns an upper bound on the number of vertices.
    pub(super) fn vertex_count(&self) -> u64 {
        self.indices.as_ref().map_or(self.positions.count, |indices| indices.count.min(self.positions.count))
            as u64
    }

    /// Returns the vertices of the primitive, and their order in its triangles as indices of these. Those that other
    /// primitives have with the same accessors are left out where there are more than corners.
    fn order(&self) -> Result<(Vec<u32>, Vec<u32>), FormatError> {
        let count = self.positions.count;
        let Some(indices) = &self.indices else {
            let all: Vec<u32> = (0..count as u32).collect();
            return Ok((all.clone(), all));
        };
        let mut order: Vec<u32> = (0..indices.count).map(|i| indices.number(i, 0) as u32).collect();
        if let Some(bad) = order.iter().find(|&&v| v as usize >= count) {
            let problem = format!("vertex index {bad} is out of range; there are {count} vertices");
            return Err(FormatError::invalid(FORMAT, "indices", problem));
        }
        if count <= order.len() {
            return Ok(((0..count as u32).collect(), order));
        }
        let mut used = order.clone();
        sort_by_rank(&mut used, |&v| v.into());
        used.dedup();
        order.iter_mut().for_each(|v| *v = used.partition_point(|used| used < v) as u32);
        Ok((used, order))
    }

    /// Returns the triangles of the primitive, with strips and fans expanded.
    fn triangles(&self, order: &[u32]) -> Vec<[u32; 3]> {
        match self.mode {
            Mode::List => order.as_chunks().0.to_vec(),
            Mode::Strip => {
                (0..).zip(order.windows(3)).map(|(i, w)| [w[0], w[1 + i % 2], w[2 - i % 2]]).collect()
            }
            Mode::Fan => order.windows(2).skip(1).map(|w| [order[0], w[0], w[1]]).collect(),
        }
    }
}

/// The triangles of a primitive.
pub(super) struct PrimitiveMesh {
    pub(super) mesh: TriangleMesh,
    /// Index of each vertex in the accessors.
    pub(super) vertices: Vec<u32>,
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

pub(super) fn unsigned_list(value: &Value, field: &str) -> Result<Vec<u64>, FormatError> {
    let Some(list) = value.as_array() else { return Ok(Vec::new()) };
    let found: Option<Vec<u64>> = list.iter().map(Value::as_u64).collect();
    found.ok_or_else(|| FormatError::invalid(FORMAT, field, "must be an array of non-negative integers"))
}
