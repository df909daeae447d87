//! Validation of a triangle list from its arrays alone, independent of the dynamic mesh; one function per invariant.

use super::disjoint_sets::DisjointSets;
use super::edge_table::{HalfEdge, by_edge, sorted_half_edges};
use super::self_intersections::count_in_time;
use super::{MeshError, TriangleMesh};
use crate::math::order::{combined_rank, sort_by_rank, sort_pairs};
use crate::math::predicates::collinear;
use crate::pauses::{Pauses, finished};

/// The result of validating a mesh by [`report`]; see [`Self::is_healthy`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshReport {
    /// Whether no edge belongs to exactly one triangle; true without triangles.
    pub closed: bool,
    /// Whether, at each edge, equally many triangles traverse it in both directions, apart from one if their number is
    /// odd.
    pub oriented: bool,
    /// The number of edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// The number of vertices whose triangles do not form a single fan, open or closed; this includes the ends of
    /// non-manifold edges.
    pub non_manifold_vertices: usize,
    /// The number of triangles with two equal corners or collinear corners, tested exactly.
    pub degenerate_triangles: usize,
    /// The number of pairs of triangles that intersect beyond their common corners and edges, tested exactly; see
    /// [`intersecting_pairs`](super::intersecting_pairs).
    pub self_intersections: usize,
    /// Whether the search for self-intersections was cut short, so that there may be more than were counted, even if none
    /// was found. It ends at 100,000, and after 20 million pairs of triangles whose boxes overlap, or 60 for each triangle:
    /// where many lie on each other, or thousands meet in a vertex, more would take minutes.
    pub has_more: bool,
}

impl MeshReport {
    /// Returns whether the mesh is a closed, oriented, embedded 2-manifold without degenerate triangles.
    pub fn is_healthy(&self) -> bool {
        self.closed
            && self.oriented
            && self.non_manifold_edges == 0
            && self.non_manifold_vertices == 0
            && self.degenerate_triangles == 0
            && self.self_intersections == 0
            && !self.has_more
    }
}

/// Validates `mesh`. Triangles with two equal corners count as degenerate and are ignored by all other tests.
///
/// # Errors
/// [`MeshError::InvalidArgument`] if [`TriangleMesh::validate`] fails, for example for an invalid index or a position
/// that is not finite.
pub fn report(mesh: &TriangleMesh) -> Result<MeshReport, MeshError> {
    finished(report_in_slices(mesh, &Pauses::default()))
}

/// Does what [`report`] does, and pauses meanwhile.
///
/// # Errors
/// As [`report`].
pub async fn report_in_slices(mesh: &TriangleMesh, pauses: &Pauses) -> Result<MeshReport, MeshError> {
    mesh.validate()?;
    let uses = sorted_half_edges(&mesh.triangles);
    pauses.now().await;
    let non_manifold_vertices = non_manifold_vertices(mesh);
    pauses.now().await;
    let degenerate_triangles = degenerate_triangles(mesh);
    let intersections = count_in_time(mesh, pauses).await;
    Ok(MeshReport {
        closed: is_closed(&uses),
        oriented: is_oriented(&uses),
        non_manifold_edges: non_manifold_edges(&uses),
        non_manifold_vertices,
        degenerate_triangles,
        self_intersections: intersections.found,
        has_more: !intersections.is_complete,
    })
}

fn is_closed(uses: &[HalfEdge]) -> bool {
    by_edge(uses).all(|edge| edge.len() != 1)
}

fn is_oriented(uses: &[HalfEdge]) -> bool {
    by_edge(uses).all(|edge| {
        let forward = edge.iter().filter(|u| u.forward).count();
        forward.abs_diff(edge.len() - forward) <= edge.len() % 2
    })
}

fn non_manifold_edges(uses: &[HalfEdge]) -> usize {
    by_edge(uses).filter(|edge| edge.len() > 2).count()
}

