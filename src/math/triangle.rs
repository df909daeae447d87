//! Measures of a triangle, its nearest point, and a ray's hit; worked out in `f64`.

use super::{DVec3, Vec3};

/// The cross product of two edges: along the normal of the counter-clockwise side, twice the area long.
#[inline]
pub fn area_vector([a, b, c]: [Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

/// The area.
#[inline]
pub fn area(triangle: [Vec3; 3]) -> f64 {
    0.5 * area_vector(triangle).length()
}

/// The solid angle of the triangle seen from `p`, positive from the side from which it looks clockwise, that is from
/// behind; from −2π to 2π. Those of a closed surface sum to 4π from inside and to 0 from outside.
///
/// Van Oosterom & Strackee, *The solid angle of a plane triangle*, 1983.
pub fn solid_angle(triangle: [Vec3; 3], p: Vec3) -> f64 {
    let [a, b, c] = triangle.map(|q| q.as_dvec3() - p.as_dvec3());
    let [x, y, z] = [a.length(), b.length(), c.length()];
    let cosine = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * libm::atan2(a.dot(b.cross(c)), cosine)
}

/// The point with the given barycentric coordinates.
#[inline]
pub fn at([a, b, c]: [Vec3; 3], barycentric: DVec3) -> DVec3 {
    a.as_dvec3() * barycentric.x + b.as_dvec3() * barycentric.y + c.as_dvec3() * barycentric.z
}

/// The barycentric coordinates (of `a`, `b`, `c`; none negative, sum 1) of the triangle's point nearest to `p`.
///
/// A triangle without area is taken as the segment or point that it is.
pub fn closest([a, b, c]: [Vec3; 3], p: Vec3) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|q| q.as_dvec3() - p.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let size = normal.length_squared();
    let (v, w) = (normal.dot(ac.cross(a)) / size, normal.dot(a.cross(ab)) / size);
    let u = 1.0 - v - w;
    // Not so for a quotient of zeros either.
    if u >= 0.0 && v >= 0.0 && w >= 0.0 {
        return DVec3::new(u, v, w);
    }
    closest_on_edges(a, b, c)
}

/// Nearest to the origin.
fn closest_on_edges(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let [s, t, r] = [fraction(a, b), fraction(b, c), fraction(c, a)];
    let candidates = [DVec3::new(1.0 - s, s, 0.0), DVec3::new(0.0, 1.0 - t, t), DVec3::new(r, 0.0, 1.0 - r)];
    let distance = |k: &DVec3| (a * k.x + b * k.y + c * k.z).length_squared();
    let [mut best, rest @ ..] = candidates;
    for candidate in rest {
        if distance(&candidate) < distance(&best) {
            best = candidate;
        }
    }
    best
}

/// How far from `a` to `b` the segment's point nearest to the origin is, in 0..=1.
fn fraction(a: DVec3, b: DVec3) -> f64 {
    let ab = b - a;
    let size = ab.length_squared();
    if size > 0.0 { (-a.dot(ab) / size).clamp(0.0, 1.0) } else { 0.0 }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// In lengths of the ray's direction, not negative.
    pub distance: f64,
    /// Of the triangle's corners.
    pub barycentric: DVec3,
}

/// Where the ray meets the triangle, from either side; `None` where it misses, or where the triangle is edge-on.
///
/// Two triangles that share an edge leave no gap between them: the test of the edge is the same number for both, with
/// opposite signs, and zero belongs to both.
pub fn ray_hit([a, b, c]: [Vec3; 3], origin: DVec3, direction: DVec3) -> Option<RayHit> {
    let [a, b, c] = [a, b, c].map(|q| q.as_dvec3() - origin);
    let weights = DVec3::new(direction.dot(c.cross(b)), direction.dot(a.cross(c)), direction.dot(b.cross(a)));
    let sum = weights.x + weights.y + weights.z;
    if sum == 0.0 || weights.cmplt(DVec3::ZERO).any() && weights.cmpgt(DVec3::ZERO).any() {
        return None;
    }
    let barycentric = weights / sum;
    let point = a * barycentric.x + b * barycentric.y + c * barycentric.z;
    let distance = point.dot(direction) / direction.length_squared();
    (distance >= 0.0).then_some(RayHit { distance, barycentric })
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const T: [Vec3; 3] = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, 3.0, 0.0)];

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
            let found = at(T, closest(T, p));
            assert!((found - expected).length() < 1e-12, "{p}: {found}");
        }
    }

    #[test]
    fn closest_without_area() {
        let segment = [Vec3::ZERO, Vec3::X * 2.0, Vec3::X];
        assert_eq!(at(segment, closest(segment, Vec3::new(1.5, 1.0, 0.0))), DVec3::X * 1.5);
        assert_eq!(at([Vec3::Y; 3], closest([Vec3::Y; 3], Vec3::ZERO)), DVec3::Y);
    }

    #[test]
    fn rays() {
        let hit = ray_hit(T, DVec3::new(1.0, 1.0, 4.0), DVec3::new(0.0, 0.0, -2.0)).unwrap();
        assert_eq!(hit.distance, 2.0);
        assert!((at(T, hit.barycentric) - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-15);
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
