//! Closest points of four triangles at a time, in single precision.

use crate::math::Vec3;
use wide::f32x4;

/// Four vectors.
pub(super) type Vectors = [f32x4; 3];

/// Squared sine of the largest angle of a triangle below which rounding hides on which side of an edge a point is.
const THIN: f32 = 1e-3;

/// Rounding errors of barycentric coordinates, relative to the distance from the triangle over its height.
const ROUNDING: f32 = 1e-5;

/// The least sine of the angle by which a triangle is beyond another one along a direction.
const LEAST_RISE: f32 = 1e-4;

/// Returns four copies of a vector.
#[inline]
pub(super) fn splat(v: Vec3) -> Vectors {
    [f32x4::splat(v.x), f32x4::splat(v.y), f32x4::splat(v.z)]
}

#[inline]
pub(super) fn dot(a: Vectors, b: Vectors) -> f32x4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn length(a: Vectors) -> f32x4 {
    dot(a, a).sqrt()
}

#[inline]
pub(super) fn scaled(a: Vectors, by: f32x4) -> Vectors {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline]
pub(super) fn difference(a: Vectors, b: Vectors) -> Vectors {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Returns four copies of one of four numbers.
#[inline]
pub(super) fn lane_of(x: f32x4, lane: usize) -> f32x4 {
    f32x4::splat(x.to_array()[lane % 4])
}

/// Returns four copies of one of four vectors.
#[inline]
pub(super) fn vector_of(v: Vectors, lane: usize) -> Vectors {
    [lane_of(v[0], lane), lane_of(v[1], lane), lane_of(v[2], lane)]
}

/// A triangle and those next to it.
#[derive(Clone, Copy)]
pub(super) struct Facet {
    pub(super) corners: [Vec3; 3],
    /// For each corner, that of the triangle beyond the edge opposite; the corner itself if there is none.
    pub(super) beyond: [Vec3; 3],
}

/// Up to four triangles, the first repeated if there are fewer.
#[derive(Clone, Copy)]
pub(super) struct FourTriangles {
    /// The corner of each with the largest angle.
    corner: Vectors,
    /// The edges from there.
    edges: [Vectors; 2],
    /// The unit vectors to the corners from those of the triangles beyond the edges opposite; 0 if there are none.
    from_beyond: [Vectors; 3],
}

impl FourTriangles {
    /// Returns up to four triangles; `None` if one is too thin for closest points in single precision.
    pub(super) fn new(triangles: &[Facet]) -> Option<Self> {
        let mut lanes = [[[0.0; 4]; 3]; 6];
        for lane in 0..4 {
            let Facet { corners: [a, b, c], beyond } = triangles.get(lane).or(triangles.first())?.turned();
            let edges = [b - a, c - a];
            let sizes = edges[0].length_squared() * edges[1].length_squared();
            let cosine = edges[0].dot(edges[1]);
            // Also refuses underflow.
            if !(sizes - cosine * cosine > THIN * sizes && sizes > f32::MIN_POSITIVE / f32::EPSILON) {
                return None;
            }
            let [from_a, from_b, from_c] =
                [a - beyond[0], b - beyond[1], c - beyond[2]].map(Vec3::normalize_or_zero);
            for (out, v) in lanes.iter_mut().zip([a, edges[0], edges[1], from_a, from_b, from_c]) {
                (out[0][lane], out[1][lane], out[2][lane]) = (v.x, v.y, v.z);
            }
        }
        let [corner, first, second, from_beyond @ ..] = lanes.map(|vectors| vectors.map(f32x4::new));
        Some(Self { corner, edges: [first, second], from_beyond })
    }

    /// Prepares the triangles for closest points to points near `origin`, which is the sum of two vectors, for more
    /// digits than one has.
    #[inline]
    pub(super) fn around(&self, origin: [Vectors; 2]) -> Facets {
        let [ab, ac] = self.edges;
        let (bb, bc, cc) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
        let inverse = f32x4::ONE / (bb * cc - bc * bc);
        Facets { a: difference(difference(self.corner, origin[0]), origin[1]), ab, ac, bb, bc, cc, inverse }
    }
}

impl Facet {
    #[cfg(test)]
    pub(super) fn alone(corners: [Vec3; 3]) -> Self {
        Self { corners, beyond: corners }
    }

    /// Returns the triangle with its corners in their cyclic order, that with the largest angle first.
    fn turned(&self) -> Self {
        let [a, b, c] = self.corners;
        let [at_a, at_b, at_c] = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
        let mut turned = *self;
        let turns = if at_a >= at_b && at_a >= at_c {
            0
        } else if at_b >= at_c {
            1
        } else {
            2
        };
        turned.corners.rotate_left(turns);
        turned.beyond.rotate_left(turns);
        turned
    }
}

/// Four triangles relative to an origin, prepared for closest points.
#[derive(Clone, Copy)]
pub(super) struct Facets {
    /// A corner of each.
    a: Vectors,
    /// The edges from there, and their scalar products.
    ab: Vectors,
    ac: Vectors,
    bb: f32x4,
    bc: f32x4,
    cc: f32x4,
    /// The inverse of the determinant of these products.
    inverse: f32x4,
}

impl Facets {
    /// Returns four copies of one of the triangles.
    #[inline]
    pub(super) fn copies_of(&self, lane: usize) -> Self {
        Self {
            a: vector_of(self.a, lane),
            ab: vector_of(self.ab, lane),
            ac: vector_of(self.ac, lane),
            bb: lane_of(self.bb, lane),
            bc: lane_of(self.bc, lane),
            cc: lane_of(self.cc, lane),
            inverse: lane_of(self.inverse, lane),
        }
    }

    /// Returns a bound of the distance of the corners from the origin, relative to which rounding errors are.
    #[inline]
    pub(super) fn reach(&self) -> f32x4 {
        length(self.a) + self.bb.sqrt() + self.cc.sqrt()
    }

    /// Returns the unit normals and the distances of the origin from the planes along them.
    #[inline]
    pub(super) fn planes(&self) -> (Vectors, f32x4) {
        let ([a, b, c], [d, e, f]) = (self.ab, self.ac);
        let normals = scaled([b * f - c * e, c * d - a * f, a * e - b * d], self.inverse.sqrt());
        (normals, -dot(self.a, normals))
    }

    /// Returns a mask of the triangles that are not closer to any point of a block than a triangle beyond one of their edges,
    /// as the whole block is beyond that edge, too. The block is around the origin, given by the vectors to the middles of
    /// three sides. Of triangles that would exclude each other, the one further along `direction` is kept; 0 excludes none.
    #[inline]
    pub(super) fn beyond_edges(
        &self,
        triangles: &FourTriangles,
        half_axes: &[Vectors; 3],
        direction: Vectors,
    ) -> u32 {
        let Self { a, ab, ac, bb, bc, cc, inverse } = *self;
        // The barycentric coordinates of the corners b and c are linear: their gradients, and the values at the origin.
        let at_b = scaled(difference(scaled(ab, cc), scaled(ac, bc)), inverse);
        let at_c = scaled(difference(scaled(ac, bb), scaled(ab, bc)), inverse);
        let at_a = scaled([at_b[0] + at_c[0], at_b[1] + at_c[1], at_b[2] + at_c[2]], f32x4::splat(-1.0));
        let (v, w) = (-dot(a, at_b), -dot(a, at_c));
        let values = [f32x4::ONE - v - w, v, w];
        let rounding = self.reach() * f32x4::splat(ROUNDING);
        let mut excluded = f32x4::ZERO;
        let is_acute = bc.simd_ge(f32x4::ZERO);
        for (k, gradient) in [at_a, at_b, at_c].into_iter().enumerate() {
            let change = half_axes.iter().fold(f32x4::ZERO, |sum, axis| sum + dot(*axis, gradient).abs());
            let highest = values[k] + change + rounding * length(gradient);
            let is_lower = dot(triangles.from_beyond[k], direction).simd_lt(f32x4::splat(-LEAST_RISE));
            let is_beyond = highest.simd_lt(f32x4::ZERO) & is_lower;
            // From beyond a side of an obtuse angle, the other side may be closer.
            excluded |= if k == 0 { is_beyond } else { is_beyond & is_acute };
        }
        excluded.to_bitmask()
    }

    /// Returns the vector to each of four points from the closest point of its triangle.
    #[inline]
    pub(super) fn offsets(&self, points: Vectors) -> Vectors {
        let (zero, one) = (f32x4::ZERO, f32x4::ONE);
        let before = |q: Vectors, edge: Vectors, at: f32x4| difference(q, scaled(edge, at));
        // The operands are never NaN.
        let on_edge = |at: f32x4| at.fast_max(zero).fast_min(one);
        let q = difference(points, self.a);
        let (s, t) = (dot(q, self.ab), dot(q, self.ac));
        let v = (self.cc * s - self.bc * t) * self.inverse;
        let w = (self.bb * t - self.bc * s) * self.inverse;
        let is_inside = v.simd_ge(zero) & w.simd_ge(zero) & (v + w).simd_le(one);
        let from_plane = before(before(q, self.ab, v), self.ac, w);
        let from_ab = before(q, self.ab, on_edge(s / self.bb));
        let from_ac = before(q, self.ac, on_edge(t / self.cc));
        let opposite = self.bb - self.bc - self.bc + self.cc;
        let along_bc = on_edge((t - s + self.bb - self.bc) / opposite);
        let from_bc = before(difference(q, self.ab), difference(self.ac, self.ab), along_bc);
        let [on_ab, on_ac, on_bc] = [from_ab, from_ac, from_bc].map(|from| dot(from, from));
        let is_ab = on_ab.simd_le(on_ac);
        let is_first = is_ab.select(on_ab, on_ac).simd_le(on_bc);
        let choose = |k: usize| {
            let from_edge = is_first.select(is_ab.select(from_ab[k], from_ac[k]), from_bc[k]);
            is_inside.select(from_plane[k], from_edge)
        };
        [choose(0), choose(1), choose(2)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, triangle};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn closest_points_are_those_in_double_precision() {
        let mut random = Random::new(8);
        let mut vector = |size: f32| Vec3::from([(); 3].map(|()| size * (2.0 * random.unit() as f32 - 1.0)));
        let mut thin = 0;
        for round in 0..2000 {
            let triangles = [(); 4].map(|()| [vector(1.0), vector(1.0), vector(1.0)]);
            let Some(four) = FourTriangles::new(&triangles.map(Facet::alone)[..1 + round % 4]) else {
                thin += 1;
                continue;
            };
            let (origin, rest) = (vector(100.0), vector(1e-6));
            let facets = four.around([splat(origin), splat(rest)]);
            let offset = vector(5.0);
            let found = facets.offsets(splat(offset));
            let p = origin.as_dvec3() + rest.as_dvec3() + offset.as_dvec3();
            for (lane, corners) in triangles.iter().enumerate().take(1 + round % 4) {
                let expected = triangle::from_closest(*corners, p);
                let one = facets.copies_of(lane).offsets(splat(offset)).map(|x| x.to_array()[3]);
                assert_eq!(one, found.map(|x| x.to_array()[lane]));
                let found = Vec3::from(one).as_dvec3();
                let error = (found.length() - expected.length()).abs();
                assert!(error < 5e-7 * facets.reach().to_array()[lane] as f64, "{round}: {found} {expected}");
                let (normals, heights) = facets.planes();
                let normal = Vec3::from(normals.map(|x| x.to_array()[lane])).as_dvec3();
                let height = f64::from(heights.to_array()[lane]) + normal.dot(offset.as_dvec3());
                assert!(height.abs() < expected.length() + 1e-4);
            }
        }
        assert!(thin < 200, "{thin}");
    }

    #[test]
    fn thin_and_tiny_triangles_are_refused() {
        let [x, y] = [Vec3::X, Vec3::Y];
        for corners in
            [[x, x, x], [x, y, 0.5 * (x + y)], [x, y, 0.497 * (x + y)], [1e-12 * x, 1e-12 * y, Vec3::ZERO]]
        {
            assert!(FourTriangles::new(&[[Vec3::ZERO, x, y], corners].map(Facet::alone)).is_none());
        }
        // A short edge does no harm.
        assert!(FourTriangles::new(&[Facet::alone([1e-3 * x, 100.0 * y, Vec3::ZERO])]).is_some());
        assert!(FourTriangles::new(&[]).is_none());
    }
}
