//! Simplification of a closed surface by vertex clustering (Rossignac & Borrel, *Multi-resolution 3D approximations for
//! rendering complex scenes*, 1993), here with the topology preserved.

use crate::math::triangle::area_vector;
use crate::math::{IVec3, Vec3};
use crate::mesh::{DisjointSets, TriangleMesh};
use crate::pauses::Pauses;

/// The cosine of the largest angle by which a triangle may turn when vertices are merged, 60°.
const LARGEST_TURN: f64 = 0.5;

/// The number of triangles that each pass reads in a unit of work.
const TRIANGLES_PER_UNIT: usize = 64;

/// The smallest number of triangles at a vertex of the simplified surface; with fewer it would not be a closed mesh.
const MIN_VALENCE: u32 = 3;

/// Returns a closed surface simplified by vertex clustering; used to thin out the iso-surface from which a deformable
/// model starts. Vertices that are connected by edges within one cell, as returned by `cell` for each position, form a
/// cluster and are merged at their mean. A cluster is merged only if this neither changes the topology nor turns a
/// triangle by more than 60°, and if each of its vertices is within `furthest` of the mean, measured along the normal
/// of the vertex. The result has positions and triangles, but no attributes.
pub async fn clustered(
    mesh: &TriangleMesh,
    furthest: f32,
    cell: impl Fn(Vec3) -> IVec3,
    pauses: &Pauses,
) -> TriangleMesh {
    let pass = mesh.triangles.len() / TRIANGLES_PER_UNIT;
    let mut clusters = Clusters::new(mesh, cell);
    pauses.after(pass).await;
    clusters.keep_contractible(mesh);
    pauses.after(pass).await;
    clusters.dissolve_bent(mesh, furthest);
    loop {
        pauses.after(pass).await;
        let merged = clusters.merge(mesh);
        pauses.after(pass).await;
        let mut is_wrong = not_manifold(&merged);
        pauses.after(pass).await;
        clusters.mark_turned(mesh, &merged, &mut is_wrong);
        let has_changed = clusters.dissolve(|c| is_wrong[c as usize]);
        pauses.after(pass).await;
        if !has_changed {
            return merged.components_where(|_| true);
        }
    }
}

/// A partition of the vertices of a mesh into connected clusters, each of which is to be merged into one vertex.
struct Clusters {
    /// For each vertex, the lowest vertex of its cluster, which identifies the cluster.
    first: Vec<u32>,
}

impl Clusters {
    fn new(mesh: &TriangleMesh, cell: impl Fn(Vec3) -> IVec3) -> Self {
        let cells: Vec<IVec3> = mesh.positions.iter().map(|&p| cell(p)).collect();
        let mut groups = DisjointSets::new(cells.len());
        for [u, v] in edges(mesh) {
            if cells[u] == cells[v] {
                groups.union(u, v);
            }
        }
        Self { first: (0..cells.len()).map(|v| groups.find(v) as u32).collect() }
    }

    /// Dissolves, into single vertices, clusters with a vertex further than `furthest` from the mean of its cluster,
    /// measured along the vertex normal, so that bends and thin parts are kept.
    fn dissolve_bent(&mut self, mesh: &TriangleMesh, furthest: f32) {
        let means = self.means(mesh);
        let normals = mesh.vertex_normals();
        let mut is_bent = vec![false; self.first.len()];
        for ((p, n), &c) in mesh.positions.iter().zip(&normals).zip(&self.first) {
            is_bent[c as usize] |= (means[c as usize] - *p).dot(*n).abs() > furthest;
        }
        self.dissolve(|c| is_bent[c as usize]);
    }

    fn of(&self, vertices: [u32; 3]) -> [u32; 3] {
        vertices.map(|v| self.first[v as usize])
    }

    /// Dissolves, into single vertices, clusters whose Euler characteristic is not 1: those with a loop, and whole
    /// components. Merging any other cluster does not change the topology.
    fn keep_contractible(&mut self, mesh: &TriangleMesh) {
        let mut euler = vec![0; self.first.len()];
        self.first.iter().for_each(|&c| euler[c as usize] += 1);
        for [u, v] in edges(mesh) {
            euler[self.first[u] as usize] -= i32::from(self.first[u] == self.first[v]);
        }
        for [a, b, c] in mesh.triangles.iter().map(|&t| self.of(t)) {
            euler[a as usize] += i32::from(a == b && b == c);
        }
        self.dissolve(|c| euler[c as usize] != 1);
    }