fn degenerate_triangles(mesh: &TriangleMesh) -> usize {
    // Two equal corners have equal positions, so these triangles are collinear, too.
    mesh.corners().filter(|&corners| collinear(corners)).count()
}

fn non_manifold_vertices(mesh: &TriangleMesh) -> usize {
    let links = links(mesh);
    links.chunk_by(|a, b| a.vertex == b.vertex).filter(|link| !is_path_or_cycle(link)).count()
}

/// An edge of the link of a vertex: the edge opposite `vertex` in one of its triangles.
#[derive(Clone, Copy)]
struct LinkEdge {
    vertex: u32,
    from: u32,
    to: u32,
}

/// Returns the link edges of all vertices, sorted by vertex, without those of triangles with two equal corners.
fn links(mesh: &TriangleMesh) -> Vec<LinkEdge> {
    let valid = mesh.triangles.iter().filter(|&&[a, b, c]| a != b && b != c && c != a);
    let mut links: Vec<_> = valid
        .flat_map(|&[a, b, c]| {
            [(a, b, c), (b, c, a), (c, a, b)].map(|(vertex, from, to)| LinkEdge { vertex, from, to })
        })
        .collect();
    sort_by_rank(&mut links, |link| combined_rank(link.from, link.to));
    sort_by_rank(&mut links, |link| link.vertex.into());
    links
}

/// Returns whether the link of a vertex is a path or a cycle, so that the vertex is manifold: connected, with at most
/// two edges at each vertex of the link.
fn is_path_or_cycle(link: &[LinkEdge]) -> bool {
    let mut ends: Vec<(u64, u32)> =
        link.iter().zip(0..).flat_map(|(edge, i)| [(edge.from.into(), i), (edge.to.into(), i)]).collect();
    sort_pairs(&mut ends);
    let mut groups = DisjointSets::new(link.len());
    let mut valence_ok = true;
    for at_vertex in ends.chunk_by(|a, b| a.0 == b.0) {
        valence_ok &= at_vertex.len() <= 2;
        at_vertex.windows(2).for_each(|pair| groups.union(pair[0].1 as usize, pair[1].1 as usize));
    }
    valence_ok && groups.count() == 1
}

#[cfg(test)]
mod tests {
    use super::super::intersecting_pairs;
    use super::super::self_intersections::{CountInTime, count_within};
    use super::super::shapes;
    use super::*;
    use crate::math::Vec3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn healthy() -> MeshReport {
        report(&TriangleMesh::default()).unwrap()
    }

    /// Returns a tetrahedron with the given corners; its triangles face outwards if the edges from the first corner to
    /// the others, in order, are right-handed.
    fn tetrahedron(corners: [Vec3; 4]) -> TriangleMesh {
        TriangleMesh {
            positions: corners.to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            ..Default::default()
        }
    }

    fn corner_tetrahedron() -> TriangleMesh {
        tetrahedron([Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z])
    }

    #[test]
    fn exact_shapes_are_healthy() {
        for mesh in [corner_tetrahedron(), shapes::cuboid(Vec3::ONE), shapes::torus(2.0, 0.5, 24, 12)] {
            assert_eq!(report(&mesh).unwrap(), healthy());
            assert!(report(&mesh).unwrap().is_healthy());
        }
    }

    #[test]
    fn a_missing_triangle_opens_the_mesh() {
        let mut mesh = corner_tetrahedron();
        mesh.triangles.pop();
        assert_eq!(report(&mesh).unwrap(), MeshReport { closed: false, ..healthy() });
    }

    #[test]
    fn a_turned_triangle_breaks_orientation() {
        let mut mesh = corner_tetrahedron();
        mesh.triangles[0].swap(0, 1);
        assert_eq!(report(&mesh).unwrap(), MeshReport { oriented: false, ..healthy() });
    }

