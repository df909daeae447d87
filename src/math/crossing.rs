//! Crossings of a line along x with triangles, from which winding numbers follow: exact, and consistent between
//! triangles that share an edge or a vertex.
//!
//! A point is moved symbolically by an infinitesimal amount along x, by a much smaller one along y and a still smaller
//! one along z (simulation of simplicity; Edelsbrunner & Mücke, 1990). So it is on no triangle, and the line through it
//! meets no edge. A point on the surface belongs to one side of it: of two solids that share a wall, each point of the
//! wall is inside exactly one.

use super::predicates::{orient2d, orient3d_f64};
use super::{DVec2, DVec3};

/// Returns by how much the winding number increases where the line along x through `at`, (y, z), crosses the triangle
/// in the direction of x: 1 where it enters the solid, −1 where it leaves, 0 if the line misses the triangle.
#[inline]
pub fn crossing([a, b, c]: [DVec3; 3], at: DVec2) -> i32 {
    let Some(side) = side_of_edge(a, b, at) else { return 0 };
    if side_of_edge(b, c, at) != Some(side) || side_of_edge(c, a, at) != Some(side) {
        return 0;
    }
    // Counter-clockwise seen from high x means that the triangle faces there.
    if side { -1 } else { 1 }
}

/// Returns whether `p` is beyond the triangle, at the same or a higher x; `crossing` is that of the line through `p`,
/// and not 0.
#[inline]
pub fn is_beyond([a, b, c]: [DVec3; 3], crossing: i32, p: DVec3) -> bool {
    orient3d_f64([a, b, c, p]) * f64::from(crossing) >= 0.0
}

/// Returns whether the point `at` is to the left of an edge projected along x; `None` if the edge projects to a point.
#[inline]
fn side_of_edge(from: DVec3, to: DVec3, at: DVec2) -> Option<bool> {
    let [p, q] = [from, to].map(|p| DVec2::new(p.y, p.z));
    let side = orient2d([p, q, at]);
    if side != 0.0 {
        return Some(side > 0.0);
    }
    // The first nonzero value decides: the displacement of the point along y, then that along z.
    let displaced = [p.y - q.y, q.x - p.x];
    displaced.into_iter().find(|side| *side != 0.0).map(|side| side > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3, triangle};
    use crate::mesh::TriangleMesh;
    use crate::mesh::shapes::{cuboid, torus};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn winding_number(mesh: &TriangleMesh, p: Vec3) -> i32 {
        let (p, at) = (p.as_dvec3(), DVec2::new(p.y.into(), p.z.into()));
        let counted = mesh.corners().map(|corners| {
            let corners = corners.map(|q| q.as_dvec3());
            let crossing = crossing(corners, at);
            if crossing != 0 && is_beyond(corners, crossing, p) { crossing } else { 0 }
        });
        counted.sum()
    }

    #[test]
    fn winding_numbers_are_those_of_solid_angles() {
        let mut random = Random::new(5);
        let mesh = torus(3.0, 1.0, 9, 7);
        let mut inside = 0;
        for _ in 0..2000 {
            let p = Vec3::from([(); 3].map(|()| 8.0 * random.unit() as f32 - 4.0));
            let angle: f64 = mesh.corners().map(|corners| triangle::solid_angle(corners, p)).sum();
            let found = winding_number(&mesh, p);
            assert_eq!(f64::from(found), (angle / (4.0 * std::f64::consts::PI)).round(), "at {p}");
            inside += found;
        }
        assert!(inside > 100, "{inside}");
    }

    /// Integer points on faces, edges and vertices of a cube count as points moved a little along x, y and z.
    #[test]
    fn points_on_the_surface_belong_to_one_side() {
        let mesh = cuboid(Vec3::splat(2.0));
        for (x, y, z) in (0..125).map(|i| (i % 5 - 1, i / 5 % 5 - 1, i / 25 - 1)) {
            let expected = [x, y, z].iter().all(|&k| k == 0 || k == 1);
            let p = Vec3::new(x as f32, y as f32, z as f32);
            assert_eq!(winding_number(&mesh, p), i32::from(expected), "at {p}");
        }
    }
}
