//! Exact predicates on points, segments and triangles: the sign of a determinant is never affected by rounding.
//!
//! Determinants are adaptive (Shewchuk's, by the `robust` crate): a plain `f64` evaluation with an error bound decides
//! nearly all calls, and exact arithmetic only those within the bound. Coordinates are `f32`, except in [`orient2d`]
//! and [`orient3d_f64`]: products of three `f32` can neither overflow nor underflow in `f64`, so the results hold for
//! all finite coordinates.
//!
//! Triangles, segments and boxes are closed sets: if they touch, they intersect.

use super::{Bounds, DVec2, DVec3, Vec3};
use robust::{Coord, Coord3D};

/// Returns six times the signed volume of the tetrahedron `a b c d`, with an exact sign: positive if `d` is on the side
/// from which `a`, `b`, `c` appear clockwise, that is behind the triangle; zero exactly if the four points are
/// coplanar.
///
/// The inside of a closed surface with outward triangles `a b c` is on the positive side.
#[inline]
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> f64 {
    robust::orient3d(coordinates(a), coordinates(b), coordinates(c), coordinates(d))
}

/// Returns the same as [`orient3d`] for points in double precision. The sign is exact unless products of coordinates
/// overflow or underflow.
#[inline]
pub fn orient3d_f64(points: [DVec3; 4]) -> f64 {
    let [a, b, c, d] = points.map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    robust::orient3d(a, b, c, d)
}

#[inline]
fn coordinates(p: Vec3) -> Coord3D<f32> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Returns twice the signed area of the triangle `a b c` in the plane: positive if its corners are counter-clockwise,
/// zero if they are collinear. The sign is exact unless products of coordinates overflow or underflow.
pub fn orient2d([a, b, c]: [DVec2; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
    robust::orient2d(a, b, c)
}

/// Returns a positive number if `d` is inside the circle through `a`, `b` and `c`, which are counter-clockwise, a
/// negative one if it is outside, zero on the circle. The sign is exact as that of [`orient2d`].
pub fn in_circle([a, b, c]: [DVec2; 3], d: DVec2) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord { x: p.x, y: p.y });
    robust::incircle(a, b, c, d)
}

/// Returns whether the three points are exactly collinear, so that the triangle has no area.
pub fn collinear([a, b, c]: [Vec3; 3]) -> bool {
    Axis::ALL.into_iter().all(|axis| axis.orient(a, b, c) == 0.0)
}

/// Returns whether two triangles share at least one point. Meant for triangles without a common corner: with one, the
/// result is `true`.
pub fn triangles_intersect(a: [Vec3; 3], b: [Vec3; 3]) -> bool {
    if !Bounds::from_points(&a).overlaps(&Bounds::from_points(&b)) {
        return false;
    }
    let sides_of_b = sides(a, b);
    if one_side(&sides_of_b) {
        return false;
    }
    let sides_of_a = sides(b, a);
    if one_side(&sides_of_a) {
        return false;
    }
    any_edge_intersects(a, sides_of_a, b) || any_edge_intersects(b, sides_of_b, a)
}

/// Returns whether the triangles `shared a[0] a[1]` and `shared b[0] b[1]` share a point other than the common corner.
pub fn triangles_intersect_sharing_vertex(shared: Vec3, a: [Vec3; 2], b: [Vec3; 2]) -> bool {
    let (triangle_a, triangle_b) = ([shared, a[0], a[1]], [shared, b[0], b[1]]);
    let sides_of_b = b.map(|p| orient3d(shared, a[0], a[1], p));
    if one_side(&sides_of_b) {
        return false;
    }
    let sides_of_a = a.map(|p| orient3d(shared, b[0], b[1], p));
    if one_side(&sides_of_a) {
        return false;
    }
    if sides_of_b == [0.0; 2] && collinear(triangle_a) {
        return a.into_iter().any(|p| edge_at_corner_intersects(shared, p, b));
    }
    if sides_of_a == [0.0; 2] && collinear(triangle_b) {
        return b.into_iter().any(|p| edge_at_corner_intersects(shared, p, a));
    }
    // Both triangles are star-shaped about the shared corner: if they share another point, the opposite edge of one
    // meets the other triangle.
    segment_intersects_triangle(a, sides_of_a, triangle_b)
        || segment_intersects_triangle(b, sides_of_b, triangle_a)
}

