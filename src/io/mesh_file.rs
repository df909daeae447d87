//! Mesh files: which format the bytes are in, and what holds for meshes of every format.

use super::{FormatError, glb, glb_writer, mz3, obj, ply, stl, vtp};
use crate::mesh::{MeshError, Texture, TriangleMesh};
use std::sync::Arc;

/// A file format that meshes can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary glTF 2.0.
    Glb,
    /// Polygon file format, binary little-endian.
    Ply,
    /// Stereolithography, binary: triangles alone.
    Stl,
    /// Wavefront object, text.
    Obj,
    /// VTK XML poly data.
    Vtp,
    /// Surfice's and NiiVue's compact mesh, not compressed.
    Mz3,
}

impl MeshFormat {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Glb, Self::Ply, Self::Stl, Self::Obj, Self::Vtp, Self::Mz3];

    /// The usual file extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Obj => "obj",
            Self::Vtp => "vtp",
            Self::Mz3 => "mz3",
        }
    }

    /// The format with that extension, in lower case; `None` where there is none.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.extension() == extension)
    }

    /// Whether v is counted from the lower edge of a picture, and not from the upper one as in glTF.
    fn counts_v_from_below(self) -> bool {
        matches!(self, Self::Ply | Self::Obj | Self::Vtp)
    }
}

/// The mesh in a GLB, PLY, STL or OBJ file, told apart by their content.
///
/// Vertices at one position are one ([`TriangleMesh::welded`]), polygons are fans of triangles, positions are in the
/// file's own units, and texture coordinates as the file has them (v runs down in glTF, up in OBJ and PLY). A GLB that
/// has its texture in it brings it along: the picture of the base colour of the first triangles that have one, with
/// coordinates as `KHR_texture_transform` places them. Memory is linear in the size of the file.
///
/// # Errors
/// [`FormatError`] with the format and the field for bytes in no such format, files that end early, contradict
/// themselves or use what cannot be read, positions that are not finite, and files without triangles.
pub fn parse_mesh(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    Ok(parse_welded(bytes)?.1)
}

/// The same with the picture that belongs to it, for files that have it beside them (OBJ, PLY); in a GLB it takes the
/// place of the file's own. As everywhere where there is a texture, v runs down: that of an OBJ or PLY becomes 1 − v.
///
/// # Errors
/// As [`parse_mesh`], and for files without texture coordinates.
pub fn parse_textured_mesh(bytes: &[u8], texture: Arc<Texture>) -> Result<TriangleMesh, FormatError> {
    let (format, mut mesh) = parse_welded(bytes)?;
    if !mesh.has_uvs() {
        let problem = "there are none for every triangle; a texture needs them";
        return Err(FormatError::invalid(format, "texture coordinates", problem));
    }
    if format != glb::FORMAT {
        mesh.turn_v_over();
    }
    mesh.texture = Some(texture);
    Ok(mesh)
}

fn parse_welded(bytes: &[u8]) -> Result<(&'static str, TriangleMesh), FormatError> {
    let (format, mesh) = parse(bytes)?;
    mesh.validate().map_err(|error| match error {
        MeshError::InvalidArgument { parameter, problem } => FormatError::invalid(format, parameter, problem),
        other => FormatError::invalid(format, "mesh", other.to_string()),
    })?;
    let welded = mesh.welded();
    if welded.triangles.is_empty() {
        return Err(FormatError::invalid(
            format,
            "faces",
            "there are none that span a triangle; at least one is needed",
        ));
    }
    Ok((format, welded))
}

fn parse(bytes: &[u8]) -> Result<(&'static str, TriangleMesh), FormatError> {
    if bytes.starts_with(b"glTF") {
        return Ok(("GLB", glb::parse(bytes)?));
    }
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Ok(("PLY", ply::parse(bytes)?));
    }
    if stl::is_binary(bytes) {
        return Ok(("STL", stl::parse_binary(bytes)?));
    }
    if stl::is_text_stl(bytes) {
        return Ok(("STL", stl::parse_text(bytes)?));
    }
    if obj::is_obj(bytes) {
        return Ok(("OBJ", obj::parse(bytes)?));
    }
    Err(unknown(bytes))
}

/// Whether there are no control characters among the first bytes, but those of text.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    !bytes.iter().take(4096).any(|&b| b < b' ' && !b.is_ascii_whitespace() && b != 0x0b)
}

/// What cannot be read, as precisely as can be told.
fn unknown(bytes: &[u8]) -> FormatError {
    const ACCEPTED: &str = "GLB, PLY, STL and OBJ";
    let unsupported = |found: &str| FormatError::unsupported("mesh file", "format", found, ACCEPTED);
    let text = is_text(bytes);
    match bytes {
        [] => FormatError::truncated("mesh file", "content", 1, 0),
        [0x1f, 0x8b, ..] => unsupported("gzip"),
        [b'{', ..] => unsupported("JSON text (glTF must be the binary kind)"),
        [b'M', b'Z', ..] => unsupported("MZ3"),
        _ if bytes.starts_with(b"<?xml") || bytes.starts_with(b"<VTKFile") => unsupported("XML"),
        // STL has no mark of its own: other bytes with room for its header can only be a broken one.
        _ if !text && bytes.len() >= stl::HEADER => stl::wrong_length(bytes),
        _ if text => unsupported("text without vertices or facets"),
        _ => unsupported("bytes without a known mark"),
    }
}

/// The bytes of a file with the mesh, with the extras that the format knows: all but colours lossless, and those in
/// 8 bits except in GLB and OBJ. Read back by [`parse_mesh`] (not VTP and MZ3), closed is closed.
///
/// A texture is in GLB only. The coordinates of a mesh with one are written to PLY, OBJ and VTP as they count them, v as
/// 1 − v.
///
/// # Errors
/// [`MeshError::InvalidArgument`] for a mesh that is not valid, [`MeshError::TooLarge`] where the file would pass 4
/// GiB.
pub fn write_mesh(mesh: &TriangleMesh, format: MeshFormat) -> Result<Vec<u8>, MeshError> {
    mesh.validate()?;
    check_size(mesh)?;
    let turned = (mesh.texture.is_some() && format.counts_v_from_below()).then(|| {
        let mut mesh = mesh.clone();
        mesh.turn_v_over();
        mesh
    });
    let mesh = turned.as_ref().unwrap_or(mesh);
    Ok(match format {
        MeshFormat::Glb => glb_writer::write(mesh)?,
        MeshFormat::Ply => ply::write(mesh),
        MeshFormat::Stl => stl::write(mesh),
        MeshFormat::Obj => obj::write(mesh),
        MeshFormat::Vtp => vtp::write(mesh),
        MeshFormat::Mz3 => mz3::write(mesh),
    })
}

/// The binary formats count bytes in 32 bits. The most is what GLB takes for a mesh with seams everywhere: three
/// vertices of 44 bytes and three indices a triangle.
fn check_size(mesh: &TriangleMesh) -> Result<(), MeshError> {
    let bytes = 64 * mesh.positions.len() as u64 + 160 * mesh.triangles.len() as u64;
    if bytes > u64::from(u32::MAX) { Err(MeshError::TooLarge { bytes }) } else { Ok(()) }
}

/// Colour channels as bytes.
pub(super) fn color_bytes(color: crate::math::Vec3) -> [u8; 3] {
    color.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// Appends numbers, little-endian.
pub(super) fn push_floats(out: &mut Vec<u8>, values: &[f32]) {
    values.iter().for_each(|x| out.extend(x.to_le_bytes()));
}
