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
        self.resize_for_checks(mesh);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::mesh::{PatchCorner, count_self_intersections};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Two balls beside each other; a tip of one that reaches into the other is refused, and everything works as before.
    #[test]
    fn a_patch_that_intersects_the_mesh_changes_nothing() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 4.0, 1.0).unwrap();
        mesh.append(&Mesh::icosphere(Vec3::X * 9.0, 4.0, 1.0).unwrap()).unwrap();
        let x = |mesh: &Mesh, v: VertexId| {
            if mesh.position(v).length() < 4.1 { mesh.position(v).x } else { -9.0 }
        };
        let tip = mesh.vertices().max_by(|&a, &b| x(&mesh, a).total_cmp(&x(&mesh, b))).unwrap();
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 1.0);
        for (reach, fits) in [(4.5, true), (6.0, false), (-4.5, false), (4.8, true)] {
            let fan = mesh.ring(tip).pairs();
            let triangles =
                fan.map(|(a, b)| [PatchCorner::New(0), PatchCorner::Kept(a), PatchCorner::Kept(b)]);
            let patch = Patch { positions: vec![Vec3::X * reach], triangles: triangles.collect() };
            let before = mesh.to_triangles();
            let expected = if fits { Ok(vec![tip]) } else { Err(EditError::WouldSelfIntersect) };
            assert_eq!(embedding.replace(&mut mesh, &[tip], &patch), expected, "{reach}");
            assert_eq!(mesh.to_triangles() == before, !fits);
            assert_eq!((mesh.check(), count_self_intersections(&mesh.to_triangles())), (Ok(()), 0));
            assert!(embedding.is_embedded(&mesh));
        }
        // The guard knows where the new tip is.
        let mut displacements = vec![Vec3::ZERO; mesh.slots()];
        displacements[tip.index()] = Vec3::X;
        assert_eq!(embedding.move_some(&mut mesh, &[tip], &mut displacements).len(), 1);
        assert_eq!(count_self_intersections(&mesh.to_triangles()), 0);
    }
}
