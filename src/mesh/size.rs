//! The largest size to which meshes grow.

use super::{Mesh, MeshError};

/// The largest number of vertices to which a mesh is refined, restructured, remeshed or extended.
///
/// WebAssembly has 4 GiB of memory. A vertex of the mesh has 67 bytes. What needs most, together with it, is decimation
/// within a distance, with 830 bytes for each; files of text need up to 690 while they grow, [`report`](super::report) 650,
/// remeshing 550 where sheets intersect, other decimation 500, and [`measure`](super::measure) 470: at most 3.3 GB at this
/// limit, measured with 64-bit pointers. The rest is for whatever else is in the same memory, and for gaps. Meshes that
/// are larger when they are read may be made smaller.
pub const MAX_VERTICES: usize = 4_000_000;

impl Mesh {
    /// Checks that the mesh may have `more` vertices.
    ///
    /// # Errors
    /// [`MeshError::TooManyVertices`] if it would have more than [`MAX_VERTICES`], or if there are not enough ids.
    pub(super) fn check_room(&self, more: usize) -> Result<(), MeshError> {
        let vertices = self.vertex_count().saturating_add(more);
        if vertices <= MAX_VERTICES && self.has_ids_for(more) {
            return Ok(());
        }
        Err(MeshError::TooManyVertices { vertices: vertices as u64 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn the_limit_itself_is_allowed() {
        let mesh = Mesh::icosahedron(Vec3::ZERO, 1.0);
        assert_eq!(mesh.check_room(MAX_VERTICES - 12), Ok(()));
        for more in [MAX_VERTICES - 11, usize::MAX] {
            let vertices = more.saturating_add(12) as u64;
            assert_eq!(mesh.check_room(more), Err(MeshError::TooManyVertices { vertices }));
        }
    }

    #[test]
    fn meshes_do_not_grow_beyond_the_limit() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.004).unwrap();
        let [vertices, triangles] = mesh.counts();
        assert!(vertices + triangles > MAX_VERTICES && vertices < MAX_VERTICES);
        let refused = MeshError::TooManyVertices { vertices: (vertices + triangles) as u64 };
        assert_eq!(mesh.refine(), Err(refused));
        assert_eq!(mesh.counts(), [vertices, triangles]);
        let other = mesh.clone();
        mesh.append(&other).unwrap();
        let refused = MeshError::TooManyVertices { vertices: 3 * vertices as u64 };
        assert_eq!(mesh.append(&other), Err(refused));
        assert_eq!(mesh.counts(), [2 * vertices, 2 * triangles]);
    }

    #[test]
    fn spheres_beyond_the_limit_are_refused() {
        for edge in [0.001, 1e-6, 1e-30] {
            let Err(MeshError::TooManyVertices { vertices }) = Mesh::icosphere(Vec3::ZERO, 1.0, edge) else {
                panic!("{edge}");
            };
            let square = (f64::from(edge) * f64::from(edge)).max(1e-18);
            assert!(vertices as f64 > 14.0 / square, "{edge}: {vertices}");
        }
    }
}
