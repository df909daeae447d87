//! By how much vertices may move before triangles meet, pair by pair: where no plane lies between whole stars.
//!
//! Two triangles are apart as long as their extents along some direction are (separating axes: Gottschalk, Lin, Manocha, OBBTree,
//! SIGGRAPH 1996). The gap there, halved, is what the vertices of both may move.

use super::star::{ORDINARY_STAR, ROUNDING, higher, lower, room_beside_line, unit};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, VertexId};
use smallvec::SmallVec;

type Triangle = [Vec3; 3];

/// Where the triangles at `u` and at `v` that have no corner in common are apart: by how much every vertex may move and they still
/// are. Not positive where some are not known to be. More than `enough` is not searched for. `longest` is the longest edge at `u` and
/// `v`.
pub(super) fn clear_between(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32, enough: f32) -> f32 {
    let at = |w: VertexId| mesh.position(w);
    let triangles_at = |hub: VertexId, not: VertexId| {
        mesh.ring(hub).pairs().filter(move |&(a, b)| a != not && b != not).map(move |(a, b)| [hub, a, b])
    };
    let others: SmallVec<[([VertexId; 3], Triangle, Bounds); ORDINARY_STAR]> = triangles_at(v, u)
        .map(|names| (names, names.map(at)))
        .map(|(names, points)| (names, points, Bounds::of(&points)))
        .collect();
    let rounding = ROUNDING * longest;
    let mut room = f32::INFINITY;
    let mut axis = Vec3::ZERO;
    for names in triangles_at(u, v) {
        let triangle = names.map(at);
        let bounds = Bounds::of(&triangle);
        for (other_names, other, other_bounds) in &others {
            // The hubs are in one of the two only.
            if names[1..].iter().any(|w| other_names[1..].contains(w)) {
                continue;
            }
            let wanted = 2.0 * (lower(enough, room) + rounding);
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
            room = lower(room, clear);
        }
    }
    room
}

/// Where the triangles at `v` have no more than their corners and edges in common: by how much every vertex may move and they still
/// have not. Not positive where that is not known. `longest` is the longest edge at `v`.
pub(super) fn clear_around(mesh: &Mesh, v: VertexId, longest: f32) -> f32 {
    let ring = mesh.ring(v).as_slice();
    let origin = mesh.position(v);
    let spokes: SmallVec<[Vec3; ORDINARY_STAR]> = ring.iter().map(|&w| mesh.position(w) - origin).collect();
    let count = spokes.len();
    let spoke = |k: usize| spokes[if k < count { k } else { k - count }];
    let mut room = f32::INFINITY;
    for k in 0..count {
        let mut clear = clear_of_fold(spoke(k + 1), [spoke(k), spoke(k + 2)], longest);
        // Triangle k and each that is no neighbour of it.
        for other in (k + 2..count).filter(|other| other + 1 - k < count) {
            let gap = gap_between_corners([spoke(k), spoke(k + 1)], [spoke(other), spoke(other + 1)]);
            clear = lower(0.5 * gap - ROUNDING * longest, clear);
        }
        if clear.is_nan() || clear <= 0.0 {
            return 0.0;
        }
        room = lower(room, clear);
    }
    room
}

/// Two triangles on the edge from the origin to `edge`, with these tips: by how much vertices may move before they lie on each other.
fn clear_of_fold(edge: Vec3, tips: [Vec3; 2], longest: f32) -> f32 {
    let square = edge.length_squared();
    let per_length = edge * (1.0 / square);
    let [own, other] = tips.map(|tip| unit(tip - edge * tip.dot(per_length)));
    let way = other - own;
    let normal = unit(way - edge * way.dot(per_length));
    let gap = lower(-tips[0].dot(normal), tips[1].dot(normal));
    let reach =
        tips.into_iter().fold(1.0, |reach, tip| higher(reach, (2.0 * tip.dot(per_length) - 1.0).abs()));
    room_beside_line(gap, reach, square, longest)
}

/// The largest gap between the extents of two triangles along the normal of one of them or across an edge of each, or the first that is
/// `wanted`; negative where they overlap in all of these. `axis` is tried first, and becomes the one that was found: what lies between
/// two triangles often lies between their neighbours, too.
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