    /// Dissolves into single vertices the clusters for which `dissolves` is true, identified by their lowest vertex;
    /// returns whether the partition has changed.
    fn dissolve(&mut self, dissolves: impl Fn(u32) -> bool) -> bool {
        let mut any = false;
        for (v, c) in (0u32..).zip(&mut self.first).filter(|(v, c)| v != *c && dissolves(**c)) {
            *c = v;
            any = true;
        }
        any
    }

    /// Returns the mean position of the vertices of each cluster, at the index of its lowest vertex.
    fn means(&self, mesh: &TriangleMesh) -> Vec<Vec3> {
        let mut means = vec![Vec3::ZERO; mesh.positions.len()];
        let mut members = vec![0u32; mesh.positions.len()];
        for (&p, &c) in mesh.positions.iter().zip(&self.first) {
            means[c as usize] += p;
            members[c as usize] += 1;
        }
        means.iter_mut().zip(&members).filter(|(_, n)| **n > 0).for_each(|(p, &n)| *p /= n as f32);
        means
    }

    fn merge(&self, mesh: &TriangleMesh) -> TriangleMesh {
        let triangles = mesh.triangles.iter().map(|&t| self.of(t)).filter(is_triangle).collect();
        TriangleMesh {
            positions: self.means(mesh),
            origin: mesh.origin,
            triangles,
            ..TriangleMesh::default()
        }
    }

    /// Marks in `is_wrong` the corners of triangles of the result `merged` that are turned by more than 60° against those of
    /// `mesh`.
    fn mark_turned(&self, mesh: &TriangleMesh, merged: &TriangleMesh, is_wrong: &mut [bool]) {
        for &triangle in &mesh.triangles {
            let corners = self.of(triangle);
            if !is_triangle(&corners) {
                continue;
            }
            let before = area_vector(triangle.map(|v| mesh.positions[v as usize]));
            let after = area_vector(corners.map(|v| merged.positions[v as usize]));
            if before.dot(after) < LARGEST_TURN * before.length() * after.length() {
                corners.iter().for_each(|&v| is_wrong[v as usize] = true);
            }
        }
    }
}

/// Returns whether each vertex is one of fewer than three triangles, or at an edge of more than two.
fn not_manifold(mesh: &TriangleMesh) -> Vec<bool> {
    let valences = valences(mesh);
    let mut is_wrong: Vec<_> = valences.iter().map(|&valence| valence < MIN_VALENCE).collect();
    for corner in doubled_edges(mesh, &valences).into_iter().flatten() {
        is_wrong[corner as usize] = true;
    }
    is_wrong
}

fn is_triangle([a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Returns the number of triangles at each vertex.
fn valences(mesh: &TriangleMesh) -> Vec<u32> {
    let mut valences = vec![0; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|&v| valences[v as usize] += 1);
    valences
}

fn directed_edges(mesh: &TriangleMesh) -> impl Iterator<Item = [u32; 2]> + '_ {
    mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
}

/// Returns the edges of a closed surface, each once.
fn edges(mesh: &TriangleMesh) -> impl Iterator<Item = [usize; 2]> + '_ {
    directed_edges(mesh).filter(|[u, v]| u < v).map(|edge| edge.map(|v| v as usize))
}

