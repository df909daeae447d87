//! Clearances between individual pairs of triangles, for one-rings that no plane separates as a whole.
//!
//! Two triangles do not intersect if their projections onto some axis are disjoint (separating axes: Gottschalk, Lin,
//! Manocha, OBBTree, SIGGRAPH 1996). Half the gap between the projections is the clearance of the pair.

use super::one_ring::{ORDINARY_RING, ROUNDING, clearance_beside_line, unit};
use crate::math::{Bounds, Vec3, higher, lower};
use crate::mesh::{Mesh, VertexId};
use smallvec::SmallVec;
use wide::f32x4;

/// The squared length, in units of the longest edge, above which the cross product of two edges has a reliable
/// direction, so that it can serve as a separating axis.
const SHORTEST: f32 = 1e-30;

/// The largest valence of a vertex whose triangles are compared in pairs: with thousands, that takes a second.
const MOST_IN_FAN: usize = 512;

/// The largest number of pairs of triangles at two vertices that are compared.
const MOST_PAIRS: usize = MOST_IN_FAN * MOST_IN_FAN;

type Triangle = [Vec3; 3];

/// Returns the clearance between the triangles at `u` and those at `v` without a common corner: how far all vertices
/// may move before two of them can intersect; not positive if some pair is not known to be disjoint. Of clearances
/// above `enough`, any may be returned. `longest` is the longest edge at `u` and `v`.
pub(super) fn triangle_clearance(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32, enough: f32) -> f32 {
    if mesh.ring(u).valence() * mesh.ring(v).valence() > MOST_PAIRS {
        return 0.0;
    }
    // Lengths are relative to the longest edge, so that squares of products of edges neither over- nor underflow.
    let (origin, per_length) = (mesh.position(u), 1.0 / longest);
    let at = |w: VertexId| (mesh.position(w) - origin) * per_length;
    let enough = enough * per_length;
    let triangles_at = |hub: VertexId, not: VertexId| {
        mesh.ring(hub).pairs().filter(move |&(a, b)| a != not && b != not).map(move |(a, b)| [hub, a, b])
    };
    let others: SmallVec<[([VertexId; 3], Triangle, Bounds); ORDINARY_RING]> = triangles_at(v, u)
        .map(|corners| (corners, corners.map(at)))
        .map(|(corners, points)| (corners, points, Bounds::from_points(&points)))
        .collect();
    let mut clearance = f32::INFINITY;
    let mut axis = Vec3::ZERO;
    for corners in triangles_at(u, v) {
        let triangle = corners.map(at);
        let bounds = Bounds::from_points(&triangle);
        for (other_corners, other, other_bounds) in &others {
            // `u` and `v` themselves are corners of one of the two only.
            if corners[1..].iter().any(|w| other_corners[1..].contains(w)) {
                continue;
            }
            let wanted = 2.0 * (lower(enough, clearance) + ROUNDING);
            let boxes = gap_between_boxes(&bounds, other_bounds);
            let gap = if boxes > wanted {
                boxes
            } else {
                higher(boxes, gap_between(&triangle, other, wanted, &mut axis))
            };
            let clear = 0.5 * gap - ROUNDING;
            if clear.is_nan() || clear <= 0.0 {
                return 0.0;
            }
            clearance = lower(clearance, clear);
        }
    }
    clearance * longest
}

/// Returns the clearance of the triangles at `v`: how far all vertices may move before two of them can intersect,
/// except at common corners and edges; not positive if some pair may intersect already. `longest` is the longest edge
/// at `v`.
pub(super) fn fan_clearance(mesh: &Mesh, v: VertexId, longest: f32) -> f32 {
    let ring = mesh.ring(v).as_slice();
    if ring.len() > MOST_IN_FAN {
        return 0.0;
    }
    let origin = mesh.position(v);
    let spokes: SmallVec<[Vec3; ORDINARY_RING]> = ring.iter().map(|&w| mesh.position(w) - origin).collect();
    let count = spokes.len();
    let spoke = |k: usize| spokes[if k < count { k } else { k - count }];
    let mut clearance = f32::INFINITY;
    for k in 0..count {
        let mut clear = fold_clearance(spoke(k + 1), [spoke(k), spoke(k + 2)], longest);
        // Triangle k and each that shares no edge with it.
        for other in (k + 2..count).filter(|other| other + 1 - k < count) {
            let gap = gap_between_corners([spoke(k), spoke(k + 1)], [spoke(other), spoke(other + 1)]);
            clear = lower(0.5 * gap - ROUNDING * longest, clear);
        }
        if clear.is_nan() || clear <= 0.0 {
            return 0.0;
        }
        clearance = lower(clearance, clear);
    }
    clearance
}

