//! Reading and writing of mesh files: detection of the format, and checks common to all formats.

use super::{FormatError, glb, glb_writer, mz3, obj, ply, stl, vtp};
use crate::mesh::{MeshError, Texture, TriangleMesh};
use std::sync::Arc;

/// A file format in which meshes can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary glTF 2.0.
    Glb,
    /// Polygon file format, binary little-endian.
    Ply,
    /// Stereolithography, binary: triangles only.
    Stl,
    /// Wavefront object, text.
    Obj,
    /// VTK XML poly data.
    Vtp,
    /// The compact mesh format of Surfice and NiiVue, without compression.
    Mz3,
}

impl MeshFormat {
    /// All formats in which meshes can be written.
    pub const ALL: [Self; 6] = [Self::Glb, Self::Ply, Self::Stl, Self::Obj, Self::Vtp, Self::Mz3];

    /// Returns the usual file extension of the format, without the dot.
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

    /// Returns the format whose usual file extension is `extension`, given in lower case and without the dot; `None` if
    /// there is none.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.extension() == extension)
    }

    /// Returns whether the format measures the texture coordinate v from the lower edge of the image upwards; glTF
    /// measures it from the upper edge downwards.
    fn has_v_upwards(self) -> bool {
        matches!(self, Self::Ply | Self::Obj | Self::Vtp)
    }
}

/// Reads the mesh in a GLB, PLY, STL or OBJ file, whose format is detected from its content.
///
/// Vertices with equal positions are merged ([`TriangleMesh::welded`]), and triangles that then have two equal corners
/// are dropped. Polygons become triangle fans, positions are in the file's own units, and texture coordinates are kept
/// as in the file (v points down in glTF, up in OBJ and PLY). If all triangles of a GLB have texture coordinates, an
/// embedded texture is read as well: the base colour image of the first triangles that have one, with coordinates
/// transformed by `KHR_texture_transform`. Memory is linear in the size of the file, except that nodes of a GLB may
/// repeat a mesh, up to 25 million triangle corners in total.
///
/// # Errors
/// [`FormatError`] with the format and the field for bytes in no such format, for files that are truncated,
/// contradictory, too large or use an unsupported feature, for positions that are not finite, and for files without
/// triangles.
pub fn parse_mesh(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    Ok(parse_welded(bytes)?.1)
}

/// Reads a mesh as [`parse_mesh`] does, with a texture from a separate file (OBJ, PLY); in a GLB it replaces the file's
/// own. As for every mesh with a texture, v points down: v of an OBJ or PLY becomes 1 − v.
///
/// # Errors
/// As [`parse_mesh`], and for files without texture coordinates.
pub fn parse_textured_mesh(bytes: &[u8], texture: Arc<Texture>) -> Result<TriangleMesh, FormatError> {
    let (format, mut mesh) = parse_welded(bytes)?;
    if !mesh.has_uvs() {
        let problem = "missing; a texture needs them for every triangle";
        return Err(FormatError::invalid(format, "texture coordinates", problem));
    }
    if format != glb::FORMAT {
        mesh.flip_v();
    }
    mesh.texture = Some(texture);
    Ok(mesh)
}

/// Reads a mesh file, checks the mesh and merges vertices of equal position; returns the name of the format and the
/// mesh. An error if no triangle with three distinct corners is left.
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
            "the file has no triangles with three distinct corners",
        ));
    }
    Ok((format, welded))
}

/// Reads a mesh file in the format that its first bytes indicate; returns the name of the format and the mesh.
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
    Err(unsupported_format(bytes))
}

/// Returns whether the bytes look like text: whether the first 4096 contain no control characters other than
/// whitespace.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    !bytes.iter().take(4096).any(|&b| b < b' ' && !b.is_ascii_whitespace() && b != 0x0b)
}

