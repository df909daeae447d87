//! Exact inside tests of points.

use super::TriangleTree;
use crate::math::crossing::{crossing, is_beyond};
use crate::math::{Bounds, DVec2, DVec3, Vec3};
use crate::mesh::{MeshError, TriangleMesh};
use crate::pauses::{Pauses, finished};

/// Returns for each point, relative to the origin of the mesh, whether it is inside a closed mesh: whether its winding
/// number, the number of times the surface encloses it, is not 0. False for points that are not finite.
///
/// Exact. A point on the surface counts as moved by an infinitesimal amount along x, y and z; see
/// [`crossing`](crate::math::crossing). A mesh is closed if its edges have equally many triangles in both directions;
/// it may intersect itself.
///
/// # Errors
/// As [`TriangleMesh::check_closed`].
pub fn contains(
    mesh: &TriangleMesh,
    points: impl IntoIterator<Item = DVec3>,
) -> Result<Vec<bool>, MeshError> {
    finished(contains_in_slices(mesh, points, &Pauses::default()))
}

/// Does what [`contains`] does, and pauses meanwhile.
///
/// # Errors
/// As [`contains`].
pub async fn contains_in_slices(
    mesh: &TriangleMesh,
    points: impl IntoIterator<Item = DVec3>,
    pauses: &Pauses,
) -> Result<Vec<bool>, MeshError> {
    mesh.check_closed()?;
    pauses.now().await;
    let tree = TriangleTree::in_slices(mesh, pauses).await?;
    let mut inside = Vec::new();
    for p in points {
        let (mut winding, mut crossed) = (0, 0);
        // Beyond the range of single precision there is no mesh.
        if p.as_vec3().is_finite() {
            (winding, crossed) = winding_number(mesh, &tree, p);
        }
        inside.push(winding != 0);
        pauses.after(1 + crossed / TRIANGLES_PER_UNIT).await;
    }
    Ok(inside)
}

/// Number of triangles along a line that are a unit of work.
const TRIANGLES_PER_UNIT: usize = 64;

/// Returns the winding number of a finite point, from the triangles between it and infinity at low x, and the number of
/// those whose boxes are there. `tree` is that of the mesh, which is closed.
pub(super) fn winding_number(mesh: &TriangleMesh, tree: &TriangleTree, p: DVec3) -> (i32, usize) {
    // Rounding is monotonic, so a line that meets a box of single precision still does when it is rounded.
    let end = p.as_vec3();
    let line = Bounds { min: Vec3::new(f32::NEG_INFINITY, end.y, end.z), max: end };
    let at = DVec2::new(p.y, p.z);
    let (mut winding, mut triangles) = (0, 0);
    tree.for_each_overlapping(&line, |t| {
        triangles += 1;
        let corners = mesh.triangles[t as usize].map(|v| mesh.positions[v as usize].as_dvec3());
        let crossing = crossing(corners, at);
        if crossing != 0 && is_beyond(corners, crossing, p) {
            winding += crossing;
        }
    });
    (winding, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, triangle};
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, joined, torus};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn doubles(points: &[Vec3]) -> impl Iterator<Item = DVec3> {
        points.iter().map(|p| p.as_dvec3())
    }

    #[test]
    fn points_are_not_rounded() {
        for size in [1.0, 1e6, 1e7, 1e20] {
            let mut mesh = cuboid(Vec3::splat(size));
            mesh.origin = DVec3::splat(1e9);
            for axis in DVec3::AXES {
                let middle = DVec3::new(1.0 / 3.0, 0.2, 0.7) * (DVec3::ONE - axis);
                let at = [-1e-12, 1e-12, 1.0 - 1e-12, 1.0 + 1e-12];
                let points = at.map(|x| (middle + x * axis) * f64::from(size));
                let found = contains(&mesh, points).unwrap();
                assert_eq!(found, [false, true, true, false], "size {size}, {axis}");
            }
        }
    }

    #[test]
    fn points_are_inside_if_their_winding_number_is_not_0() {
        let mut inside = 0;
        for seed in 0..20 {
            let mut random = Random::new(seed);
            let mut vector = |size: f32| Vec3::from([(); 3].map(|()| size * (random.unit() as f32 - 0.5)));
            let ball = Mesh::icosphere(vector(4.0), 2.0, 1.0).unwrap().to_triangles();
            let mut mesh = joined(&[ball, torus(3.0, 1.0, 12, 7)]);
            mesh.positions.iter_mut().for_each(|p| *p += vector(0.1 * seed as f32));
            let points: Vec<Vec3> = (0..200).map(|_| vector(9.0)).collect();
            for (p, found) in points.iter().zip(contains(&mesh, doubles(&points)).unwrap()) {
                let angle: f64 = mesh.corners().map(|corners| triangle::solid_angle(corners, *p)).sum();
                assert_eq!(found, angle.abs() > std::f64::consts::TAU, "seed {seed}, {p}");
                inside += usize::from(found);
            }
        }
        assert!(inside > 400, "{inside}");
    }

    #[test]
    fn points_on_the_surface_belong_to_one_of_two_solids() {
        let cube = cuboid(Vec3::ONE);
        let points: Vec<Vec3> =
            (0..64).map(|i| Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32)).collect();
        let mut found = vec![0; 64];
        for at in points.iter().filter(|p| p.max_element() < 3.0) {
            let mut mesh = cube.clone();
            mesh.positions.iter_mut().for_each(|p| *p += *at);
            contains(&mesh, doubles(&points))
                .unwrap()
                .iter()
                .zip(&mut found)
                .for_each(|(new, sum)| *sum += u32::from(*new));
        }
        for (p, count) in points.iter().zip(found) {
            assert_eq!(count, u32::from(p.max_element() < 3.0), "{p}");
        }
    }

    #[test]
    fn what_has_no_inside() {
        let mut open = cuboid(Vec3::ONE);
        open.triangles.pop();
        assert!(matches!(contains(&open, []), Err(MeshError::NotClosed { .. })));
        assert_eq!(contains(&TriangleMesh::default(), [DVec3::ZERO]), Ok(vec![false]));
        let points = [DVec3::NAN, DVec3::INFINITY, DVec3::splat(0.5), DVec3::new(1e300, 0.5, 0.5)];
        assert_eq!(contains(&cuboid(Vec3::ONE), points), Ok(vec![false, false, true, false]));
    }
}
