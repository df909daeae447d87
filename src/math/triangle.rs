//! Measures of a triangle, its closest point to a given one, and its intersection with a line; computed in `f64`,
//! but for the length of an edge.

use super::{DVec3, Vec3};

/// Returns the cross product of two edges: a vector along the normal, on the side from which the corners are
/// counter-clockwise, whose length is twice the triangle's area.
#[inline]
pub fn area_vector([a, b, c]: [Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

/// Returns the area of the triangle.
#[inline]
pub fn area(triangle: [Vec3; 3]) -> f64 {
    0.5 * area_vector(triangle).length()
}

/// Returns the squared length of the longest edge of the triangle, in `f32`.
#[inline]
pub fn longest_edge_squared([a, b, c]: [Vec3; 3]) -> f32 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}

/// Returns the solid angle of the triangle seen from `p`, in steradians, from −2π to 2π; positive if `p` is behind the
/// triangle, on the side from which its corners are clockwise. The solid angles of all triangles of a closed surface,
/// if they face outwards, sum to 4π for points inside and to 0 for points outside.
///
/// Van Oosterom & Strackee, *The solid angle of a plane triangle*, 1983.
pub fn solid_angle(triangle: [Vec3; 3], p: Vec3) -> f64 {
    let [a, b, c] = triangle.map(|q| q.as_dvec3() - p.as_dvec3());
    let [x, y, z] = [a.length(), b.length(), c.length()];
    let cosine = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * libm::atan2(a.dot(b.cross(c)), cosine)
}

/// Returns the point of the triangle with the given barycentric coordinates.
#[inline]
pub fn point_at([a, b, c]: [Vec3; 3], barycentric: DVec3) -> DVec3 {
    a.as_dvec3() * barycentric.x + b.as_dvec3() * barycentric.y + c.as_dvec3() * barycentric.z
}

/// Returns the barycentric coordinates (of `a`, `b`, `c`; none negative, sum 1) of the triangle's closest point to `p`.
///
/// A triangle without area is treated as the segment or point that it is.
pub fn closest_barycentric(triangle: [Vec3; 3], p: Vec3) -> DVec3 {
    closest_to_origin(triangle.map(|q| q.as_dvec3() - p.as_dvec3()))
}

/// Returns the squared distance of a point in double precision from the triangle.
pub fn distance_squared(triangle: [Vec3; 3], p: DVec3) -> f64 {
    from_closest(triangle, p).length_squared()
}

/// Returns the vector to `p` from the closest point of the triangle.
pub fn from_closest(triangle: [Vec3; 3], p: DVec3) -> DVec3 {
    let [a, b, c] = triangle.map(|q| q.as_dvec3() - p);
    let closest = closest_to_origin([a, b, c]);
    -(a * closest.x + b * closest.y + c * closest.z)
}

/// Returns the barycentric coordinates of the closest point to the origin, as [`closest_barycentric`].
#[inline]
fn closest_to_origin([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let size = normal.length_squared();
    let (v, w) = (normal.dot(ac.cross(a)) / size, normal.dot(a.cross(ab)) / size);
    let u = 1.0 - v - w;
    let on_ab = || segment(a, b, |s| DVec3::new(1.0 - s, s, 0.0));
    let on_bc = || segment(b, c, |s| DVec3::new(0.0, 1.0 - s, s));
    let on_ca = || segment(c, a, |s| DVec3::new(s, 0.0, 1.0 - s));
    let is_sliver = size <= SLIVER * ab.length_squared() * ac.length_squared();
    // Lengths beyond the range of `f64` give NaN.
    if is_sliver || size.is_nan() {
        return nearest([on_ab(), on_bc(), on_ca()]);
    }
    // Outside one edge, the closest point is on it; outside two, on one of the two.
    match [u < 0.0, v < 0.0, w < 0.0] {
        [false, false, false] => DVec3::new(u, v, w),
        [false, false, true] => on_ab().0,
        [true, false, false] => on_bc().0,
        [false, true, false] => on_ca().0,
        [true, false, true] => nearest([on_ab(), on_bc()]),
        [false, true, true] => nearest([on_ab(), on_ca()]),
        // All three cannot be negative, as they sum to one.
        [true, true, _] => nearest([on_bc(), on_ca()]),
    }
}

/// Squared sine of the angle at the first corner below which a triangle is treated as its three edges in closest-point
/// queries: rounding then hides on which side of an edge a point is.
const SLIVER: f64 = 1e-12;

/// Returns the barycentric coordinates of the nearest candidate, the first of equally near ones; each candidate is a
/// pair of barycentric coordinates and a squared distance.
fn nearest<const N: usize>(candidates: [(DVec3, f64); N]) -> DVec3 {
    let nearer = |best: (DVec3, f64), next: (DVec3, f64)| if next.1 < best.1 { next } else { best };
    candidates.into_iter().fold((DVec3::X, f64::INFINITY), nearer).0
}

/// Returns the closest point to the origin on the segment from `a` to `b`, an edge of a triangle, as barycentric
/// coordinates, and its squared distance; `barycentric` converts a position on the segment, a fraction from `a` to `b`,
/// to these coordinates.
#[inline]
fn segment(a: DVec3, b: DVec3, barycentric: impl Fn(f64) -> DVec3) -> (DVec3, f64) {
    let s = closest_segment_parameter(a, b);
    (barycentric(s), (a * (1.0 - s) + b * s).length_squared())
}

/// Returns the position of the segment's closest point to the origin, as a fraction from `a` to `b` in 0..=1.
fn closest_segment_parameter(a: DVec3, b: DVec3) -> f64 {
    let ab = b - a;
    let size = ab.length_squared();
    if size > 0.0 { (-a.dot(ab) / size).clamp(0.0, 1.0) } else { 0.0 }
}

/// Intersection of a line with a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineHit {
    /// Distance along the line, in lengths of its direction; negative behind its origin.
    pub distance: f64,
    /// Barycentric coordinates of the intersection in the triangle.
    pub barycentric: DVec3,
}

/// A line prepared for tests against many triangles: points are sheared so that the line runs along the coordinate axis
/// closest to its direction (Woop, Benthin & Wald, *Watertight ray/triangle intersection*, 2013).
#[derive(Clone, Copy, Debug)]
pub struct Line {
    origin: DVec3,
    /// Indices of the coordinate axes: the two across the line, then the one closest to its direction.
    axes: [usize; 3],
    /// Displacement of the line along each of the first two of `axes`, per unit along the third.
    shear: [f64; 2],
    /// Distance along the line, in lengths of its direction, per unit along the third of `axes`.
    scale: f64,
}

impl Line {
    /// Creates the line through `origin` along `direction`, which may have any length but 0.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let along = direction.abs().max_position();
        let axes = [(along + 1) % 3, (along + 2) % 3, along];
        let scale = 1.0 / direction[along];
        Self { origin, axes, shear: [direction[axes[0]] * scale, direction[axes[1]] * scale], scale }
    }

    /// Returns where the line meets the triangle, from either side, ahead or behind; `None` if it misses or the
    /// triangle is edge-on.
    ///
    /// Two triangles that share an edge leave no gap between them: on which side of the edge the line is, is computed
    /// alike for both, and a line exactly through the edge hits both.
    #[inline]
    pub fn hit(&self, triangle: [Vec3; 3]) -> Option<LineHit> {
        let [a, b, c] = triangle.map(|q| self.sheared(q));
        let across = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
        let (u, v, w) = (across(b, c), across(c, a), across(a, b));
        let sum = u + v + w;
        if sum == 0.0 || (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let barycentric = DVec3::new(u, v, w) / sum;
        let along = a[2] * barycentric.x + b[2] * barycentric.y + c[2] * barycentric.z;
        Some(LineHit { distance: along * self.scale, barycentric })
    }

    /// Returns the coordinates of `q` after the shear, relative to the line's origin: two across the line, then the one
    /// along it.
    #[inline]
    fn sheared(&self, q: Vec3) -> [f64; 3] {
        let p = (q.as_dvec3() - self.origin).to_array();
        let [i, j, along] = self.axes;
        [p[i] - self.shear[0] * p[along], p[j] - self.shear[1] * p[along], p[along]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const T: [Vec3; 3] = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 3.0, 0.0)];

    fn ray_hit(triangle: [Vec3; 3], origin: DVec3, direction: DVec3) -> Option<LineHit> {
        Line::new(origin, direction).hit(triangle).filter(|hit| hit.distance >= 0.0)
    }

    #[test]
    fn area_and_normal() {
        assert_eq!(area_vector(T), DVec3::new(0.0, 0.0, 12.0));
        assert_eq!(area(T), 6.0);
    }

    #[test]
    fn solid_angles() {
        let octant = [Vec3::X, Vec3::Y, Vec3::Z];
        assert!((solid_angle(octant, Vec3::ZERO) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((solid_angle(T, Vec3::new(1.0, 1.0, -1e-6)) - std::f64::consts::TAU).abs() < 1e-5);
        assert!((solid_angle(T, Vec3::new(1.0, 1.0, 1e-6)) + std::f64::consts::TAU).abs() < 1e-5);
        assert_eq!(solid_angle(T, Vec3::new(9.0, 1.0, 0.0)), 0.0);
    }

    #[test]
    fn closest_in_every_region() {
        for (p, expected) in [
            (Vec3::new(1.0, 1.0, 5.0), DVec3::new(1.0, 1.0, 0.0)),
            (Vec3::new(-1.0, -2.0, 1.0), DVec3::ZERO),
            (Vec3::new(9.0, -1.0, 0.0), DVec3::new(4.0, 0.0, 0.0)),
            (Vec3::new(-1.0, 9.0, 0.0), DVec3::new(0.0, 3.0, 0.0)),
            (Vec3::new(2.0, -3.0, 1.0), DVec3::new(2.0, 0.0, 0.0)),
            (Vec3::new(-2.0, 1.0, 1.0), DVec3::new(0.0, 1.0, 0.0)),
            (Vec3::new(5.0, 5.5, 0.0), DVec3::new(2.0, 1.5, 0.0)),
        ] {
            let found = point_at(T, closest_barycentric(T, p));
            assert!((found - expected).length() < 1e-12, "{p}: {found}");
        }
    }

    #[test]
    fn no_point_is_nearer() {
        let mut random = crate::math::Random::new(4);
        let mut vector = || Vec3::from_array(std::array::from_fn(|_| 2.0 * random.unit() as f32 - 1.0));
        for k in 0..2000 {
            // Acute and obtuse ones, needles and slivers.
            let squash = [1.0, 0.1, 1e-3, 1e-6][k % 4];
            let triangle = [vector(), vector(), vector()].map(|p| p * Vec3::new(1.0, squash, squash));
            let p = vector() * Vec3::new(2.0, 2.0 * squash, 2.0);
            let found = point_at(triangle, closest_barycentric(triangle, p)).distance(p.as_dvec3());
            for (i, j) in (0..=20).flat_map(|i| (0..=20 - i).map(move |j| (i, j))) {
                let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let other = point_at(triangle, DVec3::new(u, v, 1.0 - u - v)).distance(p.as_dvec3());
                assert!(found <= other + 1e-9, "{triangle:?} {p}: {found} {other}");
            }
        }
    }

    #[test]
    fn closest_without_area() {
        let segment = [Vec3::ZERO, Vec3::X * 2.0, Vec3::X];
        assert_eq!(point_at(segment, closest_barycentric(segment, Vec3::new(1.5, 1.0, 0.0))), DVec3::X * 1.5);
        assert_eq!(point_at([Vec3::Y; 3], closest_barycentric([Vec3::Y; 3], Vec3::ZERO)), DVec3::Y);
    }

    #[test]
    fn rays() {
        let hit = ray_hit(T, DVec3::new(1.0, 1.0, 4.0), DVec3::new(0.0, 0.0, -2.0)).unwrap();
        assert_eq!(hit.distance, 2.0);
        assert!((point_at(T, hit.barycentric) - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-15);
        assert!(ray_hit(T, DVec3::new(1.0, 1.0, -4.0), DVec3::Z).is_some(), "from behind");
        assert!(ray_hit(T, DVec3::new(1.0, 1.0, 4.0), DVec3::Z).is_none(), "away");
        assert!(ray_hit(T, DVec3::new(3.0, 3.0, 4.0), -DVec3::Z).is_none(), "beside");
        assert!(ray_hit(T, DVec3::new(-1.0, 1.0, 0.0), DVec3::X).is_none(), "edge-on");
    }

    #[test]
    fn no_gap_along_a_shared_edge() {
        let (a, b) = (Vec3::new(0.1, 0.7, 0.3), Vec3::new(1.3, -0.2, 0.9));
        let (left, right) = ([a, b, Vec3::new(0.0, -3.0, 0.0)], [b, a, Vec3::new(2.0, 3.0, 1.0)]);
        let origin = DVec3::new(0.2, 0.3, 7.0);
        for i in 0..=10_000 {
            let target = a.as_dvec3().lerp(b.as_dvec3(), f64::from(i) / 10_000.0);
            let direction = target - origin;
            let hits = [left, right].map(|t| ray_hit(t, origin, direction).is_some());
            assert!(hits[0] || hits[1], "{i}");
        }
    }
}