/// Returns the clearance of two triangles that share the edge from the origin to `edge` and have the third corners
/// `tips`: the displacement of all vertices below which the two cannot fold onto each other. `longest` is the longest
/// edge of both.
fn fold_clearance(edge: Vec3, tips: [Vec3; 2], longest: f32) -> f32 {
    let square = edge.length_squared();
    let per_length = edge * (1.0 / square);
    let [own, other] = tips.map(|tip| unit(tip - edge * tip.dot(per_length)));
    let between = other - own;
    let normal = unit(between - edge * between.dot(per_length));
    let gap = lower(-tips[0].dot(normal), tips[1].dot(normal));
    let reach =
        tips.into_iter().fold(1.0, |reach, tip| higher(reach, (2.0 * tip.dot(per_length) - 1.0).abs()));
    clearance_beside_line(gap, reach, square, longest)
}

/// Returns the largest gap between the projections of two triangles onto their normals and the cross products of their
/// edges, or one above `wanted`; negative if all overlap. `axis` is tried first and replaced by the axis found: an axis
/// that separates two triangles often separates their neighbours.
fn gap_between(s: &Triangle, t: &Triangle, wanted: f32, axis: &mut Vec3) -> f32 {
    let mut gap = gap_along(*axis, s, t);
    if gap > wanted {
        return gap;
    }
    let edges = |[a, b, c]: &Triangle| [*b - *a, *c - *b, *a - *c];
    let ([e, f, g], [p, q, r]) = (edges(s), edges(t));
    // The normals first.
    for (one, other) in [([e, p, e, e], [f, q, p, q]), ([e, f, f, f], [r, p, q, r]), ([g; 4], [p, q, r, r])] {
        let directions = Vectors::of(one).cross(Vectors::of(other)).unit();
        for (lane, along) in directions.gaps(s, t).to_array().into_iter().enumerate() {
            if along > gap {
                (gap, *axis) = (along, directions.lane(lane));
            }
        }
        if gap > wanted {
            break;
        }
    }
    gap
}

/// Four vectors in SIMD lanes, the axes on which two triangles are projected at once.
#[derive(Clone, Copy)]
struct Vectors([f32x4; 3]);

impl Vectors {
    fn of(vectors: [Vec3; 4]) -> Self {
        Self([0, 1, 2].map(|axis| f32x4::from(vectors.map(|v| v[axis]))))
    }

    fn lane(self, lane: usize) -> Vec3 {
        Vec3::from(self.0.map(|axis| axis.to_array()[lane]))
    }

    fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// Returns the unit vectors along the four vectors; 0 for those too short to have a reliable direction.
    fn unit(self) -> Self {
        let [x, y, z] = self.0;
        let square = x * x + y * y + z * z;
        let scale = f32x4::splat(1.0) / square.sqrt();
        let scale = square.simd_gt(f32x4::splat(SHORTEST)).select(scale, f32x4::ZERO);
        Self([x * scale, y * scale, z * scale])
    }

    fn dot(self, p: Vec3) -> f32x4 {
        let [x, y, z] = self.0;
        x * f32x4::splat(p.x) + y * f32x4::splat(p.y) + z * f32x4::splat(p.z)
    }

    /// Returns the gap between the projections of two triangles onto each of the four vectors; negative if they
    /// overlap.
    fn gaps(self, s: &Triangle, t: &Triangle) -> f32x4 {
        let ([a, b, c], [p, q, r]) = (s.map(|corner| self.dot(corner)), t.map(|corner| self.dot(corner)));
        let (low, high) = (lower_of(lower_of(a, b), c), higher_of(higher_of(a, b), c));
        let (other_low, other_high) = (lower_of(lower_of(p, q), r), higher_of(higher_of(p, q), r));
        higher_of(other_low - high, low - other_high)
    }
}

