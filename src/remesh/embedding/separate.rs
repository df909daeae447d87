//! Separates sheets that intersect slightly, as left by edits that were tested in one-rings only.

use super::Embedding;
use crate::math::Vec3;
use crate::mesh::{DisjointSets, Mesh, VertexId};
use crate::pauses::Pauses;

/// Displacements along the outward normals that are tried in turn to separate intersecting sheets, relative to the
/// ordinary edge; negative ones are inwards.
const OFFSETS: [f32; 8] = [-0.02, 0.02, -0.06, 0.06, -0.12, 0.12, -0.2, 0.2];

/// Fractions of the displacement to the mean of the neighbours that are tried in turn to retract a spike.
const SHARES: [f32; 2] = [0.5, 1.0];

/// The distance below which two corners of intersecting triangles belong to one cluster, relative to the ordinary edge.
const CLUSTER_DISTANCE: f32 = 1.0;

/// The largest number of corners of intersecting triangles for which [`Embedding::separate`] tries anything: with more,
/// moving a few vertices is no remedy.
const MAX_VERTICES: usize = 4000;

/// The largest number of pairs of vertices in all attempts for one cluster: an attempt tests all pairs, and a cluster of a
/// hundred vertices gets all its thousand attempts.
const MAX_PAIRS: usize = 20_000_000;
/// The number of such pairs whose tests are a unit of work.
const PAIRS_PER_UNIT: usize = 1000;

/// Vertices to be moved, each with its displacement before scaling.
type Moves = Vec<(VertexId, Vec3)>;

impl Embedding {
    /// Moves corners of intersecting triangles slightly until none intersect, one spatial cluster after the other; used
    /// for the start from a contour and for remeshing, after edits that were not fully tested. Returns whether none
    /// intersect afterwards; if some do, other clusters may have been changed. With more than 4000 corners, nothing is
    /// tried. Pauses meanwhile.
    ///
    /// `intersecting` must contain all corners of intersecting triangles, as returned by
    /// [`Self::intersecting_vertices`].
    pub async fn separate(&mut self, mesh: &mut Mesh, intersecting: &[VertexId], pauses: &Pauses) -> bool {
        if intersecting.len() > MAX_VERTICES {
            return false;
        }
        for cluster in clusters(mesh, intersecting, CLUSTER_DISTANCE * self.ordinary_edge) {
            if !self.separate_cluster(mesh, &cluster, pauses).await {
                return false;
            }
        }
        true
    }

    /// Separates one cluster: tries to move all its vertices along their normals, then those of one sheet, then
    /// vertices towards the mean of their neighbours, which retracts a spike that pierces a sheet. Returns whether one
    /// of these succeeded.
    async fn separate_cluster(&mut self, mesh: &mut Mesh, cluster: &[VertexId], pauses: &Pauses) -> bool {
        let normal = |v: VertexId| mesh.unit_normal(v) * self.ordinary_edge;
        let all: Moves = cluster.iter().map(|&v| (v, normal(v))).collect();
        let facing = |displacement: Vec3| -> Moves {
            all.iter().copied().filter(|(_, normal)| normal.dot(displacement) > 0.0).collect()
        };
        let sheets = all.iter().map(|&(_, displacement)| facing(displacement));
        let sheets = std::iter::once(all.clone()).chain(sheets);
        let inwards: Moves = cluster.iter().map(|&v| (v, to_neighbours(mesh, v))).collect();
        let spikes = std::iter::once(inwards.clone()).chain(inwards.iter().map(|&spike| vec![spike]));
        let pairs = cluster.len() * cluster.len();
        let mut attempts = MAX_PAIRS.div_ceil(pairs.max(1));
        let offsets = sheets.map(|moves| (moves, OFFSETS.as_slice()));
        for (moves, shares) in offsets.chain(spikes.map(|moves| (moves, SHARES.as_slice()))) {
            for &share in &shares[..shares.len().min(attempts)] {
                if self.separates(mesh, cluster, &moves, share) {
                    return true;
                }
                pauses.after(pairs / PAIRS_PER_UNIT).await;
            }
            attempts = attempts.saturating_sub(shares.len());
        }
        false
    }

    /// Moves vertices of a cluster by `share` times their displacements, if no triangle of the cluster then intersects
    /// any other; returns whether they were moved.
    fn separates(&mut self, mesh: &mut Mesh, cluster: &[VertexId], moves: &Moves, share: f32) -> bool {
        let triangles = mesh.triangles_at(cluster);
        let edit = |mesh: &mut Mesh| {
            moves
                .iter()
                .for_each(|&(v, displacement)| mesh.set_position(v, mesh.position(v) + displacement * share));
            Ok(())
        };
        self.attempt_with(mesh, edit, |embedding, mesh, _| embedding.changes_intersect(mesh, &triangles))
            .is_ok()
    }
}

