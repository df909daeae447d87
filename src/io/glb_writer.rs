//! Writer of GLB (binary glTF): meshes and images become ranges of one buffer, described by the JSON.

use super::WriteOptions;
use super::frame::Frame;
use super::glb::container;
use super::mesh_file::push_floats;
use super::notes::extras;
use crate::math::{Bounds, DVec3, Vec2, Vec3};
use crate::mesh::{ImageKind, MeshError, Texture, TriangleMesh};
use std::sync::Arc;

/// `target` of a glTF buffer view of vertex attributes: WebGL's `ARRAY_BUFFER`.
const VERTICES: Option<u32> = Some(34962);
/// `target` of a glTF buffer view of vertex indices: WebGL's `ELEMENT_ARRAY_BUFFER`.
const INDICES: Option<u32> = Some(34963);

/// Returns the bytes of a GLB file of one mesh, as one node with one primitive: positions, normals (computed if the
/// mesh has none), and the other attributes that the mesh has. Without triangles, the scene has one empty node. If the
/// space or the unit is known, the node is the child of one that maps it to glTF's space.
///
/// # Errors
/// [`MeshError::TooLarge`] if the file would exceed 4 GiB or there is not enough memory for it.
pub(super) fn write(mesh: &TriangleMesh, options: &WriteOptions) -> Result<Vec<u8>, MeshError> {
    let mut parts = DocumentBuilder::new(options);
    let node = if mesh.triangles.is_empty() {
        String::from("{}")
    } else {
        format!(r#"{{"mesh":{}{}}}"#, parts.mesh(mesh)?, translation(mesh.origin))
    };
    parts.nodes.push(node);
    parts.finish("")
}

/// Returns the member of a node's JSON that moves its mesh to its origin, after a comma; empty for that of the world.
pub(super) fn translation(origin: DVec3) -> String {
    if origin == DVec3::ZERO {
        return String::new();
    }
    format!(r#","translation":[{},{},{}]"#, origin.x, origin.y, origin.z)
}

/// A glTF document under construction: its buffer and the entries of its JSON arrays.
#[derive(Default)]
pub(super) struct DocumentBuilder {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    meshes: Vec<String>,
    pub(super) nodes: Vec<String>,
    textures: Vec<Arc<Texture>>,
    images: Vec<String>,
    /// Notes for the reader of the file, in `extras` of the asset.
    notes: String,
    /// The frame of the nodes, which a root node maps to glTF's space.
    frame: Frame,
}

impl DocumentBuilder {
    /// Creates a document without content, which states what the options say.
    pub(super) fn new(options: &WriteOptions) -> Self {
        Self { notes: options.notes.into(), frame: options.frame(), ..Self::default() }
    }

    /// Adds a mesh with its texture and returns its index in the document.
    ///
    /// # Errors
    /// [`MeshError::TooLarge`] if the file would exceed 4 GiB or there is not enough memory for it; no mesh is then
    /// added.
    pub(super) fn mesh(&mut self, mesh: &TriangleMesh) -> Result<usize, MeshError> {
        let material = mesh.texture.as_ref().map(|texture| self.material(texture)).transpose()?;
        let mesh = mesh.split_at_seams();
        self.reserve(44 * mesh.positions.len() + 12 * mesh.triangles.len())?;
        let indices = self.indices(&mesh.triangles);
        let attributes = self.attributes(&mesh);
        let material = material.map_or(String::new(), |number| format!(r#","material":{number}"#));
        self.meshes.push(format!(
            r#"{{"primitives":[{{"attributes":{{{attributes}}},"indices":{indices},"mode":4{material}}}]}}"#
        ));
        Ok(self.meshes.len() - 1)
    }

    /// Adds the vertex attributes of a mesh, including computed normals if it has none, and returns the members of the
    /// primitive's `attributes` object in JSON.
    fn attributes(&mut self, mesh: &TriangleMesh) -> String {
        let bounds = Bounds::from_points(&mesh.positions);
        let [min, max] = [bounds.min, bounds.max].map(|p| format!("[{},{},{}]", p.x, p.y, p.z));
        let position =
            self.vectors(mesh.positions.iter().copied(), VERTICES, &format!(r#","min":{min},"max":{max}"#));
        // glTF requires unit normals: a vertex without one gets +z.
        let unit = |n: &Vec3| n.try_normalize().unwrap_or(Vec3::Z);
        let made = mesh.normals.is_none().then(|| mesh.vertex_normals());
        let normals = mesh.normals.as_ref().or(made.as_ref());
        let normal = self.vectors(normals.map_or(&[][..], Vec::as_slice).iter().map(unit), VERTICES, "");
        let mut attributes = format!(r#""POSITION":{position},"NORMAL":{normal}"#);
        if let Some(uvs) = &mesh.uvs {
            attributes += &format!(r#","TEXCOORD_0":{}"#, self.coordinates(uvs));
        }
        if let Some(colors) = &mesh.colors {
            let clamped = colors.iter().map(|c| c.clamp(Vec3::ZERO, Vec3::ONE));
            attributes += &format!(r#","COLOR_0":{}"#, self.vectors(clamped, VERTICES, ""));
        }
        attributes
    }

    /// Adds a glTF accessor of the triangles' vertex indices and returns its index.
    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let start = self.bytes.len();
        triangles.as_flattened().iter().for_each(|v| self.bytes.extend(v.to_le_bytes()));
        self.accessor(start, INDICES, [5125, 3 * triangles.len()], "SCALAR", "")
    }

    /// Adds a glTF accessor of texture coordinates and returns its index.
    fn coordinates(&mut self, uvs: &[Vec2]) -> usize {
        let start = self.bytes.len();
        uvs.iter().for_each(|uv| push_floats(&mut self.bytes, &uv.to_array()));
        self.accessor(start, VERTICES, [5126, uvs.len()], "VEC2", "")
    }

    /// Adds a glTF accessor of 3D vectors and returns its index; `target` is that of its buffer view, and `extra_json`
    /// is appended to the accessor's JSON.
    pub(super) fn vectors(
        &mut self,
        vectors: impl ExactSizeIterator<Item = Vec3>,
        target: Option<u32>,
        extra_json: &str,
    ) -> usize {
        let (start, count) = (self.bytes.len(), vectors.len());
        vectors.for_each(|v| push_floats(&mut self.bytes, &v.to_array()));
        self.accessor(start, target, [5126, count], "VEC3", extra_json)
    }

    /// Adds a glTF accessor of ascending animation times in seconds and returns its index.
    pub(super) fn times(&mut self, times: &[f32]) -> usize {
        let start = self.bytes.len();
        push_floats(&mut self.bytes, times);
        let [first, last] = [times.first(), times.last()].map(|time| time.copied().unwrap_or(0.0));
        let bounds = format!(r#","min":[{first}],"max":[{last}]"#);
        self.accessor(start, None, [5126, times.len()], "SCALAR", &bounds)
    }

    /// Adds a glTF buffer view from byte `start` to the end of the buffer and an accessor that describes its elements;
    /// returns the accessor's index.
    fn accessor(
        &mut self,
        start: usize,
        target: Option<u32>,
        [component, count]: [usize; 2],
        kind: &str,
        extra_json: &str,
    ) -> usize {
        let view = self.view(start, target);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"{extra_json}}}"#
        ));
        self.accessors.len() - 1
    }

    /// Adds a glTF buffer view from byte `start` to the end of the buffer and returns its index.
    fn view(&mut self, start: usize, target: Option<u32>) -> usize {
        let length = self.bytes.len() - start;
        let target = target.map_or(String::new(), |target| format!(r#","target":{target}"#));
        self.views.push(format!(r#"{{"buffer":0,"byteOffset":{start},"byteLength":{length}{target}}}"#));
        self.views.len() - 1
    }

    /// Returns the index of the glTF material with this texture. Material and image are added if no earlier mesh has an
    /// equal texture, so that each image is stored once.
    fn material(&mut self, texture: &Arc<Texture>) -> Result<usize, MeshError> {
        if let Some(known) = self.textures.iter().position(|known| known == texture) {
            return Ok(known);
        }
        self.reserve(texture.bytes().len() + 3)?;
        let start = self.bytes.len();
        self.bytes.extend(texture.bytes());
        let view = self.view(start, None);
        // Accessors must be aligned to four bytes.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let kind = texture.kind().media_type();
        self.images.push(format!(r#"{{"bufferView":{view},"mimeType":"{kind}"}}"#));
        self.textures.push(Arc::clone(texture));
        Ok(self.textures.len() - 1)
    }

    /// Reserves memory for `additional` bytes of the glTF buffer. Returns an error if there is not enough memory, or if
    /// the buffer would exceed 4 GiB.
    fn reserve(&mut self, additional: usize) -> Result<(), MeshError> {
        let bytes = self.bytes.len() as u64 + additional as u64;
        let fits = bytes <= u64::from(u32::MAX) && self.bytes.try_reserve(additional).is_ok();
        if fits { Ok(()) } else { Err(MeshError::TooLarge { bytes }) }
    }

    /// Returns the bytes of the GLB file, with all nodes as roots of one scene, or as children of the only root if it has to
    /// map them to glTF's space; `extra_json` holds further members of the JSON document, each preceded by a comma.
    ///
    /// # Errors
    /// [`MeshError::TooLarge`] if the file would exceed 4 GiB or there is not enough memory for it.
    pub(super) fn finish(mut self, extra_json: &str) -> Result<Vec<u8>, MeshError> {
        let asset = format!(r#"{{"version":"2.0","generator":"vesicle"{}}}"#, extras(&self.notes));
        let mut json = format!(r#"{{"asset":{asset},"scene":0"#);
        let nodes: Vec<String> = (0..self.nodes.len()).map(|node| node.to_string()).collect();
        let mut roots = nodes.join(",");
        if let Some(root) = self.frame.root(&roots) {
            roots = self.nodes.len().to_string();
            self.nodes.push(root);
        }
        json += &format!(r#","scenes":[{{"nodes":[{roots}]}}]"#);
        json += extra_json;
        json += &self.materials_json();
        let buffers = [format!(r#"{{"byteLength":{}}}"#, self.bytes.len())];
        let buffers = if self.bytes.is_empty() { &[][..] } else { &buffers };
        for (name, entries) in [
            ("nodes", self.nodes.as_slice()),
            ("meshes", &self.meshes),
            ("accessors", &self.accessors),
            ("bufferViews", &self.views),
            ("buffers", buffers),
        ] {
            json += &json_array_member(name, entries);
        }
        container(json + "}", std::mem::take(&mut self.bytes))
    }

    /// Returns the members of the glTF JSON for materials, textures, samplers and images, and the extension for WebP
    /// images, declared as required if there are any.
    fn materials_json(&self) -> String {
        let is_webp = |texture: &Arc<Texture>| texture.kind() == ImageKind::Webp;
        let (mut materials, mut textures) = (Vec::new(), Vec::new());
        for (number, texture) in self.textures.iter().enumerate() {
            // The default factor of 1 makes a metal, which shows little of its base colour.
            materials.push(format!(
                r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{number}}},"metallicFactor":0}}}}"#
            ));
            let source = format!(r#""source":{number}"#);
            let webp = format!(r#""extensions":{{"EXT_texture_webp":{{{source}}}}}"#);
            let source = if is_webp(texture) { webp } else { source };
            textures.push(format!(r#"{{"sampler":0,{source}}}"#));
        }
        let repeat = [String::from(r#"{"wrapS":10497,"wrapT":10497}"#)];
        let samplers = if textures.is_empty() { &[][..] } else { &repeat };
        let names = [String::from(r#""EXT_texture_webp""#)];
        let extensions = if self.textures.iter().any(is_webp) { &names[..] } else { &[] };
        [
            json_array_member("extensionsUsed", extensions),
            json_array_member("extensionsRequired", extensions),
            json_array_member("materials", &materials),
            json_array_member("textures", &textures),
            json_array_member("samplers", samplers),
            json_array_member("images", &self.images),
        ]
        .concat()
    }
}

/// Returns an array as a member of a JSON object, preceded by a comma; nothing for an empty array, which glTF forbids.
pub(super) fn json_array_member(name: &str, entries: &[String]) -> String {
    if entries.is_empty() { String::new() } else { format!(r#","{name}":[{}]"#, entries.join(",")) }
}
