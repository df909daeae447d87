//! Affine transforms of meshes, refused if they would damage the surface.

use super::{Mesh, MeshError, TriangleMesh, VertexId, WorldPositions};
use crate::math::{DAffine3, DMat3, Vec3};

/// The smallest accepted volume of the parallelepiped spanned by the normalised columns of a map: below this, it
/// flattens a mesh more than the rounding of positions to single precision.
const MIN_COLUMN_VOLUME: f64 = 1e-8;

/// Returns the affine map of a 4 × 4 matrix, column-major.
///
/// # Errors
/// [`MeshError::InvalidArgument`] (parameter `matrix`) if an entry is not finite, the last row is not 0, 0, 0, 1, or
/// the map is singular: the determinant of its normalised columns is below 1e-8.
pub fn invertible_map(matrix: &[f64; 16]) -> Result<DAffine3, MeshError> {
    if let Some(entry) = matrix.iter().find(|entry| !entry.is_finite()) {
        return Err(invalid(format!("all entries must be finite, got {entry}")));
    }
    let last_row = [matrix[3], matrix[7], matrix[11], matrix[15]];
    if last_row != [0.0, 0.0, 0.0, 1.0] {
        return Err(invalid(format!("must have the last row 0, 0, 0, 1, got {last_row:?}")));
    }
    let [a, b, c, d]: [[f64; 3]; 4] = [0, 4, 8, 12].map(|k| [matrix[k], matrix[k + 1], matrix[k + 2]]);
    let map = DAffine3::from_cols_array_2d(&[a, b, c, d]);
    let volume = column_volume(map.matrix3);
    // Also rejects NaN, which a column of zeros gives.
    if volume >= MIN_COLUMN_VOLUME {
        return Ok(map);
    }
    Err(invalid("must be invertible: the first three columns lie in a plane".into()))
}

/// Returns the volume of the parallelepiped spanned by the normalised columns: 1 if they are orthogonal, 0 if they lie
/// in a plane, NaN if one is zero.
fn column_volume(matrix: DMat3) -> f64 {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|column| {
        // Squares of very large and very small entries would overflow or underflow.
        let scaled = column / column.abs().max_element();
        scaled / scaled.length()
    });
    x.dot(y.cross(z)).abs()
}

fn invalid(problem: String) -> MeshError {
    MeshError::InvalidArgument { parameter: "matrix", problem }
}

/// Checks that `positions`, the result of a transform, are finite.
fn check_positions(positions: &[Vec3]) -> Result<(), MeshError> {
    match positions.iter().position(|p| !p.is_finite()) {
        Some(v) => Err(invalid(format!("moves vertex {v} beyond the range of f32 (3.4e38)"))),
        None => Ok(()),
    }
}

impl TriangleMesh {
    /// Returns the mesh as [`Self::transformed`] does, unless a position would not be finite.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] (parameter `matrix`).
    pub fn checked_transformed(&self, map: &DAffine3) -> Result<Self, MeshError> {
        let moved = self.mapped(map);
        check_positions(&moved.positions)?;
        Ok(moved)
    }
}

