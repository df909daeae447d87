//! Whether the triangles around one vertex, or at two vertices, cross each other.
//!
//! A quick test settles what lies simply, and tells how far all vertices may move before it must be asked again. What it
//! cannot settle is worked out exactly. The quick tests allow for rounding by a wide margin.

use crate::math::{Bounds, Vec3};
use crate::mesh::{Facet, Mesh, VertexId, facets_cross};
use smallvec::SmallVec;

/// Valence up to which quick tests of a star are tried.
const MOST_SPOKES: usize = 16;

/// What rounding may do to lengths and areas, in the longest edge and its square; a hundred times what it does.
const ROUNDING: f32 = 1e-4;

/// The bounds on movement below hold for movements of less than this share of the lengths they were derived from.
const SMALL: f32 = 0.125;

/// The longest edge at `v`.
pub(super) fn longest_edge(mesh: &Mesh, v: VertexId) -> f32 {
    let p = mesh.position(v);
    let square = mesh.ring(v).as_slice().iter().fold(0.0f32, |longest, &w| {
        let square = p.distance_squared(mesh.position(w));
        if square > longest { square } else { longest }
    });
    square.sqrt()
}

/// The edges at a vertex, as ways from it.
struct Spokes {
    ways: [Vec3; MOST_SPOKES],
    count: usize,
}

impl Spokes {
    /// `None` where there are too many.
    fn new(mesh: &Mesh, v: VertexId) -> Option<Self> {
        let ring = mesh.ring(v).as_slice();
        let centre = mesh.position(v);
        let mut ways = [Vec3::ZERO; MOST_SPOKES];
        if ring.len() > MOST_SPOKES {
            return None;
        }
        for (way, &w) in ways.iter_mut().zip(ring) {
            *way = mesh.position(w) - centre;
        }
        Some(Self { ways, count: ring.len() })
    }

    /// Twice the areas of the triangles, along their normals.
    #[inline]
    fn areas(&self) -> impl Iterator<Item = Vec3> + '_ {
        (0..self.count).map(|k| self.ways[k].cross(self.ways[if k + 1 == self.count { 0 } else { k + 1 }]))
    }

    /// Twice the least area that a triangle shows along a direction, where they turn about it once in all; else nothing.
    fn shown_along(&self, direction: Vec3) -> f32 {
        let least = self.areas().fold(f32::INFINITY, |least, area| lower(least, area.dot(direction)));
        if least > 0.0 && self.go_round_once(direction) { least } else { 0.0 }
    }

    /// Whether spokes that turn one way about `axis`, by less than half a turn each, make one turn in all.
    fn go_round_once(&self, axis: Vec3) -> bool {
        // With fewer than five no second turn is possible.
        if self.count < 5 {
            return true;
        }
        let across = axis.cross(self.ways[0]);
        let mut turns = 0;
        let mut before = false;
        for way in &self.ways[1..self.count] {
            let behind = across.dot(*way) < 0.0;
            turns += u32::from(before && !behind);
            before = behind;
        }
        turns + u32::from(before) == 1
    }
}

/// A star that can be seen as a whole from one side has no triangles that cross. Returns by how much every vertex may
/// move and it still can; not positive where it cannot be seen so. `longest` is the longest edge at `v`.
///
/// Twice the area that a triangle shows along a fixed direction changes by less than 4·f·L + 4·f² < 4.5·f·L, where its
/// vertices move by f and its edges are no longer than L > 8·f.
pub(super) fn flatness(mesh: &Mesh, v: VertexId, longest: f32) -> f32 {
    let Some(spokes) = Spokes::new(mesh, v) else { return 0.0 };
    let normal = spokes.areas().fold(Vec3::ZERO, |sum, area| sum + area).normalize_or_zero();
    let shown = spokes.shown_along(normal);
    lower((shown - ROUNDING * longest * longest) / (4.5 * longest), SMALL * longest)
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
    let normal = (at(v) - at(u)).cross(at(left) - at(right)).normalize_or_zero();
    let (Some(around_u), Some(around_v)) = (Spokes::new(mesh, u), Spokes::new(mesh, v)) else { return 0.0 };
    let shown = lower(around_u.shown_along(normal), around_v.shown_along(normal));
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
    let higher = |a: f32, b: f32| if a > b { a } else { b };
    let at_left = higher(before_line(u, [v, left]), before_line(v, [left, u]));
    let at_right = higher(before_line(u, [right, v]), before_line(v, [u, right]));
    let rounding = ROUNDING * longest * longest;
    let room = lower(shown - rounding, lower(at_left, at_right) - rounding) / (6.5 * longest);
    lower(room, SMALL * longest)
}

