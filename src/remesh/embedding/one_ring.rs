//! Collision tests of the triangles in one one-ring, or between two.
//!
//! Exact predicates decide intersections. Conservative filters run first; each returns a clearance: a displacement of
//! all vertices below which no pair of triangles can intersect, not positive if the filter does not apply. Filters
//! allow for rounding by a wide margin.

use super::MIN_LENGTH;
use super::clearance::gap_between_corners;
use super::output::{OutputSpace, bounds, exact_below, intersect};
use crate::math::{Bounds, DVec3, Vec3, higher, lower};
use crate::mesh::{Facet, Mesh, VertexId};
use smallvec::SmallVec;
use std::ops::Range;

/// The valence up to which one-rings are stored inline, without heap allocation.
pub(super) const ORDINARY_RING: usize = 16;

/// Bound on the rounding error of lengths, relative to the longest edge, and of areas, relative to its square: a
/// hundred times the actual error.
pub(super) const ROUNDING: f32 = 1e-4;

/// The largest clearance that [`facing_clearance`] returns, relative to the longest edge: its bound holds for smaller
/// displacements only.
const SMALL: f32 = 0.125;

/// The share of its distance from a plane that a point keeps when displacements of two vertices in the plane turn it;
/// their distance from each other is at least six times these displacements. The cosine of the angle, √(1 − (1/3)²),
/// rounded down.
const LEFT_BY_TURN: f32 = 0.94;
/// The largest displacement of two vertices, relative to their distance, for which [`LEFT_BY_TURN`] holds.
const TURN: f32 = 1.0 / 6.0;

/// Returns the length of the longest edge at `v`; not less than [`MIN_LENGTH`].
pub(super) fn longest_edge(mesh: &Mesh, v: VertexId) -> f32 {
    let p = mesh.position(v);
    let square = mesh.ring(v).as_slice().iter().fold(0.0f32, |longest, &w| {
        let square = p.distance_squared(mesh.position(w));
        if square > longest { square } else { longest }
    });
    higher(MIN_LENGTH, square.sqrt())
}

/// Returns the unit vector in the direction of `offset`, or 0 for the null vector; computed in double precision if the
/// squared length over- or underflows.
pub(super) fn unit(offset: Vec3) -> Vec3 {
    let square = offset.length_squared();
    if (1e-30..1e30).contains(&square) {
        offset * (1.0 / square.sqrt())
    } else {
        offset.as_dvec3().try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
    }
}

/// Returns the clearance of a one-ring, how far all vertices may move before its triangles can intersect, if these all
/// face in a direction and wind about it once: projected along this direction they do not overlap. `longest` is the
/// longest edge at `v`.
///
/// If vertices move by f, twice the projected area of a triangle with perimeter P changes by less than f·P + 3·f².
fn facing_clearance(mesh: &Mesh, v: VertexId, direction: Vec3, longest: f32) -> f32 {
    let ring = mesh.ring(v).as_slice();
    let [Some(&first), Some(&last)] = [ring.first(), ring.last()] else { return 0.0 };
    let centre = mesh.position(v);
    let across = direction.cross(mesh.position(first) - centre);
    let mut previous = mesh.position(last) - centre;
    let mut previous_length = previous.length();
    let mut clearance = SMALL * longest;
    let (rounding, spare) = (ROUNDING * longest * longest, 3.0 * SMALL * longest);
    // Spokes that turn in one direction by less than half a turn each complete a turn whenever they leave the half
    // plane behind the first.
    let (mut turns, mut before) = (0, false);
    for (k, &w) in ring.iter().enumerate() {
        let offset = mesh.position(w) - centre;
        let length = offset.length();
        let area = previous.cross(offset).dot(direction) - rounding;
        clearance = lower(clearance, area / (previous_length + length + offset.distance(previous) + spare));
        let behind = k > 0 && across.dot(offset) < 0.0;
        turns += u32::from(before && !behind);
        before = behind;
        (previous, previous_length) = (offset, length);
    }
    // Fewer than five spokes cannot make a second turn.
    let once = ring.len() < 5 || turns + u32::from(before) == 1;
    // If squares overflow, nothing is known.
    if once && longest < f32::INFINITY { clearance } else { 0.0 }
}