/// Returns the lower of two numbers in each lane, as [`lower`] does.
fn lower_of(a: f32x4, b: f32x4) -> f32x4 {
    b.simd_lt(a).select(b, a)
}

/// Returns the higher of two numbers in each lane, as [`higher`] does.
fn higher_of(a: f32x4, b: f32x4) -> f32x4 {
    b.simd_gt(a).select(b, a)
}

/// Returns whether two triangles are known to be further apart than `margin`, by axes in the plane of either and normal
/// to one of its edges. A filter before the exact predicates, which are slowest for triangles on one flat sheet.
/// `reach` is the extent of both together, which bounds the rounding error.
pub(super) fn are_apart_in_plane(s: &Triangle, t: &Triangle, reach: f32, margin: f32) -> bool {
    let gap = margin + ROUNDING * reach;
    is_beyond_edge(s, t, gap) || is_beyond_edge(t, s, gap)
}

/// Returns whether the triangle `t`, projected onto the plane of `s`, is beyond an edge of `s` by more than `gap`.
fn is_beyond_edge(s: &Triangle, t: &Triangle, gap: f32) -> bool {
    let normal = (s[1] - s[0]).cross(s[2] - s[0]);
    [[0, 1, 2], [1, 2, 0], [2, 0, 1]].into_iter().any(|[from, to, tip]| {
        let outwards = unit((s[to] - s[from]).cross(normal));
        let along = |p: Vec3| (p - s[from]).dot(outwards);
        let own = higher(higher(0.0, along(s[to])), along(s[tip]));
        t.iter().all(|&p| along(p) - own > gap)
    })
}

fn gap_along(direction: Vec3, s: &Triangle, t: &Triangle) -> f32 {
    let extent = |triangle: &Triangle| {
        let [a, b, c] = triangle.map(|p| p.dot(direction));
        (lower(lower(a, b), c), higher(higher(a, b), c))
    };
    let ((low, high), (other_low, other_high)) = (extent(s), extent(t));
    higher(other_low - high, low - other_high)
}

/// Returns the largest gap between two boxes along a coordinate axis; negative if they intersect.
fn gap_between_boxes(a: &Bounds, b: &Bounds) -> f32 {
    (b.min - a.max).max(a.min - b.max).max_element()
}