/// Whether two triangles are known to be further apart than `margin`, from beside their edges. Most that are near each other lie on one
/// sheet, where exact predicates are slowest. Lengths in `reach` are the longest between corners of the two.
pub(super) fn are_beside(s: &Triangle, t: &Triangle, reach: f32, margin: f32) -> bool {
    let gap = margin + ROUNDING * reach;
    is_beside_edge(s, t, gap) || is_beside_edge(t, s, gap)
}

/// Whether `t` is beyond an edge of `s` by more than `gap`, seen along the normal of `s`.
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

/// How far the tips of two triangles with the origin as their common corner are from a plane through it that lies between them; not
/// positive where no such plane was found.
///
/// With the tips of one of them turned about the origin, the plane has all four on one side. Its normal is a mean of those of the faces
/// of the cone around them.
fn gap_between_corners([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> f32 {
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
    use super::super::star::{crossings_around, crossings_between, longest_edge};
    use super::*;
    use crate::math::Random;
    use crate::math::predicates::triangles_cross;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn any(random: &mut Random) -> Vec3 {
        Vec3::from([(); 3].map(|()| 2.0 * random.unit() as f32 - 1.0))
    }

    /// A sphere, more or less rough, perhaps pressed flat.
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

    /// The mesh with each vertex moved by at most `way`, and nearly that far.
    fn shaken(mesh: &Mesh, way: f32, random: &mut Random) -> Mesh {
        let mut mesh = mesh.clone();
        let names: Vec<VertexId> = mesh.vertices().collect();
        for v in names {
            mesh.set_position(v, mesh.position(v) + any(random).normalize_or_zero() * (0.999 * way));
        }
        mesh
    }

    /// `room` says by how much all may move; `crossings` finds what crosses, exactly.
    fn assert_holds(
        mesh: &Mesh,
        room: f32,
        random: &mut Random,
        mut crossings: impl FnMut(&Mesh, &mut Vec<VertexId>),
    ) {
        let mut crossing = Vec::new();
        crossings(mesh, &mut crossing);
        for _ in 0..3 {
            crossings(&shaken(mesh, room, random), &mut crossing);
        }
        assert!(crossing.is_empty(), "with room for {room}");
    }

    /// Two triangles of a sheet, side by side or one on the other, perhaps exactly in one plane.
    fn two_triangles(random: &mut Random) -> [Triangle; 2] {
        let flat = [0.0, 0.0, 0.02, 1.0][random.below(4) as usize];
        let apart = Vec3::X * (2.0 * random.unit() as f32);
        let mut triangle = |at: Vec3| [(); 3].map(|()| any(random) * Vec3::new(1.0, 1.0, flat) + at);
        [triangle(Vec3::ZERO), triangle(apart)]
    }

    #[test]
    fn triangles_beside_each_other_do_not_cross_before_they_have_moved_by_the_margin() {
        let mut found = [0; 2];
        for seed in 0..4000 {
            let random = &mut Random::new(seed);
            let [s, t] = two_triangles(random);
            let margin = 0.2 * random.unit() as f32;
            let beside = are_beside(&s, &t, 4.0, margin);
            found[usize::from(beside)] += 1;
            for _ in 0..if beside { 4 } else { 0 } {
                let mut moved =
                    |t: Triangle| t.map(|p| p + any(random).normalize_or_zero() * (0.499 * margin));
                assert!(!triangles_cross(moved(s), moved(t)), "seed {seed}");
            }
        }
        assert!(found.iter().all(|&count| count > 800), "{found:?}");
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
                let room = clear_around(&mesh, v, longest);
                if room > 0.0 {
                    clear[0] += 1;
                    assert_holds(&mesh, room, random, |mesh, found| crossings_around(mesh, v, None, found));
                } else {
                    unclear[0] += 1;
                }
                let w = names[random.below(names.len() as u32) as usize];
                let room = if v == w { 0.0 } else { clear_between(&mesh, [v, w], longest, 0.01) };
                if room > 0.0 && room < f32::INFINITY {
                    clear[1] += 1;
                    let between = |mesh: &Mesh, found: &mut Vec<VertexId>| {
                        crossings_between(mesh, [v, w], None, found);
                    };
                    assert_holds(&mesh, room, random, between);
                } else {
                    unclear[1] += 1;
                }
            }
        }
        assert!(clear.iter().chain(&unclear).all(|&count| count > 100), "{clear:?} clear, {unclear:?} not");
    }
}
