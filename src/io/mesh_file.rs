//! Reading and writing of mesh files: detection of the format, and checks common to all formats.

use super::frame::half_turn;
use super::points::full_channel;
use super::text::without_byte_order_mark;
use super::{FormatError, WriteOptions, glb, glb_writer, mz3, obj, ply, stl, vtp};
use crate::mesh::{MeshError, Texture, TriangleMesh};
use crate::volume::{LengthUnit, Space};
use crate::warning::{Warning, WarningCode};
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

/// The content of a mesh file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshFile {
    /// The mesh, with positions in the file's units and space.
    pub mesh: TriangleMesh,
    /// The directions of the axes, if the file states them: `SPACE=RAS` or `SPACE=LPS` in a comment, as 3D Slicer writes
    /// it, or the root node of a GLB that [`write_mesh_with`] wrote.
    pub space: Option<Space>,
    /// The length of a unit of positions, if the file states it, as such a GLB does.
    pub unit: LengthUnit,
    /// Warnings about the mesh: parts that were left out, and assumptions.
    pub warnings: Vec<Warning>,
}

impl MeshFile {
    /// Adds a warning of the reader.
    pub(super) fn warn(&mut self, text: impl Into<String>) {
        self.warnings.push(Warning::new(WarningCode::Reader, text));
    }
}

impl From<TriangleMesh> for MeshFile {
    fn from(mesh: TriangleMesh) -> Self {
        Self { mesh, ..Self::default() }
    }
}

/// Inputs for reading a mesh file besides its bytes.
#[derive(Clone, Debug, Default)]
pub struct MeshOptions<'a> {
    /// A texture from a separate file (OBJ, PLY); in a GLB it replaces the file's own. As for every mesh with a texture,
    /// v then points down: v of an OBJ or PLY becomes 1 − v.
    pub texture: Option<Arc<Texture>>,
    /// The names and bytes of the files beside it, for the buffers and images that a glTF document refers to. A name may
    /// have folders; only its end has to agree.
    pub files: &'a [(&'a str, &'a [u8])],
}

/// Reads the mesh in a GLB, PLY, STL or OBJ file, or in a glTF document whose buffers are in data URIs; the format is
/// detected from the content.
///
/// Vertices with equal positions are merged ([`TriangleMesh::welded`]), and triangles that then have two equal corners
/// are dropped. Polygons become triangles: a fan where that covers the polygon, else by ear clipping as seen along their
/// mean normal ([`triangulate_face`](crate::math::triangulate_face)). Positions are in the file's own units, and texture
/// coordinates are kept as in the file (v points down in glTF, up in OBJ and PLY). If all triangles of a GLB have texture
/// coordinates, a texture is read as well: the base colour image of the first triangles that have one, with coordinates
/// transformed by `KHR_texture_transform`. Memory is linear in the size of the file, except that nodes of a GLB may
/// repeat a mesh, up to 25 million triangle corners in total.
///
/// # Errors
/// [`FormatError`] with the format and the field for bytes in no such format, for files that are truncated,
/// contradictory, too large or use an unsupported feature, for positions that are not finite, and for files without
/// triangles.
pub fn parse_mesh(bytes: &[u8]) -> Result<TriangleMesh, FormatError> {
    Ok(read_mesh(bytes, MeshOptions::default())?.mesh)
}

/// Reads a mesh as [`parse_mesh`] does, with a texture from a separate file; see [`MeshOptions::texture`].
///
/// # Errors
/// As [`parse_mesh`], and for files without texture coordinates.
pub fn parse_textured_mesh(bytes: &[u8], texture: Arc<Texture>) -> Result<TriangleMesh, FormatError> {
    Ok(read_mesh(bytes, MeshOptions { texture: Some(texture), ..MeshOptions::default() })?.mesh)
}

/// Reads a mesh as [`parse_mesh`] does, and what else its file states.
///
/// # Errors
/// As [`parse_mesh`]; for a texture and a file without texture coordinates; for a glTF document that refers to a buffer
/// in a file that is not among those beside it, which the error names.
pub fn read_mesh(bytes: &[u8], options: MeshOptions) -> Result<MeshFile, FormatError> {
    let (format, mut file) = parse_welded(bytes, options.files)?;
    let Some(texture) = options.texture else { return Ok(file) };
    if !file.mesh.has_uvs() {
        let problem = "missing; a texture needs them for every triangle";
        return Err(FormatError::invalid(format, "texture coordinates", problem));
    }
    if ![glb::FORMAT, glb::TEXT_FORMAT].contains(&format) {
        file.mesh.flip_v();
    }
    file.mesh.texture = Some(texture);
    Ok(file)
}

/// Reads a mesh file, checks the mesh and merges vertices of equal position; returns the name of the format and the
/// content. An error if no triangle with three distinct corners is left.
fn parse_welded(bytes: &[u8], files: &[(&str, &[u8])]) -> Result<(&'static str, MeshFile), FormatError> {
    let (format, mut file) = parse(bytes, files)?;
    file.mesh.validate().map_err(|error| match error {
        MeshError::InvalidArgument { parameter, problem } => FormatError::invalid(format, parameter, problem),
        other => FormatError::invalid(format, "mesh", other.to_string()),
    })?;
    file.mesh = file.mesh.welded();
    if file.mesh.triangles.is_empty() {
        let problem = "the file has no triangles with three distinct corners";
        return Err(FormatError::invalid(format, "faces", problem));
    }
    drop_broken_attributes(&mut file);
    if let Some(colors) = &mut file.mesh.colors
        && let Some(full) = full_channel(colors.iter().copied())
    {
        colors.iter_mut().for_each(|color| *color /= full);
    }
    Ok((format, file))
}

