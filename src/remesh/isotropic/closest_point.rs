//! The closest point on the input surface of remeshing, found by a walk along it.

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};

/// The largest number of steps of one walk, each to an adjacent vertex. Vertices move by less than an edge at a time;
/// this many suffice on an input a hundred times finer than the bounds. Longer walks would only cost time on malformed
/// meshes.
const STEPS: usize = 200;

/// A point inside a triangle is accepted at once if its squared distance from the query point is below this share of
/// the squared distance of the vertex around which triangles are tested: no other triangle there is much nearer, except
/// on rough surfaces.
const NEAR: f32 = 0.04;

/// The squared sine of the angle of a triangle below which only its edges are tested: rounding makes barycentric
/// coordinates meaningless there.
const SLIVER: f32 = 1e-6;

/// A closest point on the input surface, as returned by [`closest_point`].
#[derive(Clone, Copy, Debug)]
pub(super) struct ClosestPoint {
    /// The position of the closest point, on the input surface.
    pub point: Vec3,
    /// The corner of its triangle that is nearest to the point, at which the next walk can start.
    pub anchor: VertexId,
}

/// Returns the closest point to `p` on the input surface near `anchor`, by descent from there in at most 200 steps: the
/// closest one on the same sheet, whereas a search in space might find one on another.
pub(super) fn closest_point(surface: &Mesh, anchor: VertexId, p: Vec3) -> ClosestPoint {
    let mut best = ClosestPoint { point: surface.position(anchor), anchor };
    let mut least = f32::INFINITY;
    for _ in 0..STEPS {
        let Some((square, found)) = closest_in_ring(surface, best.anchor, p) else { break };
        if square >= least {
            break;
        }
        let stays = found.anchor == best.anchor;
        (least, best) = (square, found);
        if stays {
            break;
        }
    }
    best
}

/// Returns the closest point to `p` on the triangles around `centre`, anchored at its nearest corner, and the squared
/// distance; `None` without triangles.
fn closest_in_ring(surface: &Mesh, centre: VertexId, p: Vec3) -> Option<(f32, ClosestPoint)> {
    let origin = surface.position(centre);
    let target = p - origin;
    let near = NEAR * target.length_squared();
    let (mut least, mut best) = (f32::INFINITY, None);
    for (a, b) in surface.ring(centre).pairs() {
        let sides = [surface.position(a) - origin, surface.position(b) - origin];
        let (at, inside) = nearest_in(sides, target);
        let point = sides[0] * at.a + sides[1] * at.b;
        let square = point.distance_squared(target);
        if square < least {
            (least, best) = (square, Some((point, [centre, a, b][at.nearest_corner()])));
            if inside && square < near {
                break;
            }
        }
    }
    best.map(|(point, anchor)| (least, ClosestPoint { point: origin + point, anchor }))
}

/// Barycentric coordinates of the point a·A + b·B of a triangle whose corners are the origin, A and B.
#[derive(Clone, Copy, Debug)]
struct Barycentric {
    a: f32,
    b: f32,
}

impl Barycentric {
    /// Returns the number of the corner with the largest barycentric coordinate: 0 for the origin, 1 for A, 2 for B.
    fn nearest_corner(self) -> usize {
        let Self { a, b } = self;
        let rest = 1.0 - a - b;
        if rest >= a && rest >= b {
            0
        } else if a >= b {
            1
        } else {
            2
        }
    }
}

/// Returns the point closest to `p` in the triangle with corners at the origin, `a` and `b`, and whether `p` projects
/// into it.
fn nearest_in([a, b]: [Vec3; 2], p: Vec3) -> (Barycentric, bool) {
    let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
    let (pa, pb) = (p.dot(a), p.dot(b));
    let size = aa * bb - ab * ab;
    let is_sliver = size.is_nan() || size <= SLIVER * aa * bb;
    let inverse = if is_sliver { 0.0 } else { 1.0 / size };
    let inside = Barycentric { a: (bb * pa - ab * pb) * inverse, b: (aa * pb - ab * pa) * inverse };
    let [beyond_a, beyond_b] = [inside.b < 0.0 || is_sliver, inside.a < 0.0 || is_sliver];
    let beyond_other = inside.a + inside.b > 1.0 || is_sliver;
    if !(beyond_a || beyond_b || beyond_other) {
        return (inside, true);
    }
    // Beyond one edge the closest point is on it; beyond a corner, on one of two edges.
    let on_other = || {
        let s = share(aa - ab - pa + pb, aa - 2.0 * ab + bb);
        Barycentric { a: 1.0 - s, b: s }
    };
    let edges = [
        beyond_a.then(|| Barycentric { a: share(pa, aa), b: 0.0 }),
        beyond_b.then(|| Barycentric { a: 0.0, b: share(pb, bb) }),
        beyond_other.then(on_other),
    ];
    let mut best = (f32::INFINITY, inside);
    for at in edges.into_iter().flatten() {
        let square = (a * at.a + b * at.b).distance_squared(p);
        if square < best.0 {
            best = (square, at);
        }
    }
    (best.1, false)
}

/// Returns the parameter, in 0..=1, of the point of a segment closest to a point p: `along` is the dot product of the
/// segment with the offset of p from its start, `whole` the squared length of the segment.
fn share(along: f32, whole: f32) -> f32 {
    if whole > 0.0 { (along / whole).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, triangle};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn the_closest_point_agrees_with_double_precision() {
        let random = &mut Random::new(1);
        let mut any = || {
            let mut unit = || 2.0 * random.unit() as f32 - 1.0;
            Vec3::new(unit(), unit(), unit())
        };
        for k in 0..20_000 {
            let (a, p) = (any(), any() * 2.0);
            // Slivers, degenerate triangles and points, too.
            let b = [any(), a * 0.5 + any() * 1e-3, a, Vec3::ZERO, any() * 1e-4][k % 5];
            let (at, inside) = nearest_in([a, b], p);
            let found = (a * at.a + b * at.b).distance(p);
            let corners = [Vec3::ZERO, a, b];
            let weights = triangle::closest_barycentric(corners, p);
            let expected = triangle::point_at(corners, weights).distance(p.as_dvec3()) as f32;
            assert!((found - expected).abs() < 1e-4, "{corners:?} to {p}: {found} instead of {expected}");
            assert!(at.a >= 0.0 && at.b >= 0.0 && at.a + at.b <= 1.0 + 1e-6, "{at:?}");
            assert!(!inside || weights.min_element() > -1e-3);
        }
    }
}
