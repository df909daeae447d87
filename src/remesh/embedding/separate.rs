//! Separates sheets that intersect slightly, as left by edits that were tested in one-rings only.

use super::Embedding;
use crate::math::Vec3;
use crate::mesh::{DisjointSets, Mesh, VertexId};

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

/// Vertices to be moved, each with its displacement before scaling.
type Moves = Vec<(VertexId, Vec3)>;

impl Embedding {
    /// Moves corners of intersecting triangles slightly until none intersect, one spatial cluster after the other; used
    /// for the start from a contour and for remeshing, after edits that were not fully tested. Returns whether none
    /// intersect afterwards; if some do, other clusters may have been changed. With more than 4000 corners, nothing is
    /// tried.
    ///
    /// `intersecting` must contain all corners of intersecting triangles, as returned by
    /// [`Self::intersecting_vertices`].
    pub fn separate(&mut self, mesh: &mut Mesh, intersecting: &[VertexId]) -> bool {
        intersecting.len() <= MAX_VERTICES
            && clusters(mesh, intersecting, CLUSTER_DISTANCE * self.ordinary_edge)
                .iter()
                .all(|cluster| self.separate_cluster(mesh, cluster))
    }

    /// Separates one cluster: tries to move all its vertices along their normals, then those of one sheet, then
    /// vertices towards the mean of their neighbours, which retracts a spike that pierces a sheet. Returns whether one
    /// of these succeeded.
    fn separate_cluster(&mut self, mesh: &mut Mesh, cluster: &[VertexId]) -> bool {
        let normal = |v: VertexId| mesh.unit_normal(v) * self.ordinary_edge;
        let all: Moves = cluster.iter().map(|&v| (v, normal(v))).collect();
        let facing = |displacement: Vec3| -> Moves {
            all.iter().copied().filter(|(_, normal)| normal.dot(displacement) > 0.0).collect()
        };
        let mut sheets = vec![all.clone()];
        sheets.extend(all.iter().map(|&(_, displacement)| facing(displacement)));
        let inwards: Moves = cluster.iter().map(|&v| (v, to_neighbours(mesh, v))).collect();
        let mut spikes: Vec<Moves> = vec![inwards.clone()];
        spikes.extend(inwards.into_iter().map(|spike| vec![spike]));
        let mut any_moves = |moves: &[Moves], shares: &[f32]| {
            moves.iter().any(|moves| shares.iter().any(|&share| self.separates(mesh, cluster, moves, share)))
        };
        any_moves(&sheets, &OFFSETS) || any_moves(&spikes, &SHARES)
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
            let separated = embedding.separate(&mut mesh, &intersecting);
            count += u32::from(separated && !intersecting.is_empty());
            assert_eq!(separated, count_self_intersections(&mesh.to_triangles()) == 0, "seed {seed}");
            assert!(embedding.is_embedded(&mesh) == separated, "seed {seed}");
            for v in mesh.vertices().filter(|v| !intersecting.contains(v)) {
                assert_eq!(mesh.position(v), before.position(v), "seed {seed}");
            }
        }
        assert!(count > 20, "{count} separated");
    }

    #[test]
    fn balls_that_share_half_their_volume_are_left_to_others() {
        let mut mesh = Mesh::icosphere(Vec3::ZERO, 2.0, 0.8).unwrap();
        mesh.append(&Mesh::icosphere(Vec3::X * 1.5, 2.0, 0.8).unwrap()).unwrap();
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 0.9);
        let intersecting = embedding.intersecting_vertices(&mesh);
        assert!(!intersecting.is_empty() && !embedding.separate(&mut mesh, &intersecting));
        assert_eq!(mesh.check(), Ok(()));
    }
}
