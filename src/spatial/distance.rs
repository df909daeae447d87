//! Distances between two surfaces, for comparing meshes.

use super::TriangleTree;
use crate::math::order::{rank_f64, sort_by_rank};
use crate::math::triangle;
use crate::mesh::{MeshError, TriangleMesh};
use crate::pauses::{Pauses, finished};

/// The number of vertices between two counts of the work: one may visit every triangle.
const CHUNK: usize = 8;

/// The number of triangles visited that are a unit of work.
const TESTS_PER_UNIT: usize = 16;

/// Distances between two surfaces, in the length unit of the meshes. All except `per_vertex` are the same, bit for bit,
/// if the surfaces are exchanged.
///
/// One-way distances are measured from the vertices of one mesh to the surface of the other and weighted by a third of
/// the area of the triangles around each vertex. Unused vertices are ignored, except in `per_vertex`. Between vertices,
/// a surface may be further away, by at most an edge length.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceDistance {
    /// The unsigned distance of each vertex of the first mesh from the second surface.
    pub per_vertex: Vec<f64>,
    /// The mean of the distances of the vertices of each mesh from the other surface, weighted by area, then averaged
    /// over the two meshes.
    pub mean: f64,
    /// The root mean square of the distances: their squares are averaged over the vertices of each mesh, weighted by
    /// area, then over the two meshes.
    pub rms: f64,
    /// The 95th percentile of the distances: the larger of those over the vertices of each mesh, weighted by area.
    pub p95: f64,
    /// The Hausdorff distance, evaluated at the vertices: the largest distance of a vertex of either mesh from the
    /// other surface.
    pub hausdorff: f64,
}

/// Measures the distance between two surfaces, from each to the other.
///
/// O(n log n), unless many triangles are equally near: each vertex of a speck at the centre of a sphere visits every
/// triangle.
///
/// # Errors
/// [`MeshError::InvalidArgument`] if either (parameter `mesh` is the first, `other` the second) has no triangle, or if
/// [`TriangleMesh::validate`] fails for it.
pub fn surface_distance(mesh: &TriangleMesh, other: &TriangleMesh) -> Result<SurfaceDistance, MeshError> {
    finished(surface_distance_in_slices(mesh, other, &Pauses::default()))
}

/// Does what [`surface_distance`] does, and pauses meanwhile.
///
/// # Errors
/// As [`surface_distance`].
pub async fn surface_distance_in_slices(
    mesh: &TriangleMesh,
    other: &TriangleMesh,
    pauses: &Pauses,
) -> Result<SurfaceDistance, MeshError> {
    not_empty("mesh", mesh)?;
    not_empty("other", other)?;
    // Compared relative to the origin that is further away: only coarse positions are exact relative to the other.
    let is_first = mesh.origin.length_squared() >= other.origin.length_squared();
    let origin = if is_first { mesh.origin } else { other.origin };
    let [moved, other_moved] =
        [mesh, other].map(|one| (one.origin != origin).then(|| one.relative_to(origin)));
    let (mesh, other) = (moved.as_ref().unwrap_or(mesh), other_moved.as_ref().unwrap_or(other));
    pauses.now().await;
    let per_vertex = one_way(mesh, TriangleTree::in_slices(other, pauses).await?, pauses).await;
    let back = one_way(other, TriangleTree::in_slices(mesh, pauses).await?, pauses).await;
    let [there, back] = [Summary::of(mesh, &per_vertex), Summary::of(other, &back)];
    Ok(SurfaceDistance {
        per_vertex,
        mean: 0.5 * (there.mean + back.mean),
        rms: (0.5 * (there.mean_square + back.mean_square)).sqrt(),
        p95: there.p95.max(back.p95),
        hausdorff: there.largest.max(back.largest),
    })
}

fn not_empty(parameter: &'static str, mesh: &TriangleMesh) -> Result<(), MeshError> {
    if !mesh.triangles.is_empty() {
        return Ok(());
    }
    Err(MeshError::InvalidArgument { parameter, problem: "the mesh has no triangles".into() })
}

