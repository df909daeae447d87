//! Self-intersections of triangle meshes: pairs found by a bounding volume hierarchy, decided by exact predicates.

use super::TriangleMesh;
use crate::math::order::{combined_rank, sort_by_rank, sort_ranks};
use crate::math::predicates::{
    collinear, triangles_intersect, triangles_intersect_sharing_vertex, triangles_overlap_sharing_edge,
};
use crate::math::{Bounds, BoxTreeBuilder, Vec3};
use crate::pauses::{Pauses, finished};
use std::cell::Cell;
use std::collections::BTreeSet;

/// Returns the pairs of triangles that intersect beyond their common corners and edges, each with the lower index
/// first, sorted.
///
/// The test is exact and includes touching. Coplanar triangles folded onto each other at a common edge count, and so do
/// two triangles with the same three corners, unless these are collinear. Triangles with two equal corners, an invalid
/// index or a position that is not finite are ignored. The list may be quadratic in the number of triangles;
/// [`count_self_intersections`] only counts.
pub fn intersecting_pairs(mesh: &TriangleMesh) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    for_each_tested_pair(mesh, |s, t, intersect| {
        if intersect {
            pairs.push(combined_rank(s, t));
        }
        true
    });
    sort_ranks(&mut pairs);
    pairs.into_iter().map(|pair| [(pair >> 32) as u32, pair as u32]).collect()
}

/// Returns whether there is any of the [`intersecting_pairs`] for which `counts` holds; stops at the first. Pauses
/// meanwhile.
pub(crate) async fn intersect_anywhere(
    mesh: &TriangleMesh,
    counts: impl Fn([u32; 2]) -> bool,
    pauses: &Pauses,
) -> bool {
    let mut found = false;
    let visit = |s, t, intersect| {
        found |= intersect && counts([s, t]);
        !found
    };
    visit_tested_pairs(mesh, visit, pauses).await;
    found
}

/// Returns the number of self-intersections: the length of [`intersecting_pairs`], without storing the pairs.
///
/// Memory is linear in the number of triangles. So is time if few bounding boxes of triangles overlap; it is quadratic
/// if all do.
pub fn count_self_intersections(mesh: &TriangleMesh) -> usize {
    finished(count_self_intersections_in_slices(mesh, &Pauses::default()))
}

/// Does what [`count_self_intersections`] does, and pauses meanwhile.
pub(crate) async fn count_self_intersections_in_slices(mesh: &TriangleMesh, pauses: &Pauses) -> usize {
    let mut count = 0;
    let visit = |_, _, intersect| {
        count += usize::from(intersect);
        true
    };
    visit_tested_pairs(mesh, visit, pauses).await;
    count
}

/// Returns which parts of a mesh intersect each other, or themselves: pairs of the numbers in `part_of`, which has that of
/// each triangle, the lower one first. `None` if too many triangles overlap to test all pairs.
pub(crate) async fn intersecting_parts(
    mesh: &TriangleMesh,
    part_of: &[u32],
    pauses: &Pauses,
) -> Option<BTreeSet<[u32; 2]>> {
    let most = MOST_TESTED[0].max(MOST_TESTED[1].saturating_mul(mesh.triangles.len()));
    let (mut pairs, mut tested) = (BTreeSet::new(), 0);
    let visit = |s, t, intersect| {
        tested += 1;
        if intersect {
            let [one, other] = [s, t].map(|triangle: u32| part_of[triangle as usize]);
            pairs.insert([one.min(other), one.max(other)]);
        }
        tested < most
    };
    visit_tested_pairs(mesh, visit, pauses).await;
    (tested < most).then_some(pairs)
}

/// Number of self-intersections after which [`count_in_time`] stops.
const MOST_FOUND: usize = 100_000;

/// Number of pairs of triangles, and of pairs for each triangle, after which [`count_in_time`] stops: meshes have some
/// twenty pairs a triangle whose boxes overlap, and flat polygons of many corners more.
const MOST_TESTED: [usize; 2] = [20_000_000, 60];

/// The number of self-intersections of a mesh, as far as they were counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CountInTime {
    pub found: usize,
    /// Whether all pairs of triangles that may intersect were tested, and all that do were counted. Where not, there may be
    /// more, even if none was found: boxes of triangles around a vertex of thousands overlap, whether or not they intersect.
    pub is_complete: bool,
}

/// Counts self-intersections as [`count_self_intersections`] does, but stops where so many triangles lie on each other that
/// time would be quadratic. Triangles with the same corners are tested once.
pub(crate) async fn count_in_time(mesh: &TriangleMesh, pauses: &Pauses) -> CountInTime {
    count_within(mesh, MOST_TESTED, pauses).await
}

/// Does what [`count_in_time`] does, with at most as many tests as given, in all and for each triangle, whichever are more.
pub(super) async fn count_within(mesh: &TriangleMesh, most: [usize; 2], pauses: &Pauses) -> CountInTime {
    let (distinct, times) = distinct_triangles(mesh);
    pauses.now().await;
    let most = most[0].max(most[1].saturating_mul(times.len()));
    let corners = |t: usize| distinct.triangles[t].map(|v| distinct.positions[v as usize]);
    let pairs = times.iter().enumerate().filter(|&(t, &times)| times > 1 && !collinear(corners(t)));
    let mut found = pairs.fold(0, |sum: usize, (_, &times)| sum.saturating_add(times * (times - 1) / 2));
    let (mut tested, mut is_complete) = (0, true);
    let visit = |s: u32, t: u32, intersect| {
        // Asked when there is another pair: the last one ends a complete search.
        is_complete = tested < most && found < MOST_FOUND;
        tested += 1;
        if is_complete && intersect {
            found = found.saturating_add(times[s as usize].saturating_mul(times[t as usize]));
        }
        is_complete
    };
    visit_tested_pairs(&distinct, visit, pauses).await;
    CountInTime { found: found.min(MOST_FOUND), is_complete: is_complete && found <= MOST_FOUND }
}

