//! Whether the triangles around one vertex, or at two vertices, cross each other.
//!
//! A quick test settles what lies simply, and tells how far all vertices may move before it must be asked again. What it
//! cannot settle is worked out exactly. The quick tests allow for rounding by a wide margin.

use super::FINEST;
use super::output::{OutputSpace, bounds, cross};
use crate::math::{Bounds, DVec3, Vec3};
use crate::mesh::{Facet, Mesh, VertexId};
use smallvec::SmallVec;

/// Triangles around a vertex for which there is room without a heap allocation.
pub(super) const ORDINARY_STAR: usize = 16;

/// What rounding may do to lengths and areas, in the longest edge and its square; a hundred times what it does.
pub(super) const ROUNDING: f32 = 1e-4;

/// The bounds on movement below hold for movements of less than this share of the lengths they were derived from.
const SMALL: f32 = 0.125;

/// The share of the distance from a plane that is left where the plane turns as far as two vertices in it, at least six
/// times as far apart as they move, can turn it: the cosine of that, √(1 − (1/3)²), rounded down.
const LEFT_BY_TURN: f32 = 0.94;
const TURN: f32 = 1.0 / 6.0;

/// The longest edge at `v`; not less than [`FINEST`].
pub(super) fn longest_edge(mesh: &Mesh, v: VertexId) -> f32 {
    let p = mesh.position(v);
    let square = mesh.ring(v).as_slice().iter().fold(0.0f32, |longest, &w| {
        let square = p.distance_squared(mesh.position(w));
        if square > longest { square } else { longest }
    });
    higher(FINEST, square.sqrt())
}

/// Its direction; 0 where it has no length. Where its square is beyond what single precision holds, in double.
pub(super) fn unit(way: Vec3) -> Vec3 {
    let square = way.length_squared();
    if (1e-30..1e30).contains(&square) {
        way * (1.0 / square.sqrt())
    } else {
        way.as_dvec3().try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
    }
}

/// By how much all vertices may move and all triangles at `v` still show their front along a direction, and turn about it
/// once in all; not positive where they do not. `longest` is the longest edge at `v`.
///
/// Twice the area that a triangle shows along a fixed direction changes by less than f·P + 3·f², where its vertices move
/// by f and its edges are P in all.
fn shown_along(mesh: &Mesh, v: VertexId, direction: Vec3, longest: f32) -> f32 {
    let ring = mesh.ring(v).as_slice();
    let [Some(&first), Some(&last)] = [ring.first(), ring.last()] else { return 0.0 };
    let centre = mesh.position(v);
    let across = direction.cross(mesh.position(first) - centre);
    let mut previous = mesh.position(last) - centre;
    let mut previous_length = previous.length();
    let mut room = SMALL * longest;
    let (rounding, spare) = (ROUNDING * longest * longest, 3.0 * SMALL * longest);
    // Spokes that turn one way, by less than half a turn each, make a turn each time they come from behind the first one.
    let (mut turns, mut before) = (0, false);
    for (k, &w) in ring.iter().enumerate() {
        let way = mesh.position(w) - centre;
        let length = way.length();
        let shown = previous.cross(way).dot(direction) - rounding;
        room = lower(room, shown / (previous_length + length + way.distance(previous) + spare));
        let behind = k > 0 && across.dot(way) < 0.0;
        turns += u32::from(before && !behind);
        before = behind;
        (previous, previous_length) = (way, length);
    }
    // With fewer than five no second turn is possible.
    let once = ring.len() < 5 || turns + u32::from(before) == 1;
    // Beyond what squares can be, nothing is known.
    if once && longest < f32::INFINITY { room } else { 0.0 }
}

/// A star that can be seen as a whole from one side has no triangles that cross. Returns by how much every vertex may
/// move and it still can; not positive where it cannot be seen so. `longest` is the longest edge at `v`.
pub(super) fn flatness(mesh: &Mesh, v: VertexId, longest: f32) -> f32 {
    shown_along(mesh, v, unit(mesh.area_normal(v)), longest)
}

/// The stars of two neighbours `u` and `v` that can both be seen from one side have no triangles that cross, if those of
/// one stay out of the corner behind each of the two vertices opposite the edge. Returns by how much every vertex may
/// move and they still do; not positive where it is not so. `longest` is the longest edge at `u` and `v`.
///
/// ```text
///        . behind .
///         .      .        Seen from that side, a point that triangles S at u and T at v have in common is not in the
///          .    .         triangle u v p; from u it is beyond p, and from v it is, so it is behind p. No triangle at u
///            p            comes there if none crosses the line through v and p; nor does one at v, if none crosses
///          /   \          the line through u and p. On the other side of u v it is the same with q.
///         u-----v
/// ```
pub(super) fn spread_out(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    [left, right]: [VertexId; 2],
    longest: f32,
) -> f32 {
    let at = |w: VertexId| mesh.position(w);
    let normal = unit((at(v) - at(u)).cross(at(left) - at(right)));
    let shown = lower(shown_along(mesh, u, normal, longest), shown_along(mesh, v, normal, longest));
    if shown <= 0.0 {
        return 0.0;
    }
    // Twice the least area of the triangles between a line and the neighbours of a vertex on its side.
    let before_line = |hub: VertexId, [from, to]: [VertexId; 2]| {
        let across = normal.cross(at(to) - at(from));
        let others = mesh.ring(hub).as_slice().iter().filter(|&&w| w != from && w != to);
        let areas = others.map(|&w| (at(w) - at(from)).dot(across));
        areas.fold((at(hub) - at(from)).dot(across), lower)
    };
    let at_left = higher(before_line(u, [v, left]), before_line(v, [left, u]));
    let at_right = higher(before_line(u, [right, v]), before_line(v, [u, right]));
    let rounding = ROUNDING * longest * longest;
    lower(shown, (lower(at_left, at_right) - rounding) / (6.5 * longest))
}

