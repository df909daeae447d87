//! The nearest point of the surface as it was, found by walking along it.

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};

/// Steps of one walk. A vertex goes less than an edge at a time; this many pass where the surface as it was is a hundred
/// times finer than the bounds, and longer walks would only make hostile meshes slow.
const STEPS: usize = 200;

/// A point inside a triangle that is nearer than this share (squared) of the distance to its corner is taken at once: no
/// other triangle around the corner is much nearer, unless the surface is rough there.
const NEAR: f32 = 0.04;

/// The squared sine of an angle below which a triangle is taken as its edges: which side of one a point is on is lost in
/// rounding there.
const SLIVER: f32 = 1e-6;

/// A point of the surface as it was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Where it is.
    pub point: Vec3,
    /// A corner of its triangle.
    pub home: VertexId,
}

/// The nearest point to `p` that is found by going downhill from around `home`: nearest in the same sheet, where a search
/// through space could find another sheet.
pub(super) fn foot(surface: &Mesh, home: VertexId, p: Vec3) -> Foot {
    let mut best = Foot { point: surface.position(home), home };
    let mut least = f32::INFINITY;
    for _ in 0..STEPS {
        let Some((square, found)) = foot_around(surface, best.home, p) else { break };
        if square >= least {
            break;
        }
        let stays = found.home == best.home;
        (least, best) = (square, found);
        if stays {
            break;
        }
    }
    best
}

/// The nearest point of the triangles around `centre`, with its squared distance; its home is its nearest corner.
fn foot_around(surface: &Mesh, centre: VertexId, p: Vec3) -> Option<(f32, Foot)> {
    let origin = surface.position(centre);
    let target = p - origin;
    let near = NEAR * target.length_squared();
    let (mut least, mut best) = (f32::INFINITY, None);
    for (a, b) in surface.ring(centre).pairs() {
        let sides = [surface.position(a) - origin, surface.position(b) - origin];
        let (place, inside) = nearest_in(sides, target);
        let point = sides[0] * place.a + sides[1] * place.b;
        let square = point.distance_squared(target);
        if square < least {
            (least, best) = (square, Some((point, [centre, a, b][place.heaviest()])));
            if inside && square < near {
                break;
            }
        }
    }
    best.map(|(point, home)| (least, Foot { point: origin + point, home }))
}

/// A point a·A + b·B of a triangle with corners at the origin, A and B.
#[derive(Clone, Copy, Debug)]
struct Place {
    a: f32,
    b: f32,
}

impl Place {
    /// The number of the nearest corner: 0 for the origin, 1 for A, 2 for B.
    fn heaviest(self) -> usize {
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

/// The place nearest to `p` in the triangle with corners at the origin, `a` and `b`, and whether `p` is above it.
fn nearest_in([a, b]: [Vec3; 2], p: Vec3) -> (Place, bool) {
    let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
    let (pa, pb) = (p.dot(a), p.dot(b));
    let size = aa * bb - ab * ab;
    let is_sliver = size.is_nan() || size <= SLIVER * aa * bb;
    let inverse = if is_sliver { 0.0 } else { 1.0 / size };
    let inside = Place { a: (bb * pa - ab * pb) * inverse, b: (aa * pb - ab * pa) * inverse };
    let [beyond_a, beyond_b] = [inside.b < 0.0 || is_sliver, inside.a < 0.0 || is_sliver];
    let beyond_other = inside.a + inside.b > 1.0 || is_sliver;
    if !(beyond_a || beyond_b || beyond_other) {
        return (inside, true);
    }
    // Across one edge the nearest point is on it; beyond a corner, on one of two.
    let on_other = || {
        let s = share(aa - ab - pa + pb, aa - 2.0 * ab + bb);
        Place { a: 1.0 - s, b: s }
    };
    let edges = [
        beyond_a.then(|| Place { a: share(pa, aa), b: 0.0 }),
        beyond_b.then(|| Place { a: 0.0, b: share(pb, bb) }),
        beyond_other.then(on_other),
    ];
    let mut best = (f32::INFINITY, inside);
    for place in edges.into_iter().flatten() {
        let square = (a * place.a + b * place.b).distance_squared(p);
        if square < best.0 {
            best = (square, place);
        }
    }
    (best.1, false)
}

/// How far along a segment a point is, in 0..=1; by their products.
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
    fn a_place_is_as_near_as_that_found_with_twice_the_digits() {
        let random = &mut Random::new(1);
        let mut any = || {
            let mut unit = || 2.0 * random.unit() as f32 - 1.0;
            Vec3::new(unit(), unit(), unit())
        };
        for k in 0..20_000 {
            let (a, p) = (any(), any() * 2.0);
            // Thin ones, flat ones and points, too.
            let b = [any(), a * 0.5 + any() * 1e-3, a, Vec3::ZERO, any() * 1e-4][k % 5];
            let (place, inside) = nearest_in([a, b], p);
            let found = (a * place.a + b * place.b).distance(p);
            let corners = [Vec3::ZERO, a, b];
            let weights = triangle::closest(corners, p);
            let expected = triangle::at(corners, weights).distance(p.as_dvec3()) as f32;
            assert!((found - expected).abs() < 1e-4, "{corners:?} to {p}: {found} instead of {expected}");
            assert!(place.a >= 0.0 && place.b >= 0.0 && place.a + place.b <= 1.0 + 1e-6, "{place:?}");
            assert!(!inside || weights.min_element() > -1e-3);
        }
    }
}