async fn one_way(mesh: &TriangleMesh, surface: TriangleTree, pauses: &Pauses) -> Vec<f64> {
    pauses.now().await;
    let mut distances = Vec::with_capacity(mesh.positions.len());
    for some in mesh.positions.chunks(CHUNK) {
        let mut tests = 0;
        // There is a closest point unless `p` is not finite; such a mesh is rejected when its own tree is built.
        let distance = |&p| surface.closest_counting(p, &mut tests).map_or(0.0, |nearest| nearest.distance);
        distances.extend(some.iter().map(distance));
        pauses.after(tests / TESTS_PER_UNIT).await;
    }
    distances
}

/// Statistics of the distances of a mesh's vertices from another surface, weighted by area.
struct Summary {
    mean: f64,
    mean_square: f64,
    p95: f64,
    largest: f64,
}

impl Summary {
    fn of(mesh: &TriangleMesh, distances: &[f64]) -> Self {
        let mut weighted: Vec<(f64, f64)> =
            distances.iter().copied().zip(weights(mesh)).filter_map(|(d, w)| Some((d, w?))).collect();
        sort_by_rank(&mut weighted, |&(_, w)| rank_f64(w));
        sort_by_rank(&mut weighted, |&(d, _)| rank_f64(d));
        let total: f64 = weighted.iter().map(|(_, w)| w).sum();
        let mean_of = |value: fn(f64) -> f64| weighted.iter().map(|&(d, w)| value(d) * (w / total)).sum();
        let largest = weighted.last().map_or(0.0, |&(d, _)| d);
        let mut below = 0.0;
        let reaches = |&&(_, w): &&(f64, f64)| {
            below += w;
            below >= 0.95 * total
        };
        let p95 = weighted.iter().find(reaches).map_or(largest, |&(d, _)| d);
        Self { mean: mean_of(|d| d), mean_square: mean_of(|d| d * d), p95, largest }
    }
}

