//! √3 refinement without crossings.

use super::Embedding;
use crate::mesh::{Mesh, MeshError, VertexId};

impl Embedding {
    /// Refines the mesh as [`Mesh::refine`] does, and puts old edges back where triangles across them would cross others.
    ///
    /// A point in the middle of each triangle leaves the surface as it is; only the new edges across the old ones change
    /// it, as much as two triangles of a thin fold or of facing sheets may be apart. Where not even old edges help,
    /// because triangles are as near as rounding, the mesh stays as it was. Returns whether it was refined.
    ///
    /// # Errors
    /// As [`Mesh::refine`].
    pub fn refine(&mut self, mesh: &mut Mesh) -> Result<bool, MeshError> {
        let before = mesh.clone();
        mesh.refine()?;
        let is_new = |v: &VertexId| v.index() >= before.slots();
        loop {
            let crossing = self.look_everywhere(mesh);
            if crossing.is_empty() {
                return Ok(true);
            }
            let mut flips = 0;
            for v in crossing.into_iter().filter(is_new) {
                let across: Vec<VertexId> = mesh.ring(v).as_slice().iter().copied().filter(is_new).collect();
                flips += across.into_iter().filter(|&w| mesh.flip(v, w).is_ok()).count();
            }
            if flips == 0 {
                let refined = std::mem::replace(mesh, before);
                mesh.count_on_from(&refined);
                return Ok(false);
            }
        }
    }
}
