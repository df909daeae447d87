//! Clearances pair by pair of triangles, for one-rings that no plane separates as a whole.
//!
//! Two triangles do not intersect if their projections onto some axis are disjoint (separating axes: Gottschalk, Lin, Manocha, OBBTree,
//! SIGGRAPH 1996). Half the gap there is the clearance of the pair.

use super::one_ring::{ORDINARY_RING, ROUNDING, clearance_beside_line, higher, lower, unit};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, VertexId};
use smallvec::SmallVec;

type Triangle = [Vec3; 3];

/// The clearance between the triangles at `u` and those at `v` without a common corner; not positive where some pair is not known to be
/// disjoint. The search ends at `enough`. `longest` is the longest edge at `u` and `v`.
pub(super) fn triangle_clearance(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32, enough: f32) -> f32 {
    let at = |w: VertexId| mesh.position(w);
    let triangles_at = |hub: VertexId, not: VertexId| {
        mesh.ring(hub).pairs().filter(move |&(a, b)| a != not && b != not).map(move |(a, b)| [hub, a, b])
    };
    let others: SmallVec<[([VertexId; 3], Triangle, Bounds); ORDINARY_RING]> = triangles_at(v, u)
        .map(|names| (names, names.map(at)))
        .map(|(names, points)| (names, points, Bounds::of(&points)))
        .collect();
    let rounding = ROUNDING * longest;
    let mut clearance = f32::INFINITY;
    let mut axis = Vec3::ZERO;
    for names in triangles_at(u, v) {
        let triangle = names.map(at);
        let bounds = Bounds::of(&triangle);
        for (other_names, other, other_bounds) in &others {
            // `u` and `v` themselves are corners of one of the two only.
            if names[1..].iter().any(|w| other_names[1..].contains(w)) {
                continue;
            }
            let wanted = 2.0 * (lower(enough, clearance) + rounding);
            let boxes = gap_between_boxes(&bounds, other_bounds);
            let gap = if boxes > wanted {
                boxes
            } else {
                higher(boxes, gap_between(&triangle, other, wanted, &mut axis))
            };
            let clear = 0.5 * gap - rounding;
            if clear.is_nan() || clear <= 0.0 {
                return 0.0;
            }
            clearance = lower(clearance, clear);
        }
    }
    clearance
}