/// A plane through the vertices `p` and `q` may divide the triangles at `u` from those at `v`: then those that have no
/// corner in common do not cross. Returns by how much every vertex may move and it still does; not positive where it does
/// not divide them. `longest` is the longest edge at `u` and `v`; `p` and `q` are neighbours of both.
///
/// The plane follows `p` and `q`: where all vertices move by f, the distance g of a corner from it changes by less than
/// 2·f·(1 + 3·L/|pq|), with the longest edge L > 8·f and |pq| > 8·f.
pub(super) fn divided_through(
    mesh: &Mesh,
    [u, v]: [VertexId; 2],
    [p, q]: [VertexId; 2],
    longest: f32,
) -> f32 {
    let origin = mesh.position(p);
    let divider = mesh.position(q) - origin;
    let square = divider.length_squared();
    let way = mesh.position(v) - mesh.position(u);
    // Without length there is no plane, and no room: the distances are NaN or 0.
    let normal = (way - divider * (way.dot(divider) / square)).normalize_or_zero();
    let gap = gap(mesh, [u, v], [p, q], origin, normal) - ROUNDING * longest;
    let length = square.sqrt();
    let room = gap / (2.0 + 6.0 * longest / length);
    lower(room, SMALL * lower(length, longest))
}

/// As [`divided_through`], with the plane in the middle between `u` and `v`.
pub(super) fn divided_between(mesh: &Mesh, [u, v]: [VertexId; 2], longest: f32) -> f32 {
    let (p, q) = (mesh.position(u), mesh.position(v));
    gap(mesh, [u, v], [u, v], (p + q) * 0.5, (q - p).normalize_or_zero()) - ROUNDING * longest
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
fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// Puts the corners of all triangles around `v` that cross each other into `crossing`; exact.
pub(super) fn crossings_around(mesh: &Mesh, v: VertexId, crossing: &mut Vec<VertexId>) {
    let facets: Vec<Facet> = star(mesh, v).collect();
    for (k, s) in facets.iter().enumerate() {
        for t in facets[..k].iter().filter(|t| facets_cross(s, t)) {
            crossing.extend(s.corners.into_iter().chain(t.corners).map(VertexId));
        }
    }
}

/// Puts the corners of all pairs of triangles that cross into `crossing`, one at `u` and one at `v`, with no corner in
/// common; exact.
pub(super) fn crossings_between(mesh: &Mesh, [u, v]: [VertexId; 2], crossing: &mut Vec<VertexId>) {
    let others: SmallVec<[(Facet, Bounds); MOST_SPOKES]> =
        star(mesh, v).map(|facet| (facet, Bounds::of(&facet.points))).collect();
    let around_v = others.iter().fold(Bounds::EMPTY, |all, (_, bounds)| all.joined(bounds));
    for s in star(mesh, u).filter(|s| !s.corners.contains(&v.0)) {
        let bounds = Bounds::of(&s.points);
        if !bounds.meets(&around_v) {
            continue;
        }
        for (t, other) in &others {
            let apart = t.corners.iter().all(|w| !s.corners.contains(w));
            if apart && bounds.meets(other) && facets_cross(&s, t) {
                crossing.extend(s.corners.into_iter().chain(t.corners).map(VertexId));
            }
        }
    }
}

fn star(mesh: &Mesh, v: VertexId) -> impl Iterator<Item = Facet> + '_ {
    mesh.ring(v).pairs().map(move |(a, b)| mesh.facet([v, a, b]))
}