/// Returns whether the triangles `u v a` and `v u b` overlap beyond their common edge: they are coplanar and on the
/// same side of this edge. A triangle without area is on neither side, so it overlaps with none.
pub fn triangles_overlap_sharing_edge(u: Vec3, v: Vec3, a: Vec3, b: Vec3) -> bool {
    orient3d(u, v, a, b) == 0.0
        && Axis::ALL.into_iter().any(|axis| {
            let (side_a, side_b) = (axis.orient(u, v, a), axis.orient(u, v, b));
            (side_a > 0.0 && side_b > 0.0) || (side_a < 0.0 && side_b < 0.0)
        })
}

/// Returns whether two segments share at least one point.
pub fn segments_intersect([p, q]: [Vec3; 2], [r, s]: [Vec3; 2]) -> bool {
    if !Bounds::from_points(&[p, q]).overlaps(&Bounds::from_points(&[r, s])) || orient3d(p, q, r, s) != 0.0 {
        return false;
    }
    // Along an axis in whose projection some three of the coplanar points are not collinear, the plane is projected one
    // to one.
    for axis in Axis::ALL {
        let about_pq = [axis.orient(p, q, r), axis.orient(p, q, s)];
        let about_rs = [axis.orient(r, s, p), axis.orient(r, s, q)];
        if about_pq != [0.0; 2] || about_rs != [0.0; 2] {
            return !one_side(&about_pq) && !one_side(&about_rs);
        }
    }
    // All points are collinear: the segments overlap because their boxes do.
    true
}

/// Returns whether the segment from `shared` to `tip` shares a point with the triangle `shared b[0] b[1]` other than
/// `shared`.
fn edge_at_corner_intersects(shared: Vec3, tip: Vec3, b: [Vec3; 2]) -> bool {
    if tip == shared {
        return false;
    }
    let triangle = [shared, b[0], b[1]];
    if !collinear(triangle) {
        return point_in_triangle(tip, triangle) || segments_intersect([shared, tip], b);
    }
    b.into_iter()
        .filter(|&q| q != shared)
        .any(|q| segments_intersect([tip, tip], [shared, q]) || segments_intersect([q, q], [shared, tip]))
}

/// Returns the side of the triangle's plane on which each point is, by the sign of [`orient3d`]: positive behind the
/// triangle, 0 in its plane.
fn sides(triangle: [Vec3; 3], points: [Vec3; 3]) -> [f64; 3] {
    points.map(|p| orient3d(triangle[0], triangle[1], triangle[2], p))
}

/// Returns whether all values are positive, or all negative: the points are strictly on one side of a plane or line.
fn one_side(sides: &[f64]) -> bool {
    sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0)
}

/// Returns whether an edge of the triangle with corners `edges` meets `triangle`; `sides` holds [`orient3d`] of
/// `triangle` with each of these corners.
fn any_edge_intersects(edges: [Vec3; 3], sides: [f64; 3], triangle: [Vec3; 3]) -> bool {
    [(0, 1), (1, 2), (2, 0)]
        .into_iter()
        .any(|(i, j)| segment_intersects_triangle([edges[i], edges[j]], [sides[i], sides[j]], triangle))
}

/// Returns whether a segment meets a triangle; `sides` holds [`orient3d`] of the triangle with each end of the segment.
fn segment_intersects_triangle(segment: [Vec3; 2], sides: [f64; 2], triangle: [Vec3; 3]) -> bool {
    if one_side(&sides) {
        return false;
    }
    if sides == [0.0; 2] {
        return coplanar_segment_intersects_triangle(segment, triangle);
    }
    let [p, q] = segment;
    let [a, b, c] = triangle;
    let orientations = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
    !(orientations.iter().any(|&orientation| orientation > 0.0)
        && orientations.iter().any(|&orientation| orientation < 0.0))
}