/// Returns the valid triangles of a mesh, those with the same corners once, and how often each is there.
fn distinct_triangles(mesh: &TriangleMesh) -> (TriangleMesh, Vec<usize>) {
    let valid = mesh.triangles.iter().filter(|triangle| valid_corners(mesh, triangle).is_some());
    let mut triangles: Vec<[u32; 3]> = valid.copied().collect();
    let sorted = |&[a, b, c]: &[u32; 3]| {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        [low, a ^ b ^ c ^ low ^ high, high]
    };
    sort_by_rank(&mut triangles, |triangle| u64::from(sorted(triangle)[2]));
    sort_by_rank(&mut triangles, |triangle| combined_rank(sorted(triangle)[0], sorted(triangle)[1]));
    let mut times = Vec::new();
    let mut distinct = Vec::new();
    for same in triangles.chunk_by(|one, other| sorted(one) == sorted(other)) {
        distinct.push(same[0]);
        times.push(same.len());
    }
    let mesh = TriangleMesh {
        positions: mesh.positions.clone(),
        triangles: distinct,
        origin: mesh.origin,
        ..TriangleMesh::default()
    };
    (mesh, times)
}

/// Calls `visit` with each pair of triangles whose boxes overlap, and whether they intersect, until it returns false.
fn for_each_tested_pair(mesh: &TriangleMesh, visit: impl FnMut(u32, u32, bool) -> bool) {
    finished(visit_tested_pairs(mesh, visit, &Pauses::default()));
}

/// Pairs of nodes or triangles whose tests are a unit of work.
const PER_UNIT: usize = 32;

/// Does what [`for_each_tested_pair`] does, and pauses meanwhile.
async fn visit_tested_pairs(
    mesh: &TriangleMesh,
    mut visit: impl FnMut(u32, u32, bool) -> bool,
    pauses: &Pauses,
) {
    let (valid, boxes): (Vec<u32>, Vec<Bounds>) = (0..)
        .zip(&mesh.triangles)
        .filter_map(|(t, triangle)| {
            valid_corners(mesh, triangle).map(|corners| (t, Bounds::from_points(&corners)))
        })
        .unzip();
    let mut builder = BoxTreeBuilder::new(&boxes);
    while let Some(boxes) = builder.advance() {
        pauses.after(boxes / PER_UNIT).await;
    }
    let tree = builder.finish();
    let (tested, goes_on) = (Cell::new(0), Cell::new(true));
    let mut test = |i: u32, j: u32| {
        if goes_on.get() {
            tested.set(tested.get() + 1);
            let (s, t) = (valid[i as usize], valid[j as usize]);
            goes_on.set(visit(s, t, facets_intersect(&facet(mesh, s), &facet(mesh, t))));
        }
    };
    let mut pairs = tree.pairs();
    while goes_on.get() && (0..PER_UNIT).all(|_| pairs.advance(&mut test)) {
        pauses.after(1 + tested.take() / PER_UNIT).await;
    }
}

fn valid_corners(mesh: &TriangleMesh, &[a, b, c]: &[u32; 3]) -> Option<[Vec3; 3]> {
    let corner = |v: u32| mesh.positions.get(v as usize).copied().filter(|p| p.is_finite());
    let corners = [corner(a)?, corner(b)?, corner(c)?];
    (a != b && b != c && c != a).then_some(corners)
}

fn facet(mesh: &TriangleMesh, triangle: u32) -> Facet {
    let corners = mesh.triangles[triangle as usize];
    Facet { corners, points: corners.map(|v| mesh.positions[v as usize]) }
}

/// A triangle given by vertex indices and positions, the input of intersection tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// The vertex indices of the corners; equal indices mean a common corner.
    pub corners: [u32; 3],
    /// The positions of the corners.
    pub points: [Vec3; 3],
}

impl Facet {
    /// Returns the corner positions of the triangle, rotated cyclically so that the corner whose vertex index satisfies
    /// `is_first` comes first.
    fn rotated(&self, is_first: impl Fn(u32) -> bool) -> [Vec3; 3] {
        let [a, b, c] = self.points;
        match self.corners.map(is_first) {
            [true, _, _] => [a, b, c],
            [_, true, _] => [b, c, a],
            _ => [c, a, b],
        }
    }
}

/// Returns whether two triangles intersect beyond their common corners and edges.
///
/// The test is exact and includes touching. Coplanar triangles folded onto each other at a common edge count, and so do
/// two triangles with the same three corners, unless these are collinear.
pub fn facets_intersect(s: &Facet, t: &Facet) -> bool {
    let in_s = |v: u32| s.corners.contains(&v);
    let in_t = |v: u32| t.corners.contains(&v);
    match s.corners.iter().filter(|&&v| in_t(v)).count() {
        0 => triangles_intersect(s.points, t.points),
        1 => {
            let ([shared, a, b], [_, c, d]) = (s.rotated(in_t), t.rotated(in_s));
            triangles_intersect_sharing_vertex(shared, [a, b], [c, d])
        }
        2 => {
            let ([tip, u, v], [other_tip, ..]) = (s.rotated(|v| !in_t(v)), t.rotated(|v| !in_s(v)));
            triangles_overlap_sharing_edge(u, v, tip, other_tip)
        }
        _ => !collinear(s.points),
    }
}