/// Returns the clearance of a one-ring, how far all vertices may move before its triangles can intersect, if it is a
/// height field along its normal. `longest` is the longest edge at `v`.
pub(super) fn flat_clearance(mesh: &Mesh, v: VertexId, longest: f32) -> f32 {
    facing_clearance(mesh, v, unit(mesh.area_normal(v)), longest)
}

/// Returns the clearance between the one-rings of two adjacent vertices, how far all vertices may move before these can
/// intersect, if both face in one direction and neither reaches into the corners behind the two vertices `left` and
/// `right` opposite their edge. `longest` is the longest edge at `u` and `v`.
///
/// ```text
///        . behind .       In projection along the direction, a common point of triangles S at u and T at v is not
///         .      .        in the triangle u v p. Seen from u it is past p, and seen from v, too, so it is behind p.
///          .    .         No triangle at u reaches that region if none crosses the line through v and p, and no
///            p            triangle at v does if none crosses the line through u and p. The same holds for q on the
///          /   \          other side of u v.
///         u-----v
/// ```
pub(super) fn spread_clearance(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    [left, right]: [VertexId; 2],
    longest: f32,
) -> f32 {
    let at = |w: VertexId| mesh.position(w);
    let normal = unit((at(v) - at(u)).cross(at(left) - at(right)));
    let area = lower(facing_clearance(mesh, u, normal, longest), facing_clearance(mesh, v, normal, longest));
    if area <= 0.0 {
        return 0.0;
    }
    // Twice the smallest signed area of the triangles between a line and the vertices of a one-ring that must be on its
    // side.
    let before_line = |hub: VertexId, [from, to]: [VertexId; 2]| {
        let across = normal.cross(at(to) - at(from));
        let others = mesh.ring(hub).as_slice().iter().filter(|&&w| w != from && w != to);
        let areas = others.map(|&w| (at(w) - at(from)).dot(across));
        areas.fold((at(hub) - at(from)).dot(across), lower)
    };
    let at_left = higher(before_line(u, [v, left]), before_line(v, [left, u]));
    let at_right = higher(before_line(u, [right, v]), before_line(v, [u, right]));
    let rounding = ROUNDING * longest * longest;
    lower(area, (lower(at_left, at_right) - rounding) / (6.5 * longest))
}

/// Returns the clearance between the triangles at `u` and those at `v` without a common corner, how far all vertices
/// may move before these can intersect, by a separating plane through two common neighbours `p` and `q`. `longest` is
/// the longest edge at `u` and `v`.
///
/// The plane moves with `p` and `q`, and turns about the direction in it that is perpendicular to the line through
/// them. If all vertices move by f, a corner at distance g from the plane, beside the point p + t·(q − p) of that line,
/// keeps at least a distance of [`LEFT_BY_TURN`]·g − f·(1 + |t| + |1 − t|).
pub(super) fn plane_clearance(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    [p, q]: [VertexId; 2],
    longest: f32,
) -> f32 {
    let origin = mesh.position(p);
    let divider = mesh.position(q) - origin;
    let square = divider.length_squared();
    let per_length = divider * (1.0 / square);
    let offset = mesh.position(v) - mesh.position(u);
    // If `p` and `q` or `u` and `v` coincide, there is no plane and no clearance: distances are NaN or 0.
    let normal = unit(offset - divider * offset.dot(per_length));
    let (mut gap, mut reach) = (f32::INFINITY, 1.0);
    let mut meet = |w: VertexId, side: f32| {
        let from_origin = mesh.position(w) - origin;
        gap = lower(gap, side * from_origin.dot(normal));
        // |t| + |1 − t|
        reach = higher(reach, (2.0 * from_origin.dot(per_length) - 1.0).abs());
    };
    let is_beside = |w: VertexId| w != p && w != q;
    meet(u, -1.0);
    meet(v, 1.0);
    mesh.ring(u).as_slice().iter().filter(|&&w| is_beside(w) && w != v).for_each(|&w| meet(w, -1.0));
    mesh.ring(v).as_slice().iter().filter(|&&w| is_beside(w) && w != u).for_each(|&w| meet(w, 1.0));
    clearance_beside_line(gap, reach, square, longest)
}