/// Removes texture coordinates and colours that are not finite, with a warning. Normals that aren't are 0 by now.
fn drop_broken_attributes(file: &mut MeshFile) {
    let mesh = &mut file.mesh;
    let broken_uvs = mesh.uvs.iter().flatten().any(|uv| !uv.is_finite())
        || mesh.corner_uvs.iter().flatten().flatten().any(|uv| !uv.is_finite());
    let broken_colors = mesh.colors.iter().flatten().any(|color| !color.is_finite());
    if broken_uvs {
        (mesh.uvs, mesh.corner_uvs, mesh.texture) = (None, None, None);
    }
    if broken_colors {
        mesh.colors = None;
    }
    for (is_broken, name) in [(broken_uvs, "texture coordinates"), (broken_colors, "colours")] {
        if is_broken {
            file.warn(format!("Some {name} are not finite numbers: all were left out."));
        }
    }
}

/// Reads a mesh file in the format that its first bytes indicate; returns the name of the format and the content.
fn parse(bytes: &[u8], files: &[(&str, &[u8])]) -> Result<(&'static str, MeshFile), FormatError> {
    if bytes.starts_with(b"glTF") {
        return Ok((glb::FORMAT, glb::parse(bytes, files)?));
    }
    if stl::is_binary(bytes) && !ply::is_ply(bytes) {
        return Ok((stl::FORMAT, stl::parse_binary(bytes)?));
    }
    let text = without_byte_order_mark(bytes);
    let bytes = text.as_deref().unwrap_or(bytes);
    if ply::is_ply(bytes) {
        return Ok((ply::FORMAT, ply::parse(bytes)?));
    }
    if glb::is_text(bytes) {
        return Ok((glb::TEXT_FORMAT, glb::parse_text(bytes, files)?));
    }
    if stl::is_text_stl(bytes) {
        return Ok((stl::FORMAT, stl::parse_text(bytes)?));
    }
    if obj::is_obj(bytes) {
        return Ok((obj::FORMAT, obj::parse(bytes)?));
    }
    if !is_text(bytes) && stl::resembles_binary(bytes) {
        return Ok((stl::FORMAT, stl::parse_binary(bytes)?));
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
    const ACCEPTED: &str = "GLB, glTF, PLY, STL and OBJ";
    if bytes.is_empty() {
        return FormatError::truncated("mesh file", "content", 1, 0);
    }
    let unknown = if is_text(bytes) { "text without vertices or facets" } else { "an unknown binary format" };
    FormatError::unsupported("mesh file", "format", known_format(bytes).unwrap_or(unknown), ACCEPTED)
}

/// Returns the name of a format that is not read, by the first bytes of a file; `None` if they are of no known one.
pub(super) fn known_format(bytes: &[u8]) -> Option<&'static str> {
    let bytes = bytes.trim_ascii_start();
    const MARKS: [(&[u8], &str); 18] = [
        (b"\x1f\x8b", "gzip"),
        (b"PK\x03\x04", "zip, which 3MF and USDZ are (unpack it first)"),
        (b"MZ", "MZ3"),
        (b"<!DOCTYPE html", "HTML, a web page in place of the file"),
        (b"<!doctype html", "HTML, a web page in place of the file"),
        (b"<html", "HTML, a web page in place of the file"),
        (b"<HTML", "HTML, a web page in place of the file"),
        (b"<?xml", "XML"),
        (b"<VTKFile", "XML"),
        (b"# vtk", "VTK legacy"),
        (b"# .PCD", "PCD"),
        (b"OFF", "OFF"),
        (b"COFF", "OFF"),
        (b"NOFF", "OFF"),
        (b"LASF", "LAS"),
        (b"Kaydara FBX", "FBX"),
        (b"BLENDER", "a Blender document"),
        (b"%PDF", "PDF"),
    ];
    MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|&(_, name)| name)
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
    write_mesh_with(mesh, format, &WriteOptions::default())
}

/// Returns the bytes of a file as [`write_mesh`] does, with what else is to be stated in it.
///
/// The space is stated as 3D Slicer reads it, which takes files without for LPS: `SPACE=RAS` or `SPACE=LPS` in the header
/// of STL, in a comment of PLY and OBJ, in field data of VTP. In GLB, a root node maps positions to metres and y upwards,
/// and its `extras` are `space` and `unit`; [`read_mesh`] gives back positions as they were. MZ3 states nothing.
///
/// Notes are comment lines in PLY, OBJ and VTP, `extras.warnings` of the asset in GLB, as much as fits of the header of
/// STL, which has only their codes; MZ3 has no room for any.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_mesh_with(
    mesh: &TriangleMesh,
    format: MeshFormat,
    options: &WriteOptions,
) -> Result<Vec<u8>, MeshError> {
    mesh.validate()?;
    check_size(mesh)?;
    let turned = options.turns().then(|| half_turn(mesh.clone()));
    let mesh = turned.as_ref().unwrap_or(mesh);
    let flipped = (mesh.texture.is_some() && format.has_v_upwards()).then(|| {
        let mut mesh = mesh.clone();
        mesh.flip_v();
        mesh
    });
    let mesh = flipped.as_ref().unwrap_or(mesh);
    Ok(match format {
        MeshFormat::Glb => glb_writer::write(mesh, options)?,
        MeshFormat::Ply => ply::write(mesh, options),
        MeshFormat::Stl => stl::write(mesh, options)?,
        MeshFormat::Obj => obj::write(mesh, options),
        MeshFormat::Vtp => vtp::write(mesh, options),
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
