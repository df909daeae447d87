//! √3 refinement without self-intersections.

use super::Embedding;
use crate::mesh::{Mesh, MeshError, VertexId};
use crate::pauses::{Pauses, finished};

impl Embedding {
    /// Refines the mesh as [`Mesh::refine`] does, and flips new edges back if their triangles would intersect others.
    ///
    /// Inserting centre points does not change the surface; flipping the old edges does, and can make triangles of a
    /// thin fold or of facing sheets intersect. If flipping back does not help either, since triangles are as near as
    /// rounding, the mesh stays unrefined. Returns whether it was refined.
    ///
    /// # Errors
    /// As [`Mesh::refine`].
    pub fn refine(&mut self, mesh: &mut Mesh) -> Result<bool, MeshError> {
        finished(self.refine_in_slices(mesh, &Pauses::default()))
    }

    /// Does what [`Self::refine`] does, and pauses meanwhile.
    ///
    /// # Errors
    /// As [`Mesh::refine`].
    pub async fn refine_in_slices(&mut self, mesh: &mut Mesh, pauses: &Pauses) -> Result<bool, MeshError> {
        self.free();
        let (before, slots) = (mesh.connectivity(), mesh.slots());
        mesh.refine()?;
        let is_new = |v: &VertexId| v.index() >= slots;
        loop {
            let intersecting = self.check_all_in_slices(mesh, pauses).await;
            if intersecting.is_empty() {
                return Ok(true);
            }
            let mut flips = 0;
            for v in intersecting.into_iter().filter(is_new) {
                let across: Vec<VertexId> = mesh.ring(v).as_slice().iter().copied().filter(is_new).collect();
                flips += across.into_iter().filter(|&w| mesh.flip(v, w).is_ok()).count();
            }
            if flips == 0 {
                // Neither refinement nor flips changed old vertices but for their one-rings.
                let positions = mesh.positions()[..slots].to_vec();
                mesh.set_back(&before, &positions);
                return Ok(false);
            }
        }
    }
}