/// Returns the smallest distance of the tips of two triangles, whose common corner is the origin, from a separating
/// plane through the origin; not positive if none was found. `a`, `b` and `c`, `d` are the tips, the other corners.
///
/// If the tips of one triangle are mirrored at the origin, all four are on one side of the plane. Its normal is the
/// mean of those of the faces of the cone around them.
pub(super) fn gap_between_corners([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> f32 {
    let rays = [a, b, -c, -d];
    let mut normal = Vec3::ZERO;
    for (i, j, k, l) in [(0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1)] {
        let face = unit(rays[i].cross(rays[j]));
        let (one, other) = (face.dot(rays[k]), face.dot(rays[l]));
        if one >= 0.0 && other >= 0.0 {
            normal += face;
        } else if one <= 0.0 && other <= 0.0 {
            normal -= face;
        }
    }
    let normal = unit(normal);
    rays.into_iter().fold(f32::INFINITY, |gap, ray| lower(gap, ray.dot(normal)))
}

#[cfg(test)]
mod tests {
    use super::super::one_ring::{intersections_around, intersections_between, longest_edge};
    use super::*;
    use crate::math::Random;
    use crate::math::predicates::triangles_intersect;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn any(random: &mut Random) -> Vec3 {
        Vec3::from([(); 3].map(|()| 2.0 * random.unit() as f32 - 1.0))
    }

    /// Returns a sphere with noise, sometimes flattened.
    fn rough(random: &mut Random) -> Mesh {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.8).unwrap();
        let (rough, flat) = (0.6 * random.unit() as f32, [1.0, 0.1][random.below(2) as usize]);
        let vertices: Vec<VertexId> = mesh.vertices().collect();
        for v in vertices {
            let p = (mesh.position(v) + any(random) * rough) * Vec3::new(1.0, 1.0, flat);
            mesh.set_position(v, p);
        }
        mesh
    }

    /// Returns a copy of the mesh with each vertex moved by nearly `displacement` in a random direction.
    fn shaken(mesh: &Mesh, displacement: f32, random: &mut Random) -> Mesh {
        let mut mesh = mesh.clone();
        let vertices: Vec<VertexId> = mesh.vertices().collect();
        for v in vertices {
            mesh.set_position(v, mesh.position(v) + any(random).normalize_or_zero() * (0.999 * displacement));
        }
        mesh
    }

    /// Asserts that no triangles intersect, by the exact test `intersections`, as long as no vertex moves further than
    /// `clearance`.
    fn assert_holds(
        mesh: &Mesh,
        clearance: f32,
        random: &mut Random,
        mut intersections: impl FnMut(&Mesh, &mut Vec<VertexId>),
    ) {
        let mut intersecting = Vec::new();
        intersections(mesh, &mut intersecting);
        for _ in 0..3 {
            intersections(&shaken(mesh, clearance, random), &mut intersecting);
        }
        assert!(intersecting.is_empty(), "with clearance for {clearance}");
    }

    /// Returns two triangles beside each other or overlapping, sometimes exactly in one plane.
    fn two_triangles(random: &mut Random) -> [Triangle; 2] {
        let flat = [0.0, 0.0, 0.02, 1.0][random.below(4) as usize];
        let apart = Vec3::X * (2.0 * random.unit() as f32);
        let mut triangle = |at: Vec3| [(); 3].map(|()| any(random) * Vec3::new(1.0, 1.0, flat) + at);
        [triangle(Vec3::ZERO), triangle(apart)]
    }

    #[test]
    fn triangles_beside_each_other_do_not_intersect_before_they_have_moved_by_the_margin() {
        let mut found = [0; 2];
        for seed in 0..2000 {
            let random = &mut Random::new(seed);
            let [s, t] = two_triangles(random);
            let margins = (1..=100).map(|k| 0.01 * k as f32);
            let largest = margins.take_while(|&margin| are_apart_in_plane(&s, &t, 4.0, margin)).last();
            found[usize::from(largest.is_some())] += 1;
            let Some(margin) = largest else { continue };
            for _ in 0..60 {
                let towards = any(random).normalize_or_zero() * (0.499 * margin);
                let [s, t] = [s.map(|p| p + towards), t.map(|p| p - towards)];
                assert!(!triangles_intersect(s, t), "seed {seed}");
            }
        }
        assert!(found.iter().all(|&count| count > 400), "{found:?}");
    }

    #[test]
    fn triangles_do_not_intersect_within_their_clearance() {
        let (mut clear, mut unclear) = ([0; 2], [0; 2]);
        for seed in 0..120 {
            let random = &mut Random::new(seed);
            let mesh = rough(random);
            let longest = mesh.vertices().map(|v| longest_edge(&mesh, v)).fold(0.0, higher);
            let vertices: Vec<VertexId> = mesh.vertices().collect();
            for &v in &vertices {
                let clearance = fan_clearance(&mesh, v, longest);
                if clearance > 0.0 {
                    clear[0] += 1;
                    assert_holds(&mesh, clearance, random, |mesh, found| {
                        intersections_around(mesh, v, 0..mesh.ring(v).valence(), None, found)
                    });
                } else {
                    unclear[0] += 1;
                }
                let w = vertices[random.below(vertices.len() as u32) as usize];
                let clearance = if v == w { 0.0 } else { triangle_clearance(&mesh, [v, w], longest, 0.01) };
                if clearance > 0.0 && clearance < f32::INFINITY {
                    clear[1] += 1;
                    let between = |mesh: &Mesh, found: &mut Vec<VertexId>| {
                        intersections_between(mesh, [v, w], None, found);
                    };
                    assert_holds(&mesh, clearance, random, between);
                } else {
                    unclear[1] += 1;
                }
            }
        }
        assert!(clear.iter().chain(&unclear).all(|&count| count > 100), "{clear:?} clear, {unclear:?} not");
    }
}