/// Returns whether a segment in the triangle's plane meets the triangle. Also correct for a triangle without area,
/// which is the union of its edges.
fn coplanar_segment_intersects_triangle(segment: [Vec3; 2], triangle: [Vec3; 3]) -> bool {
    let [a, b, c] = triangle;
    point_in_triangle(segment[0], triangle)
        || [[a, b], [b, c], [c, a]].into_iter().any(|edge| segments_intersect(segment, edge))
}

/// Returns whether `p` is in the triangle; `false` if it is not in its plane or the triangle has no area.
fn point_in_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> bool {
    if orient3d(a, b, c, p) != 0.0 {
        return false;
    }
    let Some(axis) = Axis::ALL.into_iter().find(|axis| axis.orient(a, b, c) != 0.0) else { return false };
    let orientations = [axis.orient(a, b, p), axis.orient(b, c, p), axis.orient(c, a, p)];
    !(orientations.iter().any(|&orientation| orientation > 0.0)
        && orientations.iter().any(|&orientation| orientation < 0.0))
}

/// A coordinate axis along which points are projected, to reduce tests of coplanar points to two dimensions.
#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    const ALL: [Self; 3] = [Self::Z, Self::X, Self::Y];

    /// Returns twice the signed area of the triangle projected along the axis, with an exact sign: positive if it is
    /// counter-clockwise seen from the positive end of the axis.
    fn orient(self, a: Vec3, b: Vec3, c: Vec3) -> f64 {
        let project = |p: Vec3| match self {
            Self::X => Coord { x: p.y, y: p.z },
            Self::Y => Coord { x: p.z, y: p.x },
            Self::Z => Coord { x: p.x, y: p.y },
        };
        robust::orient2d(project(a), project(b), project(c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn v(x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z)
    }

    const A: [Vec3; 3] = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 4.0, 0.0)];

    /// Returns a seeded generator of integers in `-range..=range`.
    fn integers(seed: u64, range: i64) -> impl FnMut() -> i64 {
        let mut random = Random::new(seed);
        move || i64::from(random.below(2 * range as u32 + 1)) - range
    }

    fn integer_determinant(p: [[i64; 3]; 4]) -> i128 {
        let [a, b, c] = [0, 1, 2].map(|i| [0, 1, 2].map(|k| i128::from(p[i][k] - p[3][k])));
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    }

    #[test]
    fn orientation_is_positive_behind_and_exact() {
        assert!(orient3d(A[0], A[1], A[2], v(1.0, 1.0, -1.0)) > 0.0);
        for range in [2, 1 << 22] {
            let mut next = integers(7, range);
            for _ in 0..20_000 {
                let mut p = [(); 4].map(|()| [(); 3].map(|()| next()));
                if range > 2 {
                    // The fourth is near the centroid of the other three: a determinant of few ulps, often zero.
                    p[3] = [0, 1, 2].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3);
                }
                let [a, b, c, d] = p.map(|q| v(q[0] as f32, q[1] as f32, q[2] as f32));
                let exact = integer_determinant(p).signum();
                let sign = orient3d(a, b, c, d);
                assert_eq!(i128::from(sign > 0.0) - i128::from(sign < 0.0), exact, "{p:?}");
            }
        }
    }

    #[test]
    fn triangles_that_pierce_touch_or_miss() {
        let pierces = [v(1.0, 1.0, -1.0), v(1.0, 1.0, 1.0), v(9.0, 9.0, 1.0)];
        let touches_inside = [v(1.0, 1.0, 0.0), v(1.0, 1.0, 1.0), v(2.0, 1.0, 1.0)];
        let touches_edge = [v(2.0, 2.0, 0.0), v(3.0, 3.0, 1.0), v(3.0, 3.0, -1.0)];
        let just_above = [v(1.0, 1.0, f32::from_bits(1)), v(1.0, 1.0, 1.0), v(2.0, 1.0, 1.0)];
        let beside = [v(2.5, 2.5, -1.0), v(2.5, 2.5, 1.0), v(9.0, 9.0, 0.0)];
        for (other, expected) in [
            (pierces, true),
            (touches_inside, true),
            (touches_edge, true),
            (just_above, false),
            (beside, false),
        ] {
            assert_eq!(triangles_intersect(A, other), expected, "{other:?}");
            assert_eq!(triangles_intersect(other, A), expected, "{other:?}");
        }
    }

    #[test]
    fn coplanar_triangles() {
        let inside = [v(1.0, 1.0, 0.0), v(1.5, 1.0, 0.0), v(1.0, 1.5, 0.0)];
        let star = [v(3.0, 3.0, 0.0), v(-1.0, 1.0, 0.0), v(1.0, -1.0, 0.0)];
        let away = [v(2.5, 2.5, 0.0), v(3.0, 1.5, 0.0), v(3.0, 3.0, 0.0)];
        let corner = [v(4.0, 0.0, 0.0), v(5.0, 0.0, 0.0), v(5.0, 1.0, 0.0)];
        for (other, expected) in [(inside, true), (star, true), (away, false), (corner, true)] {
            assert_eq!(triangles_intersect(A, other), expected, "{other:?}");
            assert_eq!(triangles_intersect(other, A), expected, "{other:?}");
        }
    }

    #[test]
    fn triangles_without_area_are_segments_and_points() {
        let needle = |z: f32| [v(1.0, 1.0, z), v(1.0, 1.0, 1.0), v(1.0, 1.0, 2.0)];
        assert!(triangles_intersect(A, needle(-1.0)));
        assert!(triangles_intersect(A, needle(0.0)));
        assert!(!triangles_intersect(A, needle(0.5)));
        let skew = [v(0.0, 1.0, 1.5), v(1.0, 1.0, 1.5), v(2.0, 1.0, 1.5)];
        assert!(triangles_intersect(needle(-1.0), skew));
        assert!(!triangles_intersect(needle(-1.0), skew.map(|p| p + v(0.0, 0.25, 0.0))));
        assert!(triangles_intersect([A[0]; 3], [A[0]; 3]));
        assert!(!triangles_intersect([A[0]; 3], [A[1]; 3]));
    }

    #[test]
    fn sharing_a_corner() {
        let cross = |b: [Vec3; 2]| {
            let forward = triangles_intersect_sharing_vertex(A[0], [A[1], A[2]], b);
            assert_eq!(triangles_intersect_sharing_vertex(A[0], b, [A[2], A[1]]), forward, "{b:?}");
            forward
        };
        assert!(!cross([v(-1.0, 0.0, 0.0), v(0.0, -1.0, 0.0)]), "coplanar, apart");
        assert!(cross([v(1.0, 1.0, 0.0), v(0.0, -1.0, 0.0)]), "coplanar, overlapping");
        assert!(cross([v(4.0, 0.0, 0.0), v(0.0, -1.0, 0.0)]), "along an edge");
        assert!(!cross([v(-1.0, -1.0, 1.0), v(-1.0, -1.0, -1.0)]), "through the plane, behind the corner");
        assert!(cross([v(1.0, 1.0, 1.0), v(1.0, 1.0, -1.0)]), "through");
        assert!(cross([v(9.0, 9.0, 1.0), v(9.0, 9.0, -1.0)]), "through, rim beyond the other's");
        assert!(!cross([v(1.0, 1.0, 1.0), v(1.0, 1.0, 2.0)]), "above");
        assert!(cross([v(1.0, 1.0, 0.0), v(1.0, 1.0, 2.0)]), "standing in it");
        assert!(cross([v(1.0, 1.0, 0.0), v(2.0, 2.0, 0.0)]), "a segment in it");
        assert!(!cross([v(-1.0, -1.0, 0.0), v(-2.0, -2.0, 0.0)]), "a segment leaving it");
        assert!(cross([v(-1.0, -1.0, 0.0), v(2.0, 2.0, 0.0)]), "a segment through the corner");
        assert!(!cross([A[0], A[0]]), "a point");
    }

    #[test]
    fn sharing_an_edge() {
        let fold = |b| triangles_overlap_sharing_edge(A[0], A[1], A[2], b);
        assert!(fold(v(1.0, 1.0, 0.0)));
        assert!(fold(A[2]));
        assert!(!fold(v(1.0, -1.0, 0.0)));
        assert!(!fold(v(1.0, 1.0, 1.0e-30)));
        assert!(!fold(v(2.0, 0.0, 0.0)));
    }

    type Point = [i64; 3];

    fn subtract(a: Point, b: Point) -> Point {
        [0, 1, 2].map(|k| a[k] - b[k])
    }

    fn cross_product(a: Point, b: Point) -> Point {
        [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    }

    fn edges(t: [Point; 3]) -> [Point; 3] {
        [0, 1, 2].map(|k| subtract(t[(k + 1) % 3], t[k]))
    }

    fn normal(t: [Point; 3]) -> Point {
        let [u, v, _] = edges(t);
        cross_product(u, v)
    }

    /// Returns whether two triangles with an area are disjoint, by separating axes over integers: an independent test.
    fn separated(a: [Point; 3], b: [Point; 3]) -> bool {
        let mut axes = vec![normal(a), normal(b)];
        for u in edges(a) {
            axes.extend(edges(b).map(|v| cross_product(u, v)));
        }
        axes.extend(edges(a).map(|u| cross_product(u, normal(a))));
        axes.extend(edges(b).map(|u| cross_product(u, normal(b))));
        axes.into_iter().any(|axis| {
            let dot = |p: Point| axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];
            let (a, b) = (a.map(dot), b.map(dot));
            a.iter().max() < b.iter().min() || b.iter().max() < a.iter().min()
        })
    }

    fn to_vec(p: Point) -> Vec3 {
        v(p[0] as f32, p[1] as f32, p[2] as f32)
    }

    #[test]
    fn triangles_agree_with_separating_axes() {
        for range in [1, 2, 5, 100] {
            let (mut next, mut intersecting) = (integers(5, range), 0);
            for _ in 0..10_000 {
                let [a, b] = [(); 2].map(|()| [(); 3].map(|()| [(); 3].map(|()| next())));
                if normal(a) == [0; 3] || normal(b) == [0; 3] {
                    continue;
                }
                let expected = !separated(a, b);
                assert_eq!(triangles_intersect(a.map(to_vec), b.map(to_vec)), expected, "{a:?} {b:?}");
                intersecting += usize::from(expected);
            }
            assert!(intersecting > 500, "{intersecting} intersect");
        }
    }

    #[test]
    fn triangles_at_a_corner_agree_with_separating_axes() {
        // With the corner cut off one triangle (a hundredth, less than the distance of the other's opposite edge) no
        // common point is left.
        const CUT: i64 = 100;
        let (mut next, mut intersecting) = (integers(6, 3), 0);
        for _ in 0..20_000 {
            let [a0, a1, b0, b1] = [(); 4].map(|()| [(); 3].map(|()| CUT * next()));
            let (a, b) = ([[0; 3], a0, a1], [[0; 3], b0, b1]);
            if normal(a) == [0; 3] || normal(b) == [0; 3] {
                continue;
            }
            let [c0, c1] = [a0, a1].map(|p| p.map(|x| x / CUT));
            let expected = !separated([a0, a1, c1], b) || !separated([a0, c1, c0], b);
            let found =
                triangles_intersect_sharing_vertex(Vec3::ZERO, [a0, a1].map(to_vec), [b0, b1].map(to_vec));
            assert_eq!(found, expected, "{a:?} {b:?}");
            intersecting += usize::from(expected);
        }
        assert!(intersecting > 500, "{intersecting} intersect");
    }

    #[test]
    fn segments_in_space() {
        let base = [v(0.0, 0.0, 0.0), v(2.0, 2.0, 2.0)];
        assert!(segments_intersect(base, [v(0.0, 2.0, 1.0), v(2.0, 0.0, 1.0)]));
        assert!(!segments_intersect(base, [v(0.0, 2.0, 1.5), v(2.0, 0.0, 1.0)]));
        assert!(segments_intersect(base, [v(1.0, 1.0, 1.0), v(9.0, 9.0, 9.0)]));
        assert!(!segments_intersect(base, [v(3.0, 3.0, 3.0), v(9.0, 9.0, 9.0)]));
        assert!(segments_intersect(base, [base[1], v(2.0, 0.0, 2.0)]));
    }
}
