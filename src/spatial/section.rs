//! Cross-sections of surfaces by planes.

use crate::math::{DVec3, Vec3};
use crate::mesh::TriangleMesh;

/// Returns the line segments in which the plane through `origin` perpendicular to `normal` intersects the surface
/// `mesh`, in the order of its triangles.
///
/// Vertices exactly on the plane count as above it. Triangles with a common edge yield bitwise equal end points on it,
/// so that the segments of a closed mesh form closed loops. Seen from the side to which `normal` points, the inside is
/// on the left of each segment. Segments of length 0, where the surface only touches the plane, are omitted. Empty if
/// `normal` is zero, or if it or `origin` is not finite. The vertex indices of `mesh` must be valid.
pub fn cross_section(mesh: &TriangleMesh, origin: Vec3, normal: Vec3) -> Vec<[Vec3; 2]> {
    let (origin, normal) = (origin.as_dvec3(), normal.as_dvec3());
    if !origin.is_finite() || !normal.is_finite() || normal == DVec3::ZERO {
        return Vec::new();
    }
    let heights: Vec<f64> = mesh.positions.iter().map(|p| normal.dot(p.as_dvec3() - origin)).collect();
    let cut = |from: u32, to: u32| edge_intersection(mesh, &heights, from, to);
    let segments = mesh.triangles.iter().filter_map(|&[a, b, c]| {
        let above = [a, b, c].map(|v| heights[v as usize] >= 0.0);
        let lone = lone_corner(above)?;
        let [tip, left, right] = [[a, b, c], [b, c, a], [c, a, b]][lone];
        let segment = [cut(tip, right), cut(tip, left)];
        Some(if above[lone] { [segment[1], segment[0]] } else { segment })
    });
    segments.filter(|[p, q]| p != q).collect()
}

/// Returns the index (0 to 2) of the triangle corner that is alone on its side of a plane, given whether each corner is
/// above the plane; `None` if all three are on the same side.
pub(crate) fn lone_corner([a, b, c]: [bool; 3]) -> Option<usize> {
    match (a == b, b == c) {
        (true, true) => None,
        (true, false) => Some(2),
        (false, true) => Some(0),
        (false, false) => Some(1),
    }
}

/// Returns the point at which a plane intersects the edge between two vertices on different sides of it, from the
/// signed `heights` of all vertices above the plane; bitwise equal for both directions of the edge.
fn edge_intersection(mesh: &TriangleMesh, heights: &[f64], from: u32, to: u32) -> Vec3 {
    let (low, high) = (from.min(to) as usize, from.max(to) as usize);
    let fraction = heights[low] / (heights[low] - heights[high]);
    mesh.positions[low].as_dvec3().lerp(mesh.positions[high].as_dvec3(), fraction).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns the octahedron |x| + |y| + |z| = 1.
    fn octahedron() -> TriangleMesh {
        let quarter = |[x, y]: [u32; 2]| [[x, y, 4], [y, x, 5]];
        TriangleMesh {
            positions: vec![Vec3::X, Vec3::Y, -Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::Z],
            triangles: [[0, 1], [1, 2], [2, 3], [3, 0]].into_iter().flat_map(quarter).collect(),
            ..Default::default()
        }
    }

    /// Returns whether segments form closed loops: every segment starts where another ends.
    fn closes(segments: &[[Vec3; 2]]) -> bool {
        let sorted = |end: usize| {
            let mut points: Vec<_> = segments.iter().map(|s| s[end].to_array().map(f32::to_bits)).collect();
            points.sort_unstable();
            points
        };
        sorted(0) == sorted(1)
    }

    /// Returns twice the area that closed loops of segments enclose, times the length of `normal`; positive if the area
    /// is on the left of the segments, seen from the side to which `normal` points.
    fn doubled_area(segments: &[[Vec3; 2]], normal: Vec3) -> f32 {
        segments.iter().map(|[p, q]| p.cross(*q).dot(normal)).sum()
    }

    #[test]
    fn a_square_with_and_without_vertices_on_the_plane() {
        for z in [0.5, -0.25, 0.0] {
            let segments = cross_section(&octahedron(), Vec3::Z * z, Vec3::Z * 3.0);
            assert_eq!(segments.len(), 4, "{z}");
            assert!(closes(&segments), "{z}");
            let side = 1.0 - f32::abs(z);
            assert!((doubled_area(&segments, Vec3::Z) - 4.0 * side * side).abs() < 1e-6, "{z}");
        }
    }

    #[test]
    fn touching_is_no_cut() {
        assert!(cross_section(&octahedron(), Vec3::Z, Vec3::Z).is_empty());
        assert!(cross_section(&octahedron(), -Vec3::Z, Vec3::Z).is_empty());
        assert!(cross_section(&octahedron(), Vec3::Z * 1.5, Vec3::Z).is_empty());
    }

    #[test]
    fn through_vertices_at_a_slant() {
        for normal in [Vec3::ONE, Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.3, -0.7, 0.2), -Vec3::ONE] {
            for offset in [Vec3::ZERO, Vec3::X, Vec3::new(0.2, 0.1, 0.05)] {
                let segments = cross_section(&octahedron(), offset, normal);
                assert!(closes(&segments), "{normal} {offset}");
                assert!(doubled_area(&segments, normal) >= 0.0, "{normal} {offset}");
            }
        }
    }

    #[test]
    fn no_plane_no_cut() {
        for (origin, normal) in [(Vec3::ZERO, Vec3::ZERO), (Vec3::NAN, Vec3::X), (Vec3::ZERO, Vec3::INFINITY)]
        {
            assert!(cross_section(&octahedron(), origin, normal).is_empty());
        }
    }
}