/// A plane through the vertices `p` and `q` may divide the triangles at `u` from those at `v`: then those that have no
/// corner in common do not cross. Returns by how much every vertex may move and it still does; not positive where it does
/// not divide them. `longest` is the longest edge at `u` and `v`; `p` and `q` are neighbours of both.
///
/// The plane follows `p` and `q`: it turns about the direction in it across the line through them. Where all vertices move
/// by f, a corner with distance g from it, beside the point p + t·(q − p) of that line, has at least
/// [`LEFT_BY_TURN`]·g − f·(1 + |t| + |1 − t|) afterwards.
pub(super) fn divided_through(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    [p, q]: [VertexId; 2],
    longest: f32,
) -> f32 {
    let origin = mesh.position(p);
    let divider = mesh.position(q) - origin;
    let square = divider.length_squared();
    let per_length = divider * (1.0 / square);
    let way = mesh.position(v) - mesh.position(u);
    // Without length there is no plane, and no room: the distances are NaN or 0.
    let normal = unit(way - divider * way.dot(per_length));
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
    room_beside_line(gap, reach, square, longest)
}

/// By how much every vertex may move and stay on its side of a plane through two of them: with `gap` from it at least, beside points
/// of the line through these two with |t| + |1 − t| up to `reach`, the square of their distance being `square`. See
/// [`divided_through`].
pub(super) fn room_beside_line(gap: f32, reach: f32, square: f32, longest: f32) -> f32 {
    let room = (LEFT_BY_TURN * gap - ROUNDING * longest) / (1.0 + reach);
    lower(room, TURN * square.sqrt())
}

/// As [`divided_through`], with a plane across the way from `u` to `v` that goes through `p`, a neighbour of both.
pub(super) fn divided_at(mesh: &Mesh, [u, v]: [VertexId; 2], p: VertexId, longest: f32) -> f32 {
    let normal = unit(mesh.position(v) - mesh.position(u));
    // The plane follows p and keeps its direction.
    0.5 * (gap(mesh, [u, v], [p, p], mesh.position(p), normal) - ROUNDING * longest)
}

/// As [`divided_through`], with the plane in the middle between `u` and `v`.
pub(super) fn divided_between(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32) -> f32 {
    let (p, q) = (mesh.position(u), mesh.position(v));
    gap(mesh, [u, v], [u, v], (p + q) * 0.5, unit(q - p)) - ROUNDING * longest
}

/// As [`divided_through`], with a plane between two sheets that face each other, or turn their backs on each other.
pub(super) fn divided_as_sheets(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32) -> f32 {
    let normal = unit(mesh.area_normal(u) - mesh.area_normal(v));
    let (p, q) = (mesh.position(u), mesh.position(v));
    let normal = if normal.dot(q - p) < 0.0 { -normal } else { normal };
    let height = |w: &VertexId| (mesh.position(*w) - p).dot(normal);
    let own = mesh.ring(u).as_slice().iter().map(height).fold(0.0, |top, h| if h > top { h } else { top });
    let other = mesh.ring(v).as_slice().iter().map(height).fold(height(&v), lower);
    // The plane stays where it is.
    0.5 * (other - own) - ROUNDING * longest
}

/// The least distance from the plane, on their side, of `u` and its neighbours, which should be behind, and of `v` and its
/// neighbours, which should be before; those `in_plane` left out. Not positive where one is not where it should be.
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

/// The lower one; the first where one is NaN.
#[inline]
pub(super) fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The higher one; the first where one is NaN.
#[inline]
pub(super) fn higher(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Puts the corners of all triangles around `v` that cross each other into `crossing`; exact.
pub(super) fn crossings_around(
    mesh: &Mesh,
    v: VertexId,
    output: Option<&OutputSpace>,
    crossing: &mut Vec<VertexId>,
) {
    let facets: Vec<Facet> = star(mesh, v).collect();
    for (k, s) in facets.iter().enumerate() {
        for t in facets[..k].iter().filter(|t| cross(s, t, output)) {
            crossing.extend(s.corners.into_iter().chain(t.corners).map(VertexId));
        }
    }
}

/// Puts the corners of all pairs of triangles that cross into `crossing`, one at `u` and one at `v`, with no corner in
/// common; exact.
pub(super) fn crossings_between(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    output: Option<&OutputSpace>,
    crossing: &mut Vec<VertexId>,
) {
    let others: SmallVec<[(Facet, Bounds); ORDINARY_STAR]> =
        star(mesh, v).map(|facet| (facet, bounds(&facet, output))).collect();
    let around_v = others.iter().fold(Bounds::EMPTY, |all, (_, bounds)| all.joined(bounds));
    for s in star(mesh, u).filter(|s| !s.corners.contains(&v.0)) {
        let bounds = bounds(&s, output);
        if !bounds.meets(&around_v) {
            continue;
        }
        for (t, other) in &others {
            let apart = t.corners.iter().all(|w| !s.corners.contains(w));
            if apart && bounds.meets(other) && cross(&s, t, output) {
                crossing.extend(s.corners.into_iter().chain(t.corners).map(VertexId));
            }
        }
    }
}

fn star(mesh: &Mesh, v: VertexId) -> impl Iterator<Item = Facet> + '_ {
    mesh.ring(v).pairs().map(move |(a, b)| mesh.facet([v, a, b]))
}
