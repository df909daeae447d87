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
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the triangles of the octahedron with the given opposite corners along x, y and z.
    fn octahedron([x, y, z]: [[Vec3; 2]; 3]) -> Vec<[Vec3; 3]> {
        let corners = (0..8).map(|k| ([k & 1, k >> 1 & 1, k >> 2], [x[k & 1], y[k >> 1 & 1], z[k >> 2]]));
        // Counter-clockwise seen from outside for an even number of low corners.
        corners
            .map(
                |(sides, [a, b, c])| if sides.iter().sum::<usize>() % 2 == 1 { [a, b, c] } else { [a, c, b] },
            )
            .collect()
    }

    fn winding_number(surface: &[[Vec3; 3]], p: Vec3) -> i32 {
        let (p, at) = (p.as_dvec3(), DVec2::new(p.y.into(), p.z.into()));
        let counted = surface.iter().map(|corners| {
            let corners = corners.map(|q| q.as_dvec3());
            let crossing = crossing(corners, at);
            if crossing != 0 && is_beyond(corners, crossing, p) { crossing } else { 0 }
        });
        counted.sum()
    }

    fn angle(surface: &[[Vec3; 3]], p: Vec3) -> f64 {
        let full = 4.0 * std::f64::consts::PI;
        surface.iter().map(|corners| triangle::solid_angle(*corners, p)).sum::<f64>() / full
    }

    #[test]
    fn winding_numbers_are_those_of_solid_angles() {
        let mut random = Random::new(5);
        let mut inside = [0, 0];
        for _ in 0..200 {
            let mut vector = || Vec3::from([(); 3].map(|()| 8.0 * random.unit() as f32 - 4.0));
            let surface = octahedron([(); 3].map(|()| [vector(), vector()]));
            for p in [(); 20].map(|()| vector()) {
                let found = winding_number(&surface, p);
                assert_eq!(f64::from(found), angle(&surface, p).round(), "at {p}");
                inside[usize::from(found < 0)] += i32::from(found != 0);
            }
        }
        assert!(inside[0] > 50 && inside[1] > 50, "{inside:?}");
    }

    /// Integer points on triangles, edges and vertices count as points moved a little along x, less along y, and still
    /// less along z.
    #[test]
    fn points_on_the_surface_belong_to_one_side() {
        let shift = Vec3::new(1.0 / 64.0, 1.0 / 4096.0, 1.0 / 262_144.0);
        let mut random = Random::new(7);
        let mut inside = 0;
        for _ in 0..100 {
            let mut vector = || Vec3::from([(); 3].map(|()| random.below(4) as f32));
            let surface = octahedron([(); 3].map(|()| [vector(), vector()]));
            for p in (0..64).map(|i| Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32)) {
                let found = winding_number(&surface, p);
                assert_eq!(f64::from(found), angle(&surface, p + shift).round(), "at {p}");
                inside += u32::from(found != 0);
            }
        }
        assert!(inside > 100, "{inside}");
    }
}