/// The clearance between the triangles at `v`, beyond their common corners and edges; not positive where some pair may intersect.
/// `longest` is the longest edge at `v`.
pub(super) fn fan_clearance(mesh: &Mesh, v: VertexId, longest: f32) -> f32 {
    let ring = mesh.ring(v).as_slice();
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

/// The clearance of two triangles on the edge from the origin to `edge`, with these tips, from being folded onto each other.
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

/// The largest gap between the projections of two triangles onto their normals and the cross products of their edges, or the first above
/// `wanted`; negative where all overlap. `axis` is tried first and becomes the one found: an axis that separates two triangles often
/// separates their neighbours.
fn gap_between(s: &Triangle, t: &Triangle, wanted: f32, axis: &mut Vec3) -> f32 {
    let origin = s[0];
    let (s, t) = (s.map(|p| p - origin), t.map(|p| p - origin));
    let edges = |[a, b, c]: Triangle| [b - a, c - b, a - c];
    let (own, others) = (edges(s), edges(t));
    let normals = [own[0].cross(own[1]), others[0].cross(others[1])];
    let across = own.into_iter().flat_map(|edge| others.map(|other| edge.cross(other)));
    let mut gap = gap_along(*axis, &s, &t);
    for direction in normals.into_iter().chain(across) {
        if gap > wanted {
            return gap;
        }
        let direction = unit(direction);
        let along = gap_along(direction, &s, &t);
        if along > gap {
            (gap, *axis) = (along, direction);
        }
    }
    gap
}

/// Whether two triangles are known to be further apart than `margin`, by axes in the plane of either and normal to one of its edges. Most
/// triangles near each other lie on one sheet, where exact predicates are slowest. `reach` is the longest distance between two of their
/// corners.
pub(super) fn are_beside(s: &Triangle, t: &Triangle, reach: f32, margin: f32) -> bool {
    let gap = margin + ROUNDING * reach;
    is_beside_edge(s, t, gap) || is_beside_edge(t, s, gap)
}

/// Whether `t` is beyond an edge of `s` by more than `gap`.
fn is_beside_edge(s: &Triangle, t: &Triangle, gap: f32) -> bool {
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

/// The largest gap along an axis; negative where the boxes meet.
fn gap_between_boxes(a: &Bounds, b: &Bounds) -> f32 {
    (b.min - a.max).max(a.min - b.max).max_element()
}

/// The distance of the tips of two triangles, whose common corner is the origin, from a separating plane through it; not positive where
/// none was found.
///
/// With the tips of one of them mirrored at the origin, all four are on one side of the plane. Its normal is the mean of those of the
/// faces of the cone around them.
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
    use crate::math::predicates::triangles_cross;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn any(random: &mut Random) -> Vec3 {
        Vec3::from([(); 3].map(|()| 2.0 * random.unit() as f32 - 1.0))
    }

    /// A sphere with some noise, sometimes flattened.
    fn rough(random: &mut Random) -> Mesh {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 1.0, 0.8).unwrap();
        let (rough, flat) = (0.6 * random.unit() as f32, [1.0, 0.1][random.below(2) as usize]);
        let names: Vec<VertexId> = mesh.vertices().collect();
        for v in names {
            let p = (mesh.position(v) + any(random) * rough) * Vec3::new(1.0, 1.0, flat);
            mesh.set_position(v, p);
        }
        mesh
    }

    /// The mesh with each vertex moved by nearly `displacement`.
    fn shaken(mesh: &Mesh, displacement: f32, random: &mut Random) -> Mesh {
        let mut mesh = mesh.clone();
        let names: Vec<VertexId> = mesh.vertices().collect();
        for v in names {
            mesh.set_position(v, mesh.position(v) + any(random).normalize_or_zero() * (0.999 * displacement));
        }
        mesh
    }

    /// Nothing intersects, by the exact test `intersections`, as long as no vertex moves further than `clearance`.
    fn assert_holds(
        mesh: &Mesh,
        clearance: f32,
        random: &mut Random,
        mut intersections: impl FnMut(&Mesh, &mut Vec<VertexId>),
    ) {
        let mut crossing = Vec::new();
        intersections(mesh, &mut crossing);
        for _ in 0..3 {
            intersections(&shaken(mesh, clearance, random), &mut crossing);
        }
        assert!(crossing.is_empty(), "with clearance for {clearance}");
    }

    /// Two triangles side by side or overlapping, sometimes exactly in one plane.
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
            let largest = margins.take_while(|&margin| are_beside(&s, &t, 4.0, margin)).last();
            found[usize::from(largest.is_some())] += 1;
            let Some(margin) = largest else { continue };
            for _ in 0..60 {
                let towards = any(random).normalize_or_zero() * (0.499 * margin);
                let [s, t] = [s.map(|p| p + towards), t.map(|p| p - towards)];
                assert!(!triangles_cross(s, t), "seed {seed}");
            }
        }
        assert!(found.iter().all(|&count| count > 400), "{found:?}");
    }

    #[test]
    fn triangles_do_not_cross_while_nothing_moves_further_than_they_are_clear() {
        let (mut clear, mut unclear) = ([0; 2], [0; 2]);
        for seed in 0..120 {
            let random = &mut Random::new(seed);
            let mesh = rough(random);
            let longest = mesh.vertices().map(|v| longest_edge(&mesh, v)).fold(0.0, higher);
            let names: Vec<VertexId> = mesh.vertices().collect();
            for &v in &names {
                let clearance = fan_clearance(&mesh, v, longest);
                if clearance > 0.0 {
                    clear[0] += 1;
                    assert_holds(&mesh, clearance, random, |mesh, found| {
                        intersections_around(mesh, v, None, found)
                    });
                } else {
                    unclear[0] += 1;
                }
                let w = names[random.below(names.len() as u32) as usize];
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
