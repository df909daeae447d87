//! Writer of MZ3, the compact mesh format of Surfice and NiiVue, without compression.

use super::mesh_file::{color_bytes, push_floats};
use crate::mesh::{MeshError, TriangleMesh};

const HAS_FACES: u16 = 1;
const HAS_VERTICES: u16 = 2;
const HAS_COLORS: u16 = 4;

/// Returns the bytes of an MZ3 file of the mesh. Layout, little-endian: "MZ", flags for what the file holds, counts of
/// faces and vertices, number of bytes to skip (0); faces, vertices, then colours (rgba) if the mesh has them.
///
/// # Errors
/// [`MeshError::Precision`] if single precision is too coarse for the mesh where it is in world space.
pub(super) fn write(mesh: &TriangleMesh) -> Result<Vec<u8>, MeshError> {
    let positions = mesh.world_positions()?;
    let colors = if mesh.colors.is_some() { HAS_COLORS } else { 0 };
    let mut out = Vec::with_capacity(16 + 12 * mesh.triangles.len() + 16 * mesh.positions.len());
    out.extend(b"MZ");
    out.extend((HAS_FACES | HAS_VERTICES | colors).to_le_bytes());
    for count in [mesh.triangles.len() as u32, mesh.positions.len() as u32, 0] {
        out.extend(count.to_le_bytes());
    }
    mesh.triangles.as_flattened().iter().for_each(|v| out.extend(v.to_le_bytes()));
    positions.iter().for_each(|p| push_floats(&mut out, &p.to_array()));
    for &color in mesh.colors.iter().flatten() {
        let [r, g, b] = color_bytes(color);
        out.extend([r, g, b, 255]);
    }
    Ok(out)
}