/// Returns the clearance of vertices from a plane through two of them: `gap` is their smallest distance from it, beside
/// points of the line through the two with |t| + |1 − t| up to `reach`, `square` the squared distance of the two, and
/// `longest` the longest edge. See [`plane_clearance`].
pub(super) fn clearance_beside_line(gap: f32, reach: f32, square: f32, longest: f32) -> f32 {
    let clearance = (LEFT_BY_TURN * gap - ROUNDING * longest) / (1.0 + reach);
    lower(clearance, TURN * square.sqrt())
}

/// Returns the clearance between the triangles at `u` and those at `v` without a common corner, how far all vertices
/// may move before these can intersect, by the plane through their common neighbour `p` that is normal to `v` − `u`.
/// `longest` is the longest edge at `u` and `v`.
pub(super) fn corner_plane_clearance(mesh: &Mesh, [u, v]: [VertexId; 2], p: VertexId, longest: f32) -> f32 {
    let normal = unit(mesh.position(v) - mesh.position(u));
    // The plane moves with p and keeps its normal.
    0.5 * (gap(mesh, [u, v], [p, p], mesh.position(p), normal) - ROUNDING * longest)
}

/// Returns the clearance between the triangles at `u` and those at `v`, which have no common corner: how far all
/// vertices may move before these can intersect, by the bisecting plane of `u` and `v`. `longest` is the longest edge
/// at both.
pub(super) fn mid_plane_clearance(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32) -> f32 {
    let (p, q) = (mesh.position(u), mesh.position(v));
    gap(mesh, [u, v], [u, v], (p + q) * 0.5, unit(q - p)) - ROUNDING * longest
}

/// Returns the clearance between the triangles at `u` and those at `v`, which have no common corner: how far all
/// vertices may move before these can intersect, by a plane between two sheets that face each other or away from each
/// other. `longest` is the longest edge at both.
pub(super) fn sheet_clearance(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32) -> f32 {
    let normal = unit(mesh.area_normal(u) - mesh.area_normal(v));
    let (p, q) = (mesh.position(u), mesh.position(v));
    let normal = if normal.dot(q - p) < 0.0 { -normal } else { normal };
    let height = |w: &VertexId| (mesh.position(*w) - p).dot(normal);
    let own = mesh.ring(u).as_slice().iter().map(height).fold(0.0, |top, h| if h > top { h } else { top });
    let other = mesh.ring(v).as_slice().iter().map(height).fold(height(&v), lower);
    // The plane does not move.
    0.5 * (other - own) - ROUNDING * longest
}

/// Returns the smallest distance of vertices from the plane through `origin` with the unit normal `normal`: of `u` and
/// its neighbours, which should be behind it, and of `v` and its neighbours, which should be in front; the vertices
/// `in_plane` are ignored. Not positive if one is on the wrong side.
fn gap(mesh: &Mesh, [u, v]: [VertexId; 2], in_plane: [VertexId; 2], origin: Vec3, normal: Vec3) -> f32 {
    let height = |w: VertexId| (mesh.position(w) - origin).dot(normal);
    let mut least = lower(-height(u), height(v));
    let counts = |w: VertexId| w != in_plane[0] && w != in_plane[1];
    for &w in mesh.ring(u).as_slice() {
        if counts(w) && w != v {
            least = lower(least, -height(w));
        }
    }
    for &w in mesh.ring(v).as_slice() {
        if counts(w) && w != u {
            least = lower(least, height(w));
        }
    }
    least
}