    #[test]
    fn two_tetrahedra_on_one_edge() {
        let mut mesh = corner_tetrahedron();
        mesh.positions.extend([Vec3::new(0.5, -1.0, -1.0), Vec3::new(0.5, -1.0, -3.0)]);
        mesh.triangles.extend([[0, 4, 1], [0, 1, 5], [1, 4, 5], [4, 0, 5]]);
        let expected = MeshReport { non_manifold_edges: 1, non_manifold_vertices: 2, ..healthy() };
        assert_eq!(report(&mesh).unwrap(), expected);
    }

    #[test]
    fn two_tetrahedra_on_one_vertex() {
        let mut mesh = corner_tetrahedron();
        mesh.positions.extend([-Vec3::X, -Vec3::Y, -Vec3::Z]);
        mesh.triangles.extend([[0, 4, 5], [0, 6, 4], [4, 6, 5], [5, 6, 0]]);
        assert_eq!(report(&mesh).unwrap(), MeshReport { non_manifold_vertices: 1, ..healthy() });
    }

    #[test]
    fn degenerate_triangles_are_counted_exactly() {
        let mut mesh = corner_tetrahedron();
        mesh.triangles.push([0, 0, 1]);
        assert_eq!(report(&mesh).unwrap(), MeshReport { degenerate_triangles: 1, ..healthy() });
        let line = |y: f32| TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::new(1.0, y, 0.0), Vec3::new(2.0, 0.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        assert_eq!(report(&line(0.0)).unwrap().degenerate_triangles, 1);
        assert_eq!(report(&line(f32::from_bits(1))).unwrap().degenerate_triangles, 0);
    }

    #[test]
    fn invalid_input_is_rejected() {
        let mut mesh = corner_tetrahedron();
        mesh.triangles[2][1] = 4;
        let MeshError::InvalidArgument { parameter, problem } = report(&mesh).unwrap_err() else { panic!() };
        assert_eq!(parameter, "indices");
        assert!(problem.contains("triangle 2") && problem.contains('4'), "{problem}");
        let mut mesh = corner_tetrahedron();
        mesh.positions[3].y = f32::NAN;
        let MeshError::InvalidArgument { parameter, .. } = report(&mesh).unwrap_err() else { panic!() };
        assert_eq!(parameter, "positions");
        assert_eq!(intersecting_pairs(&mesh), [[0_u32; 2]; 0]);
    }

    #[test]
    fn intersecting_tetrahedra_counted_by_hand() {
        // The tip of a thin spike is inside a large tetrahedron and passes only through its base z = 0. Three sides of
        // the spike intersect the base; nothing else is near.
        let large = tetrahedron([
            Vec3::new(-6.0, -6.0, 0.0),
            Vec3::new(6.0, -6.0, 0.0),
            Vec3::new(0.0, 6.0, 0.0),
            Vec3::new(0.0, 0.0, 6.0),
        ]);
        let spike = tetrahedron([
            Vec3::new(-1.0, -1.0, -2.0),
            Vec3::new(0.0, 1.0, -2.0),
            Vec3::new(1.0, -1.0, -2.0),
            Vec3::new(0.0, 0.0, 1.0),
        ]);
        let mesh = shapes::joined(&[large.clone(), spike.clone()]);
        assert_eq!(intersecting_pairs(&mesh), [[0, 5], [0, 6], [0, 7]]);
        assert_eq!(report(&mesh).unwrap(), MeshReport { self_intersections: 3, ..healthy() });
        // With the tip exactly on the base, its three sides touch the base; slightly below, nothing does.
        for (tip, pairs) in [(0.0, 3), (-1.0e-30, 0)] {
            let mut lower = spike.clone();
            lower.positions[3].z = tip;
            assert_eq!(intersecting_pairs(&shapes::joined(&[large.clone(), lower])).len(), pairs, "{tip}");
        }
    }

    #[test]
    fn boxes_face_to_face_touch() {
        let cube = shapes::cuboid(Vec3::ONE);
        let shifted = |x: f32| {
            let mut other = cube.clone();
            other.positions.iter_mut().for_each(|p| p.x += x);
            intersecting_pairs(&shapes::joined(&[cube.clone(), other])).len()
        };
        assert_eq!(shifted(1.0 + f32::EPSILON), 0);
        assert!(shifted(1.0) >= 4);
        assert!(shifted(0.5) > 0);
    }

    #[test]
    fn folds_and_doubles() {
        let mut mesh = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)],
            triangles: vec![[0, 1, 2], [1, 0, 3]],
            ..Default::default()
        };
        assert_eq!(intersecting_pairs(&mesh), [[0, 1]]);
        mesh.triangles = vec![[0, 1, 2], [2, 1, 3]];
        assert_eq!(intersecting_pairs(&mesh), [[0_u32; 2]; 0]);
        mesh.triangles = vec![[0, 1, 2], [0, 2, 1]];
        assert_eq!(intersecting_pairs(&mesh), [[0, 1]]);
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        for (seed, range) in [(1, 3), (2, 8), (3, 1000)] {
            let mesh = shapes::soup(seed, 120, range);
            let mut expected = Vec::new();
            for t in 0..120 {
                for s in 0..t {
                    let pair = [mesh.triangles[s as usize], mesh.triangles[t as usize]];
                    let two = TriangleMesh { triangles: pair.to_vec(), ..mesh.clone() };
                    if !intersecting_pairs(&two).is_empty() {
                        expected.push([s, t]);
                    }
                }
            }
            expected.sort_unstable();
            assert!(!expected.is_empty());
            assert_eq!(intersecting_pairs(&mesh), expected, "seed {seed}");
        }
    }

    #[test]
    fn one_triangle_across_everything() {
        let mut mesh = shapes::torus(2.0, 0.5, 64, 32);
        let n = mesh.positions.len() as u32;
        mesh.positions.extend([
            Vec3::splat(-3.0e38),
            Vec3::new(3.0e38, 0.0, 3.0e38),
            Vec3::new(0.0, 3.0e38, 0.0),
        ]);
        mesh.triangles.push([n, n + 1, n + 2]);
        let intersecting = intersecting_pairs(&mesh);
        assert!(!intersecting.is_empty() && intersecting.len() < 1000, "{}", intersecting.len());
        assert!(intersecting.iter().all(|pair| pair[1] == mesh.triangles.len() as u32 - 1));
    }

    #[test]
    fn counting_intersections_ends_where_all_triangles_lie_on_each_other() {
        let count = 3000;
        let mut mesh = corner_tetrahedron();
        mesh.triangles = (0..count).map(|k| mesh.triangles[k % 4]).collect();
        let found = report(&mesh).unwrap();
        assert!(found.has_more && !found.is_healthy());
        assert_eq!(found.self_intersections, 100_000);
        // As many pairs as below the bound are all counted: those of the same triangle, and none of two different ones.
        mesh.triangles.truncate(400);
        let found = report(&mesh).unwrap();
        assert_eq!((found.self_intersections, found.has_more), (4 * 100 * 99 / 2, false));
    }

    /// The boxes of all triangles around a vertex overlap.
    #[test]
    fn a_search_that_is_cut_short_is_said_to_be_also_if_it_found_nothing() {
        let count = 100;
        let around = |k: u32| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(k) / f64::from(count));
            Vec3::new(cosine as f32, sine as f32, 0.0)
        };
        let mesh = TriangleMesh {
            positions: std::iter::once(Vec3::ZERO).chain((0..count).map(around)).collect(),
            triangles: (0..count).map(|k| [0, k + 1, (k + 1) % count + 1]).collect(),
            ..Default::default()
        };
        let pairs = 100 * 99 / 2;
        for (most, is_complete) in
            [([pairs - 1, 0], false), ([pairs, 0], true), ([0, 49], false), ([0, 50], true)]
        {
            let counted = finished(count_within(&mesh, most, &Pauses::default()));
            assert_eq!(counted, CountInTime { found: 0, is_complete }, "{most:?}");
        }
    }
}