impl Mesh {
    /// Transforms the mesh by `map`. A reflection reverses the triangles, so that they still face outwards. Attributes
    /// are unchanged. Must not be called while edits are recorded.
    ///
    /// # Errors
    /// [`MeshError::InvalidArgument`] (parameter `matrix`) if a position would not be finite; the mesh is then
    /// unchanged.
    pub fn transform(&mut self, map: &DAffine3) -> Result<(), MeshError> {
        let world = |v: &VertexId| map.transform_point3(self.position(*v).as_dvec3() + self.origin);
        let vertices: Vec<VertexId> = self.vertices().collect();
        let (moved, origin) = vertices.iter().map(world).collect::<WorldPositions>().relative();
        check_positions(&moved)?;
        self.set_origin(origin);
        let positions = self.positions_mut();
        vertices.iter().zip(moved).for_each(|(v, p)| positions[v.index()] = p);
        if map.matrix3.determinant() < 0.0 {
            self.rings.iter_mut().for_each(super::Ring::reverse);
            self.topology_changed();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{cuboid, torus};
    use super::super::{measure, report};
    use super::*;
    use crate::math::{DVec3, Random};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn random_matrix(random: &mut Random) -> [f64; 16] {
        let mut matrix = [0.0; 16];
        for k in (0..4).flat_map(|column| (0..3).map(move |row| 4 * column + row)) {
            matrix[k] = 4.0 * random.unit() - 2.0;
        }
        matrix[15] = 1.0;
        matrix
    }

    #[test]
    fn meshes_and_lists_are_moved_alike_and_face_outwards() {
        let mut random = Random::new(1);
        let list = Mesh::from_triangles(&torus(2.0, 0.7, 12, 9)).unwrap().to_triangles();
        let volume = measure(&list).volume;
        let mut reflections = 0;
        for _ in 0..50 {
            let map = invertible_map(&random_matrix(&mut random)).unwrap();
            let mut mesh = Mesh::from_triangles(&list).unwrap();
            let versions = mesh.versions();
            mesh.transform(&map).unwrap();
            mesh.check().unwrap();
            let (moved, moved_list) = (mesh.to_triangles(), list.checked_transformed(&map).unwrap());
            assert_eq!(moved.positions, moved_list.positions);
            let determinant = map.matrix3.determinant();
            let expected = volume * determinant.abs();
            for mesh in [&moved, &moved_list] {
                assert!((measure(mesh).volume / expected - 1.0).abs() < 1e-4);
                assert!(report(mesh).unwrap().oriented);
            }
            // The list's own normals are moved as planes are, and stay near those of the triangles.
            let dots =
                moved.normals.unwrap().into_iter().zip(moved_list.normals.unwrap()).map(|(a, b)| a.dot(b));
            assert!(dots.fold(0.0, |sum, dot| sum + dot) / 108.0 > 0.9);
            reflections += u32::from(determinant < 0.0);
            let is_turned = mesh.topology_version() > versions[0];
            assert!(is_turned == (determinant < 0.0) && mesh.geometry_version() > versions[1]);
        }
        assert!((10..40).contains(&reflections), "{reflections}");
    }

    #[test]
    fn singular_and_invalid_matrices_are_refused() {
        let columns = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
            [a[0], a[1], a[2], 0.0, b[0], b[1], b[2], 0.0, c[0], c[1], c[2], 0.0, 5.0, 6.0, 7.0, 1.0]
        };
        let refused = |matrix: [f64; 16]| {
            matches!(invertible_map(&matrix), Err(MeshError::InvalidArgument { parameter: "matrix", .. }))
        };
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(refused(columns(x, y, [0.0; 3])));
        assert!(refused(columns(x, y, [1.0, 1.0, 1e-9])));
        assert!(refused(columns([1e200, 0.0, 0.0], y, [1e300, 1e-9, 0.0])));
        assert!(refused(columns(x, y, [0.0, 0.0, f64::NAN])));
        let mut projective = columns(x, y, z);
        projective[7] = 1e-3;
        assert!(refused(projective));
        for scale in [1e-30, 1e-9, 1e9, 1e30, 1e200] {
            assert!(!refused(columns([scale, 0.0, 0.0], y, [0.0, 0.0, -1.0 / scale])), "{scale}");
        }
    }

    #[test]
    fn what_would_not_be_finite_changes_nothing() {
        let mut mesh = Mesh::from_triangles(&cuboid(Vec3::splat(1e20))).unwrap();
        let before = mesh.clone();
        let map = DAffine3::from_scale(DVec3::new(1e20, 1.0, -1.0));
        assert!(mesh.transform(&map).is_err() && mesh == before);
        assert!(before.to_triangles().checked_transformed(&map).is_err());
    }
}
