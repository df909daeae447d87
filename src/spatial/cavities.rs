//! Components of a surface that are enclosed by others, such as the walls of cavities.

use super::contains;
use crate::math::{Bounds, BoxTree};
use crate::mesh::{MeshError, TriangleMesh, measure};

/// Returns the indices of the connected components that no larger one encloses, as numbered by
/// [`TriangleMesh::components`]: those that are left when all cavities are filled. A solid inside a cavity is enclosed,
/// too.
///
/// # Errors
/// As [`TriangleMesh::check_closed`].
pub fn outer_components(mesh: &TriangleMesh) -> Result<Vec<u32>, MeshError> {
    mesh.check_closed()?;
    let components = mesh.components();
    let bounds: Vec<Bounds> = components.iter().map(|part| Bounds::from_points(&part.positions)).collect();
    let volumes: Vec<f64> = components.iter().map(|part| measure(part).volume.abs()).collect();
    let tree = BoxTree::new(&bounds);
    let mut is_enclosed = vec![false; components.len()];
    for (j, outer) in components.iter().enumerate() {
        let is_candidate = |i: usize| {
            i != j && !is_enclosed[i] && volumes[i] < volumes[j] && bounds[j].contains_box(&bounds[i])
        };
        let mut candidates = Vec::new();
        tree.for_each_overlapping(&bounds[j], |i| {
            if is_candidate(i as usize) {
                candidates.push(i as usize);
            }
        });
        if candidates.is_empty() {
            continue;
        }
        let points: Vec<_> = candidates.iter().map(|&i| components[i].positions[0].as_dvec3()).collect();
        for (i, is_inside) in candidates.into_iter().zip(contains(outer, points)?) {
            is_enclosed[i] |= is_inside;
        }
    }
    Ok((0..).zip(is_enclosed).filter(|(_, is_enclosed)| !is_enclosed).map(|(i, _)| i).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{joined, torus};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn ball(radius: f32, x: f32) -> TriangleMesh {
        let ball = Mesh::icosphere(Vec3::X * x, radius, 0.5 * radius).unwrap().to_triangles();
        TriangleMesh { normals: None, ..ball }
    }

    fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
        mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        mesh
    }

    #[test]
    fn cavities_and_what_is_in_them_are_enclosed() {
        let parts = [
            inside_out(ball(0.5, 1.0)),
            ball(2.0, 0.0),
            ball(0.2, 1.0),
            inside_out(ball(0.3, -1.0)),
            ball(0.5, 7.0),
            // Its hole holds the ball of radius 2, whose box is in its box, but not the ball.
            torus(4.0, 1.0, 40, 20),
        ];
        let mesh = joined(&parts);
        assert_eq!(outer_components(&mesh), Ok(vec![1, 4, 5]));
        let filled = measure(&mesh.with_components(&[1, 4, 5]).unwrap());
        let expected = measure(&joined(&[parts[1].clone(), parts[4].clone(), parts[5].clone()]));
        assert_eq!((filled.triangles, filled.components), (expected.triangles, 3));
        assert!((filled.volume - expected.volume).abs() < 1e-9);
        assert!(mesh.with_components(&[6]).is_err());
    }

    #[test]
    fn open_meshes_are_rejected() {
        let mut mesh = ball(1.0, 0.0);
        mesh.triangles.pop();
        assert!(matches!(outer_components(&mesh), Err(MeshError::NotClosed { .. })));
    }
}