/// Returns the error for the bytes of a file in no accepted mesh format; it names the format if it is recognised.
fn unsupported_format(bytes: &[u8]) -> FormatError {
    const ACCEPTED: &str = "GLB, PLY, STL and OBJ";
    let unsupported = |found: &str| FormatError::unsupported("mesh file", "format", found, ACCEPTED);
    let text = is_text(bytes);
    match bytes {
        [] => FormatError::truncated("mesh file", "content", 1, 0),
        [0x1f, 0x8b, ..] => unsupported("gzip"),
        [b'{', ..] => unsupported("JSON text (glTF must be the binary kind)"),
        [b'M', b'Z', ..] => unsupported("MZ3"),
        _ if bytes.starts_with(b"<?xml") || bytes.starts_with(b"<VTKFile") => unsupported("XML"),
        // STL has no signature: other bytes long enough for its header can only be a broken STL.
        _ if !text && bytes.len() >= stl::HEADER => stl::wrong_length(bytes),
        _ if text => unsupported("text without vertices or facets"),
        _ => unsupported("an unknown binary format"),
    }
}

/// Returns the bytes of a file with the mesh and those of its attributes that the format supports. Attributes are
/// stored without loss, except that GLB normalises normals (or computes them if there are none) and clamps colours to
/// 0..1, and that colours have 8 bits in PLY, VTP and MZ3. A closed mesh is still closed when it is read back by
/// [`parse_mesh`] (which does not read VTP and MZ3).
///
/// Only GLB stores the texture. In PLY, OBJ and VTP, where v points up, the texture coordinates of a mesh with a
/// texture are written with v as 1 − v.
///
/// A mesh with an origin keeps its precision: PLY and VTP then have positions in double precision, GLB moves the node.
///
/// # Errors
/// [`MeshError::InvalidArgument`] for a mesh that is not valid; [`MeshError::Precision`] for STL and MZ3, which have
/// single precision only, where that is too coarse for the mesh; [`MeshError::TooLarge`] if the file might exceed 4 GiB,
/// by a bound for all formats of 64 bytes per vertex and 160 per triangle, or if there is not enough memory for a GLB.
pub fn write_mesh(mesh: &TriangleMesh, format: MeshFormat) -> Result<Vec<u8>, MeshError> {
    write_noted_mesh(mesh, format, "")
}

/// Returns the bytes of a file as [`write_mesh`] does, with notes for the reader of the file, which programs ignore: comment
/// lines in PLY, OBJ and VTP, `extras.warnings` of the asset in GLB, as much as fits of the header of STL; MZ3 has no
/// room for any. Each line of `notes` is one, `code: text`, of which STL has only the code.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_noted_mesh(mesh: &TriangleMesh, format: MeshFormat, notes: &str) -> Result<Vec<u8>, MeshError> {
    mesh.validate()?;
    check_size(mesh)?;
    let turned = (mesh.texture.is_some() && format.has_v_upwards()).then(|| {
        let mut mesh = mesh.clone();
        mesh.flip_v();
        mesh
    });
    let mesh = turned.as_ref().unwrap_or(mesh);
    Ok(match format {
        MeshFormat::Glb => glb_writer::write(mesh, notes)?,
        MeshFormat::Ply => ply::write(mesh, notes),
        MeshFormat::Stl => stl::write(mesh, notes)?,
        MeshFormat::Obj => obj::write(mesh, notes),
        MeshFormat::Vtp => vtp::write(mesh, notes),
        MeshFormat::Mz3 => mz3::write(mesh)?,
    })
}

/// Returns an error if a file of the mesh may exceed 4 GiB: the binary formats store sizes in 32 bits. The bound is
/// above the size of a GLB with seams everywhere, which has three vertices of 44 bytes and three indices per triangle.
fn check_size(mesh: &TriangleMesh) -> Result<(), MeshError> {
    let bytes = 64 * mesh.positions.len() as u64 + 160 * mesh.triangles.len() as u64;
    if bytes > u64::from(u32::MAX) { Err(MeshError::TooLarge { bytes }) } else { Ok(()) }
}

/// Returns the channels of a colour as bytes, 255 for 1; values outside 0..1 are clamped.
pub(super) fn color_bytes(color: crate::math::Vec3) -> [u8; 3] {
    color.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// Appends numbers to the bytes of a file as little-endian 32-bit floats.
pub(super) fn push_floats(out: &mut Vec<u8>, values: &[f32]) {
    values.iter().for_each(|x| out.extend(x.to_le_bytes()));
}