/// Returns the weight of each vertex in area-weighted statistics: a third of the area of its triangles, `None` if it
/// has no triangle. All weights are equal if the total area is 0.
fn weights(mesh: &TriangleMesh) -> Vec<Option<f64>> {
    let mut weights = vec![None; mesh.positions.len()];
    for (triangle, corners) in mesh.triangles.iter().zip(mesh.corners()) {
        let share = triangle::area(corners) / 3.0;
        triangle.iter().for_each(|&v| *weights[v as usize].get_or_insert(0.0) += share);
    }
    if weights.iter().flatten().all(|&w| w == 0.0) {
        weights.iter_mut().flatten().for_each(|w| *w = 1.0);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec3};
    use crate::mesh::Mesh;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn sphere(radius: f32, edge: f32) -> TriangleMesh {
        Mesh::icosphere(Vec3::ZERO, radius, edge).unwrap().to_triangles()
    }

    /// Returns the unit square from the origin to (1, 1) at height `z`, in two triangles.
    fn square(z: f32) -> TriangleMesh {
        TriangleMesh {
            positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                .map(|[x, y]| Vec3::new(x, y, z))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        }
    }

    fn summaries(d: &SurfaceDistance) -> [f64; 4] {
        [d.mean, d.rms, d.p95, d.hausdorff]
    }

    #[test]
    fn concentric_spheres() {
        let (inner, outer) = (sphere(1.0, 0.1), sphere(1.25, 0.04));
        let there = surface_distance(&inner, &outer).unwrap();
        let back = surface_distance(&outer, &inner).unwrap();
        assert_eq!(summaries(&there), summaries(&back));
        assert_eq!(
            (there.per_vertex.len(), back.per_vertex.len()),
            (inner.positions.len(), outer.positions.len())
        );
        // The triangles are up to h² / 8 inside their sphere, for edges of length h.
        for d in there.per_vertex.iter().chain(&back.per_vertex).chain(&summaries(&there)) {
            assert!((d - 0.25).abs() < 0.1 * 0.1 / 7.0, "{d}");
        }
    }

    #[test]
    fn coarse_positions_do_not_round_those_of_the_other_surface() {
        let fine = TriangleMesh { origin: DVec3::new(5e5, 5.4e6, 200.0), ..sphere(2.0, 0.3) };
        let coarse = fine.relative_to(DVec3::ZERO);
        let there = surface_distance(&coarse, &fine).unwrap();
        assert_eq!(summaries(&there), summaries(&surface_distance(&fine, &coarse).unwrap()));
        // Single precision has steps of half a metre there.
        assert!(there.mean > 0.02 && there.hausdorff > 0.1, "{there:?}");
    }

    #[test]
    fn the_same_surface_is_no_distance_away() {
        let mesh = sphere(1.0, 0.3);
        let finer = TriangleMesh { normals: None, ..mesh.clone() };
        for other in [&mesh, &finer] {
            let found = surface_distance(&mesh, other).unwrap();
            assert_eq!(summaries(&found), [0.0; 4]);
            assert!(found.per_vertex.iter().all(|&d| d == 0.0));
        }
    }

    #[test]
    fn a_shifted_square() {
        let found = surface_distance(&square(0.0), &square(-2.0)).unwrap();
        assert_eq!(found.per_vertex, [2.0; 4]);
        assert_eq!(summaries(&found), [2.0; 4]);
    }

    /// A square is compared with a copy of which one corner is raised. The weight of this corner is a sixth of the area
    /// in the flat square, and slightly more in the bent one.
    #[test]
    fn means_are_by_area_and_both_ways() {
        let mut bent = square(0.0);
        bent.positions[1].z = 1.0;
        let (flat, bent) = (square(0.0), bent);
        let found = surface_distance(&flat, &bent).unwrap();
        let side = 0.5_f64.sqrt();
        // From (1, 0, 1) to the square, and from (1, 0, 0) to the plane through the diagonal.
        let (up, down) = (1.0, side / 1.5_f64.sqrt());
        assert!((found.per_vertex[1] - down).abs() < 1e-7 && found.per_vertex[0] == 0.0);
        let bent_area = 0.5 * 1.5_f64.sqrt() * 2.0_f64.sqrt();
        let share = bent_area / 3.0 / (bent_area + 0.5);
        assert!((found.mean - 0.5 * (down / 6.0 + up * share)).abs() < 1e-7, "{}", found.mean);
        assert!((found.rms - (0.5 * (down * down / 6.0 + up * share)).sqrt()).abs() < 1e-7, "{}", found.rms);
        assert_eq!((found.p95, found.hausdorff), (1.0, 1.0));
    }

    #[test]
    fn the_percentile_leaves_a_twentieth_out() {
        let mesh = sphere(1.0, 0.1);
        let mut dented = mesh.clone();
        // A cap of height h has the fraction h / 2 of the area of a sphere; raised, it also gains a rim.
        let dent = |height: f32| {
            move |p: &mut Vec3| {
                if p.z > 1.0 - 2.0 * height {
                    *p *= 1.1
                }
            }
        };
        dented.positions.iter_mut().for_each(dent(0.02));
        let found = surface_distance(&dented, &mesh).unwrap();
        assert!(found.p95 < 0.06 && found.hausdorff > 0.099, "{:?}", summaries(&found));
        let mut dented = mesh.clone();
        dented.positions.iter_mut().for_each(dent(0.08));
        let found = surface_distance(&dented, &mesh).unwrap();
        assert!(found.p95 > 0.099, "{:?}", summaries(&found));
    }

    #[test]
    fn unused_vertices_have_a_distance_but_no_weight() {
        let mut mesh = square(0.0);
        mesh.positions.push(Vec3::new(0.0, 0.0, 50.0));
        let found = surface_distance(&mesh, &square(0.0)).unwrap();
        assert_eq!((found.per_vertex[4], found.hausdorff), (50.0, 0.0));
    }

    #[test]
    fn surfaces_without_area_count_by_vertex() {
        let flat = |z: f32| TriangleMesh {
            positions: [0.0, 1.0, 2.0].map(|x| Vec3::new(x, 0.0, z)).to_vec(),
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        assert_eq!(summaries(&surface_distance(&flat(0.0), &flat(3.0)).unwrap()), [3.0; 4]);
    }

    #[test]
    fn nothing_to_measure_to() {
        let (empty, some) = (TriangleMesh::default(), square(0.0));
        for (mesh, other, named) in [(&empty, &some, "mesh"), (&some, &empty, "other")] {
            let refusal = surface_distance(mesh, other).unwrap_err();
            assert!(matches!(refusal, MeshError::InvalidArgument { parameter, .. } if parameter == named));
        }
    }
}
