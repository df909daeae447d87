//! Pairs of triangles that cross, found through a tree of boxes and settled by exact predicates.

use super::TriangleMesh;
use crate::math::predicates::{
    collinear, triangles_cross, triangles_cross_sharing_vertex, triangles_fold_sharing_edge,
};
use crate::math::{Bounds, BoxTree, Vec3};

/// The pairs of triangles that share more than their common corners and edges, lower index first, sorted.
///
/// Exact, touching included; a coplanar fold over a common edge counts, and so do two triangles on the same three
/// corners. Triangles that name a corner twice, a vertex that does not exist or one that is not finite are left out.
/// The list is as long as the answer, which may be quadratic; [`count_crossings`] stores nothing.
pub fn crossing_pairs(mesh: &TriangleMesh) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    for_each_crossing(mesh, |s, t| pairs.push([s, t]));
    pairs.sort_unstable();
    pairs
}

/// The number of [`crossing_pairs`]. Memory is linear in the number of triangles; time too, in a mesh where few boxes
/// of triangles meet, and quadratic where all do.
pub fn count_crossings(mesh: &TriangleMesh) -> usize {
    let mut count = 0;
    for_each_crossing(mesh, |_, _| count += 1);
    count
}

fn for_each_crossing(mesh: &TriangleMesh, mut visit: impl FnMut(u32, u32)) {
    let (sound, boxes): (Vec<u32>, Vec<Bounds>) = (0..)
        .zip(&mesh.triangles)
        .filter_map(|(t, triangle)| sound_corners(mesh, triangle).map(|corners| (t, Bounds::of(&corners))))
        .unzip();
    BoxTree::new(&boxes).for_each_pair(|i, j| {
        let (s, t) = (sound[i as usize], sound[j as usize]);
        if cross(mesh, mesh.triangles[s as usize], mesh.triangles[t as usize]) {
            visit(s, t);
        }
    });
}

fn sound_corners(mesh: &TriangleMesh, &[a, b, c]: &[u32; 3]) -> Option<[Vec3; 3]> {
    let corner = |v: u32| mesh.positions.get(v as usize).copied().filter(|p| p.is_finite());
    let corners = [corner(a)?, corner(b)?, corner(c)?];
    (a != b && b != c && c != a).then_some(corners)
}

fn cross(mesh: &TriangleMesh, s: [u32; 3], t: [u32; 3]) -> bool {
    let at = |v: u32| mesh.positions[v as usize];
    triangles_meet((s, s.map(at)), (t, t.map(at)))
}

/// Whether two triangles, each by the names and the places of its corners, share more than their common corners and
/// edges. Exact, as [`crossing_pairs`].
pub fn triangles_meet<Name: Copy + PartialEq>(s: ([Name; 3], [Vec3; 3]), t: ([Name; 3], [Vec3; 3])) -> bool {
    match s.0.iter().filter(|v| t.0.contains(v)).count() {
        0 => triangles_cross(s.1, t.1),
        1 => {
            let [shared, a, b] = rotated(s, |v| t.0.contains(&v));
            let [_, c, d] = rotated(t, |v| s.0.contains(&v));
            triangles_cross_sharing_vertex(shared, [a, b], [c, d])
        }
        2 => {
            let [tip, u, v] = rotated(s, |v| !t.0.contains(&v));
            let [other_tip, ..] = rotated(t, |v| !s.0.contains(&v));
            triangles_fold_sharing_edge(u, v, tip, other_tip)
        }
        _ => !collinear(s.1),
    }
}

/// The places of the same triangle's corners from the one that is asked for.
fn rotated<Name: Copy>(
    ([a, b, _], [p, q, r]): ([Name; 3], [Vec3; 3]),
    is_first: impl Fn(Name) -> bool,
) -> [Vec3; 3] {
    if is_first(a) {
        [p, q, r]
    } else if is_first(b) {
        [q, r, p]
    } else {
        [r, p, q]
    }
}