/// Returns the vector from `v` to the mean of its neighbours.
fn to_neighbours(mesh: &Mesh, v: VertexId) -> Vec3 {
    let ring = mesh.ring(v).as_slice();
    let sum: Vec3 = ring.iter().map(|&w| mesh.position(w) - mesh.position(v)).sum();
    sum * (1.0 / ring.len() as f32)
}

/// Groups the vertices into clusters: those nearer than `distance`, directly or via others, are together.
fn clusters(mesh: &Mesh, vertices: &[VertexId], distance: f32) -> Vec<Vec<VertexId>> {
    let mut groups = DisjointSets::new(vertices.len());
    for (i, &v) in vertices.iter().enumerate() {
        for (j, &w) in vertices[..i].iter().enumerate() {
            if mesh.position(v).distance_squared(mesh.position(w)) < distance * distance {
                groups.union(i, j);
            }
        }
    }
    let mut clusters = vec![Vec::new(); vertices.len()];
    vertices.iter().enumerate().for_each(|(i, &v)| clusters[groups.find(i)].push(v));
    clusters.retain(|cluster| !cluster.is_empty());
    clusters
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::mesh::{count_self_intersections, shapes};
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// Returns two spheres that overlap by up to about a hundredth of an edge, and a torus inside the first one; a
    /// vertex of the first sphere is displaced inwards as a spike.
    fn overlapping(seed: u64) -> Mesh {
        let mut random = Random::new(seed);
        let overlap = 0.02 * random.unit() as f32;
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 2.0, 0.8).unwrap();
        mesh.append(&Mesh::icosphere(Vec3::new(4.0 - overlap, 0.3, 0.1), 2.0, 0.8).unwrap()).unwrap();
        mesh.append(&Mesh::from_triangles(&shapes::torus(1.0, 0.4, 9, 6)).unwrap()).unwrap();
        let spike = mesh.vertices().find(|&v| mesh.position(v).y < -1.9).unwrap();
        mesh.set_position(spike, mesh.position(spike) * (0.1 + 0.1 * random.unit() as f32));
        mesh
    }

    #[test]
    fn what_intersects_a_little_is_separated_and_nothing_else_moves() {
        let mut count = 0;
        for seed in 0..40 {
            let mut mesh = overlapping(seed);
            let before = mesh.clone();
            let mut embedding = Embedding::default();
            embedding.sync_with_edge(&mesh, 0.9);
            let intersecting = embedding.intersecting_vertices(&mesh);
            let separated = finished(embedding.separate(&mut mesh, &intersecting, &Pauses::default()));
            count += u32::from(separated && !intersecting.is_empty());
            assert_eq!(separated, count_self_intersections(&mesh.to_triangles()) == 0, "seed {seed}");
            assert!(embedding.is_embedded(&mesh) == separated, "seed {seed}");
            for v in mesh.vertices().filter(|v| !intersecting.contains(v)) {
                assert_eq!(mesh.position(v), before.position(v), "seed {seed}");
            }
        }
        assert!(count > 20, "{count} separated");
    }

    /// Time would grow with the cube of the number of vertices.
    #[test]
    fn large_clusters_get_few_attempts() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 2.0, 0.2).unwrap();
        let mut random = Random::new(1);
        let mut shift = || random.unit() as f32;
        mesh.positions_mut().iter_mut().for_each(|p| *p += Vec3::new(shift(), shift(), shift()));
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 1.0);
        let intersecting = embedding.intersecting_vertices(&mesh);
        assert!(intersecting.len() > 500);
        let pauses = Pauses::default();
        assert!(!finished(embedding.separate(&mut mesh, &intersecting, &pauses)));
        let most = (MAX_PAIRS + intersecting.len() * intersecting.len() * OFFSETS.len()) / PAIRS_PER_UNIT;
        assert!((1..=most as u64).contains(&pauses.work()), "{}", pauses.work());
    }

    #[test]
    fn balls_that_share_half_their_volume_are_left_to_others() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 2.0, 0.8).unwrap();
        mesh.append(&Mesh::icosphere(Vec3::X * 1.5, 2.0, 0.8).unwrap()).unwrap();
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 0.9);
        let intersecting = embedding.intersecting_vertices(&mesh);
        let separated = finished(embedding.separate(&mut mesh, &intersecting, &Pauses::default()));
        assert!(!intersecting.is_empty() && !separated);
        assert_eq!(mesh.check(), Ok(()));
    }
}