/// Appends to `intersecting` the corners of all pairs of triangles at `v` that intersect beyond their common corners, of
/// which one is among the `later`, numbers in the ring, and the other comes before it; exact.
pub(super) fn intersections_around(
    mesh: &Mesh,
    v: VertexId,
    later: Range<usize>,
    output: Option<&OutputSpace>,
    intersecting: &mut Vec<VertexId>,
) {
    let facets: Vec<Facet> = facets_at(mesh, v).collect();
    for k in later {
        let s = &facets[k];
        for t in facets[..k].iter().filter(|t| intersect(s, t, output)) {
            intersecting.extend(s.corners.into_iter().chain(t.corners).map(VertexId));
        }
    }
}

/// Returns whether one of the `changed` triangles (by their corners) at `v` intersects another triangle at `v` beyond
/// their common corners; exact. `longest` is the longest edge at `v`.
pub(super) fn changes_intersect_around(
    mesh: &Mesh,
    v: VertexId,
    longest: f32,
    changed: &[[VertexId; 3]],
    output: Option<&OutputSpace>,
) -> bool {
    let is_changed =
        |facet: &Facet| changed.iter().any(|corners| corners.iter().all(|w| facet.corners.contains(&w.0)));
    let facets: SmallVec<[Facet; ORDINARY_RING]> = facets_at(mesh, v).collect();
    let edited: SmallVec<[bool; ORDINARY_RING]> = facets.iter().map(is_changed).collect();
    let margin = 2.0 * (exact_below(output) + ROUNDING * longest);
    let last = facets.len() - 1;
    let intersects = |j: usize, k: usize| {
        let (s, t) = (&facets[j], &facets[k]);
        let share_an_edge = j + 1 == k || (j == 0 && k == last);
        (share_an_edge || !are_apart_at_corner(mesh.position(v), t, s, margin)) && intersect(t, s, output)
    };
    // Around a hub with thousands of triangles, an edit changes a few.
    (0..=last).filter(|&k| edited[k]).any(|k| {
        (0..k).any(|j| intersects(j, k)) || (k + 1..=last).any(|other| !edited[other] && intersects(k, other))
    })
}

/// Returns whether a plane through `corner`, the first corner of both triangles, is known to separate them, with their
/// other corners further than `margin` from it.
fn are_apart_at_corner(corner: Vec3, s: &Facet, t: &Facet, margin: f32) -> bool {
    let tips = |facet: &Facet| [facet.points[1] - corner, facet.points[2] - corner];
    gap_between_corners(tips(s), tips(t)) > margin
}

/// Appends to `intersecting` the corners of all pairs of intersecting triangles without a common corner, one at `u` and
/// one at `v`; exact.
pub(super) fn intersections_between(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    output: Option<&OutputSpace>,
    intersecting: &mut Vec<VertexId>,
) {
    let others: SmallVec<[(Facet, Bounds); ORDINARY_RING]> =
        facets_at(mesh, v).map(|facet| (facet, bounds(&facet, output))).collect();
    let around_v = others.iter().fold(Bounds::EMPTY, |all, (_, bounds)| all.union(bounds));
    for s in facets_at(mesh, u).filter(|s| !s.corners.contains(&v.0)) {
        let bounds = bounds(&s, output);
        if !bounds.overlaps(&around_v) {
            continue;
        }
        for (t, other) in &others {
            let apart = t.corners.iter().all(|w| !s.corners.contains(w));
            if apart && bounds.overlaps(other) && intersect(&s, t, output) {
                intersecting.extend(s.corners.into_iter().chain(t.corners).map(VertexId));
            }
        }
    }
}

fn facets_at(mesh: &Mesh, v: VertexId) -> impl Iterator<Item = Facet> + '_ {
    mesh.ring(v).pairs().map(move |(a, b)| mesh.facet([v, a, b]))
}