/// Returns the edges that several triangles contain in the same direction, at which the surface is not a manifold;
/// `valences` are the numbers of triangles at the vertices.
fn doubled_edges(mesh: &TriangleMesh, valences: &[u32]) -> Vec<[u32; 2]> {
    let mut ends = vec![0u32; directed_edges(mesh).count()];
    // Ends of the edges from each vertex, in one range of `ends` each.
    let mut filled: Vec<u32> = Vec::with_capacity(valences.len());
    let mut begin = 0;
    for valence in valences {
        filled.push(begin);
        begin += valence;
    }
    let mut doubled = Vec::new();
    let begins = filled.clone();
    for [u, v] in directed_edges(mesh) {
        let (begin, end) = (begins[u as usize] as usize, filled[u as usize] as usize);
        if ends[begin..end].contains(&v) {
            doubled.push([u, v]);
        }
        ends[end] = v;
        filled[u as usize] += 1;
    }
    doubled
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::pauses::finished;
    use crate::volume::{Grid, marching_cubes};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn whole(p: Vec3) -> IVec3 {
        p.round().as_ivec3()
    }

    /// Returns the iso-surface at 0 of `depth`, sampled on a grid of 24³ voxels around the origin.
    fn contour(depth: impl Fn(Vec3) -> f32) -> TriangleMesh {
        let n = 24;
        let at = |k: usize| Vec3::new((k % n) as f32, (k / n % n) as f32, (k / n / n) as f32) - 11.5;
        let values = (0..n * n * n).map(|k| depth(at(k))).collect();
        marching_cubes(&Grid { dims: [n; 3], values }, 0.0).unwrap()
    }

    fn valid_mesh(mesh: &TriangleMesh) -> Mesh {
        let mesh = Mesh::from_triangles(mesh).unwrap();
        assert_eq!(mesh.check(), Ok(()));
        mesh
    }

    fn thinned(mesh: &TriangleMesh, furthest: f32, cell: impl Fn(Vec3) -> IVec3) -> TriangleMesh {
        finished(clustered(mesh, furthest, cell, &Pauses::default()))
    }

    #[test]
    fn a_torus_keeps_its_handle_and_a_quarter_of_its_vertices_go() {
        let torus = contour(|p| 2.5 - Vec3::new(p.truncate().length() - 6.5, p.z, 0.0).length());
        let merged = thinned(&torus, f32::INFINITY, whole);
        assert_eq!(valid_mesh(&merged).euler(), 0);
        let [before, after] = [&torus, &merged].map(|mesh| mesh.positions.len());
        assert!(4 * after < 3 * before, "{after} of {before}");
        let length = |p: &Vec3| Vec3::new(p.truncate().length() - 6.5, p.z, 0.0).length();
        for p in merged.positions.iter().map(|p| *p - 11.5) {
            assert!((length(&p) - 2.5).abs() < 0.3, "{p} is off the torus");
        }
    }

    #[test]
    fn what_bends_within_a_cell_stays() {
        let off_axis = |p: Vec3| Vec3::new(p.y - 0.5, p.z - 0.5, 0.0).length();
        let tube = contour(|p| (1.3 - off_axis(p)).min(8.0 - p.x.abs()));
        let [near, rough] = [0.03, f32::INFINITY].map(|furthest| thinned(&tube, furthest, whole));
        let thinnest = |mesh: &TriangleMesh| {
            let inner = mesh.positions.iter().map(|p| *p - 11.5).filter(|p| p.x.abs() < 7.0);
            inner.map(off_axis).fold(f32::INFINITY, f32::min)
        };
        assert!(thinnest(&near) > thinnest(&tube) - 0.04, "{} of {}", thinnest(&near), thinnest(&tube));
        assert!(near.positions.len() > rough.positions.len());
    }

    /// Cells of a noisy shape contain tubes, both sides of thin walls, and whole components, none of which may be
    /// merged away.
    #[test]
    fn noise_keeps_its_components_and_handles() {
        for seed in 0..40 {
            let random = std::cell::RefCell::new(crate::math::Random::new(seed));
            let noisy = contour(|p| 8.0 - p.length() + 6.0 * (random.borrow_mut().unit() as f32 - 0.5));
            let merged = thinned(&noisy, f32::INFINITY, whole);
            let (before, after) = (valid_mesh(&noisy), valid_mesh(&merged));
            assert_eq!(after.euler(), before.euler(), "seed {seed}");
            assert_eq!(after.component_count(), before.component_count(), "seed {seed}");
            assert!(after.vertex_count() < before.vertex_count());
        }
    }

    #[test]
    fn nothing_is_left_of_nothing_and_large_cells_leave_closed_surfaces() {
        assert!(thinned(&TriangleMesh::default(), f32::INFINITY, whole).triangles.is_empty());
        let ball = contour(|p| 8.0 - p.length());
        let merged = thinned(&ball, f32::INFINITY, |p| (p / 8.0).round().as_ivec3());
        assert_eq!(valid_mesh(&merged).euler(), 2);
    }
}
