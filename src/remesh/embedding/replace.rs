//! Replaces part of the surface by another one, unless triangles would intersect.

use super::Embedding;
use super::motion_bound::Checks;
use crate::mesh::{EditError, Mesh, Patch, VertexId};

impl Embedding {
    /// Replaces triangles of the mesh as [`Mesh::replace`] does, and returns the new vertices. Unlike
    /// [`Self::attempt`], it takes time in proportion to the size of the patch also if that is large.
    ///
    /// # Errors
    /// As [`Mesh::replace`], and [`EditError::WouldSelfIntersect`]. The mesh is unchanged on error.
    pub fn replace(
        &mut self,
        mesh: &mut Mesh,
        removed: &[VertexId],
        patch: &Patch,
    ) -> Result<Vec<VertexId>, EditError> {
        self.sync(mesh);
        mesh.begin();
        let result = mesh.replace(removed, patch).and_then(|added| {
            self.sync_touched(mesh);
            if self.check_dirty(mesh).is_empty() { Ok(added) } else { Err(EditError::WouldSelfIntersect) }
        });
        match result {
            Ok(_) => {
                mesh.commit();
                self.version = Some(mesh.geometry_version());
            }
            Err(_) => {
                mesh.roll_back();
                // Grid and lists of near vertices contain the patch.
                self.version = None;
            }
        }
        result
    }

    /// Updates the grid with the edits since [`Mesh::begin`], and marks the vertices that they touched for all checks.
    fn sync_touched(&mut self, mesh: &Mesh) {
        self.resize_for(mesh.slots());
        self.pending.resize(mesh.slots(), Checks::default());
        for v in mesh.touched_vertices() {
            self.forget(v);
            if mesh.is_live(v) {
                self.measure(mesh, v);
                self.enter(mesh, v);
                self.mark_dirty(v, Checks::ALL);
            } else {
                self.grid.remove(v);
            }
        }
        self.mark_edited_dirty(mesh);
    }
}
