//! Moves vertices by their displacements, shortened so that no triangles intersect.

use super::Embedding;
use super::motion_bound::Checks;
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use crate::pauses::{Pauses, finished};
use std::collections::BTreeMap;

/// The factor on the displacement of vertices of intersecting triangles; if triangles still intersect after that, these
/// vertices do not move.
const HELD_BACK: f32 = 0.25;

impl Embedding {
    /// Returns whether the mesh intersects itself after a move; it can only if it did before.
    pub fn still_intersects(&mut self, mesh: &Mesh) -> bool {
        self.stuck && !self.is_embedded(mesh)
    }

    /// Moves all vertices by `displacements`, given by slot, as [`Self::move_some`] does; returns the vertices held
    /// back, with the share of its displacement by which each moved.
    pub fn move_all(&mut self, mesh: &mut Mesh, displacements: &mut [Vec3]) -> Vec<(VertexId, f32)> {
        let all: Vec<VertexId> = mesh.vertices().collect();
        self.move_some(mesh, &all, displacements)
    }

    /// Moves the vertices `moving` by `displacements`, given by slot; those whose triangles would intersect move by a
    /// quarter of it, or not at all. `moving` must be sorted by id. `displacements` is set to the displacements applied.
    /// Returns the vertices that were held back, sorted, and the share of its displacement by which each moved: 1/4 or 0.
    ///
    /// A mesh without self-intersections has none afterwards: in the worst case no vertex moves.
    pub fn move_some(
        &mut self,
        mesh: &mut Mesh,
        moving: &[VertexId],
        displacements: &mut [Vec3],
    ) -> Vec<(VertexId, f32)> {
        finished(self.move_some_in_slices(mesh, moving, displacements, &Pauses::default()))
    }

    /// Does what [`Self::move_some`] does, and pauses meanwhile.
    pub async fn move_some_in_slices(
        &mut self,
        mesh: &mut Mesh,
        moving: &[VertexId],
        displacements: &mut [Vec3],
        pauses: &Pauses,
    ) -> Vec<(VertexId, f32)> {
        self.move_some_unless(mesh, moving, displacements, usize::MAX, pauses).await.unwrap_or_default()
    }

    /// Moves vertices as [`Self::move_some`] does, and pauses meanwhile; returns `None`, with nothing moved, if more than
    /// `most` of them would have to be held back.
    pub async fn move_some_unless(
        &mut self,
        mesh: &mut Mesh,
        moving: &[VertexId],
        displacements: &mut [Vec3],
        most: usize,
        pauses: &Pauses,
    ) -> Option<Vec<(VertexId, f32)>> {
        self.sync_without_cells(mesh);
        let from: Vec<Vec3> = moving.iter().map(|&v| mesh.position(v)).collect();
        let positions = mesh.positions_mut();
        moving.iter().map(|v| v.index()).for_each(|i| positions[i] += displacements[i]);
        self.hold_back(mesh, moving, &from, displacements, most, pauses).await
    }

    /// Moves all vertices to `targets`, given by slot, as [`Self::move_some_unless`] does: those that are not held back are
    /// there exactly.
    pub async fn move_to_unless(
        &mut self,
        mesh: &mut Mesh,
        targets: &[Vec3],
        most: usize,
        pauses: &Pauses,
    ) -> Option<Vec<(VertexId, f32)>> {
        self.sync_without_cells(mesh);
        let moving: Vec<VertexId> = mesh.vertices().collect();
        let from: Vec<Vec3> = moving.iter().map(|&v| mesh.position(v)).collect();
        let mut displacements: Vec<Vec3> =
            targets.iter().zip(mesh.positions()).map(|(target, from)| *target - *from).collect();
        mesh.positions_mut().copy_from_slice(targets);
        self.hold_back(mesh, &moving, &from, &mut displacements, most, pauses).await
    }

    /// Holds back vertices that were moved by `displacements`, as [`Self::move_some_unless`] does.
    async fn hold_back(
        &mut self,
        mesh: &mut Mesh,
        moving: &[VertexId],
        from: &[Vec3],
        displacements: &mut [Vec3],
        most: usize,
        pauses: &Pauses,
    ) -> Option<Vec<(VertexId, f32)>> {
        self.resize_for_checks(mesh);
        self.mark_edited_dirty(mesh);
        self.apply_motion(mesh, moving.iter().copied().zip(from.iter().copied()));
        let mut shares = BTreeMap::new();
        // Ends, since each round shortens the displacement of a vertex, to a quarter and then to 0, and holds those alone
        // that have one.
        loop {
            let intersecting = self.check_dirty_in_slices(mesh, pauses).await;
            let can_be_held = |v: &VertexId| displacements[v.index()] != Vec3::ZERO;
            let held = intersecting.iter().filter(|v| can_be_held(v));
            // Each with its index among the moving ones.
            let held: Vec<(VertexId, usize)> =
                held.filter_map(|&v| Some((v, moving.binary_search(&v).ok()?))).collect();
            self.stuck |= held.len() < intersecting.len();
            if held.is_empty() {
                break;
            }
            if held.len() > most {
                self.move_back(mesh, moving, from, pauses).await;
                return None;
            }
            let before: Vec<Vec3> = held.iter().map(|&(v, _)| mesh.position(v)).collect();
            for (&(v, k), &before) in held.iter().zip(&before) {
                let i = v.index();
                let share = shares.entry(v).or_insert(1.0);
                let factor = if *share == 1.0 { HELD_BACK } else { 0.0 };
                // Not by a product with 0, which is NaN for a displacement that is not finite.
                displacements[i] = if factor == 0.0 { Vec3::ZERO } else { displacements[i] * factor };
                *share *= factor;
                mesh.set_position(v, from[k] + displacements[i]);
                if mesh.position(v) == before {
                    // A displacement lost in rounding uses up no motion bound.
                    self.mark_dirty(v, Checks::ALL);
                }
            }
            self.apply_motion(mesh, held.into_iter().map(|(v, _)| v).zip(before));
        }
        self.version = Some(mesh.geometry_version());
        Some(shares.into_iter().collect())
    }

    async fn move_back(&mut self, mesh: &mut Mesh, moving: &[VertexId], to: &[Vec3], pauses: &Pauses) {
        let from: Vec<Vec3> = moving.iter().map(|&v| mesh.position(v)).collect();
        moving.iter().zip(to).for_each(|(&v, &p)| mesh.set_position(v, p));
        self.apply_motion(mesh, moving.iter().copied().zip(from));
        // Triangles that intersected are tested anew.
        moving.iter().for_each(|&v| self.mark_dirty(v, Checks::ALL));
        self.check_dirty_in_slices(mesh, pauses).await;
        self.version = Some(mesh.geometry_version());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core_tests::common::{assert_at_least, seeds};
    use crate::math::Random;
    use crate::mesh::{TriangleMesh, count_self_intersections, shapes};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// An edit may bring triangles near a vertex that has moved too little itself for a new search for near vertices.
    #[test]
    fn triangles_that_an_edit_puts_near_are_detected() {
        let mut mesh = Mesh::icosahedron(Vec3::ZERO, 1.0);
        let top = mesh.vertices().max_by(|&a, &b| mesh.position(a).z.total_cmp(&mesh.position(b).z)).unwrap();
        let tip = mesh.position(top);
        let small = Mesh::icosahedron(tip + Vec3::Z * 5.0, 0.5);
        let lowest = |mesh: &Mesh| mesh.positions().iter().fold(f32::INFINITY, |low, p| low.min(p.z));
        let down = lowest(&small) - tip.z - 0.02;
        let first = mesh.slots();
        mesh.append(&small).unwrap();
        let mut embedding = Embedding::default();
        embedding.sync_with_edge(&mesh, 1.2);
        // The first move finds nothing near.
        let mut displacements = vec![Vec3::X * 0.02; mesh.slots()];
        assert!(embedding.move_all(&mut mesh, &mut displacements).is_empty());
        let moved: Vec<VertexId> = (first..mesh.slots()).map(VertexId::from_index).collect();
        let edit = |mesh: &mut Mesh| {
            moved.iter().for_each(|&v| mesh.set_position(v, mesh.position(v) - Vec3::Z * down));
            Ok(())
        };
        embedding.attempt(&mut mesh, edit).unwrap();
        let mut displacements = vec![Vec3::ZERO; mesh.slots()];
        displacements[top.index()] = Vec3::Z * 0.03;
        let held = embedding.move_some(&mut mesh, &[top], &mut displacements);
        assert_eq!(count_self_intersections(&mesh.to_triangles()), 0);
        assert_eq!(held.len(), 1);
    }

    /// Motion bounds save tests and change no result: the same vertices are held back as by a check of the whole mesh.
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    #[test]
    fn motion_bounds_change_no_result_of_random_moves() {
        let mut all_held = 0;
        let seeds = seeds(8);
        let least = seeds.end as usize * 33;
        for seed in seeds {
            let random = &mut Random::new(seed);
            let mut mesh = Mesh::from_triangles(&shapes::torus(1.0, 0.4, 9, 6)).unwrap();
            mesh.append(&Mesh::icosphere(Vec3::Z, 0.6, 0.4).unwrap()).unwrap();
            let mut unit = || 2.0 * random.unit() as f32 - 1.0;
            let speed = 0.1 * unit() * unit();
            // Neighbours have similar displacements, each at its own speed; some vertices do not move.
            let swirl = [(); 3].map(|()| Vec3::new(unit(), unit(), unit()));
            let displacements: Vec<Vec3> = (0..mesh.slots())
                .map(|i| {
                    let p = mesh.position(VertexId::from_index(i));
                    let common = Vec3::from(swirl.map(|row| row.dot(p))) - p.normalize_or_zero();
                    let own = Vec3::new(unit(), unit(), unit()) * 0.3;
                    if unit() < 0.0 { Vec3::ZERO } else { (common + own) * speed }
                })
                .collect();
            let mut kept = Embedding::default();
            kept.sync_with_edge(&mesh, 0.9);
            for step in 0..25 {
                let (mut same, mut anew) = (mesh.clone(), Embedding::default());
                anew.sync_with_edge(&same, 0.9);
                let expected = anew.move_all(&mut same, &mut displacements.clone());
                let held = kept.move_all(&mut mesh, &mut displacements.clone());
                assert_eq!(held, expected, "seed {seed}, step {step}");
                assert_eq!(mesh.positions(), same.positions(), "seed {seed}, step {step}");
                all_held += held.len();
            }
            assert_eq!(count_self_intersections(&mesh.to_triangles()), 0, "seed {seed}");
        }
        assert_at_least(least, all_held, "moves held back");
    }

    /// Certificates remain valid after tests of other pairs: a component that tumbles towards another is held back
    /// exactly as by a test of everything.
    #[test]
    fn certificates_change_no_result() {
        let mut all_held = 0;
        for seed in 0..60 {
            let random = &mut Random::new(seed);
            let mut mesh = octahedron(Vec3::ZERO, 1.0);
            mesh.append(&octahedron(Vec3::X * 2.4, 1.0)).unwrap();
            let mut kept = Embedding::default();
            kept.sync_with_edge(&mesh, 1.6);
            let mut any = || Vec3::from([(); 3].map(|()| 2.0 * random.unit() as f32 - 1.0));
            for step in 0..60 {
                let turn = any() * 0.02;
                let displacements: Vec<Vec3> = (0..mesh.slots())
                    .map(|i| {
                        let v = VertexId::from_index(i);
                        let arm = mesh.position(v) - Vec3::X * 2.4;
                        let tumbling = turn.cross(arm) - Vec3::X * 0.012;
                        any() * 0.004 + if i < 6 { Vec3::ZERO } else { tumbling }
                    })
                    .collect();
                let (mut same, mut anew) = (mesh.clone(), Embedding::default());
                anew.sync_with_edge(&same, 1.6);
                let expected = anew.move_all(&mut same, &mut displacements.clone());
                let held = kept.move_all(&mut mesh, &mut displacements.clone());
                assert_eq!(held, expected, "seed {seed}, step {step}");
                all_held += held.len();
            }
        }
        assert!(all_held > 1000, "{all_held} held back");
    }

    fn octahedron(centre: Vec3, radius: f32) -> Mesh {
        let positions =
            [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z].map(|p| centre + p * radius);
        let triangles =
            vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        let positions = positions.to_vec();
        Mesh::from_triangles(&TriangleMesh { positions, triangles, ..TriangleMesh::default() }).unwrap()
    }

    /// Lengths are tried at which squares are rounded to few digits or to 0, or are infinite.
    #[cfg_attr(target_arch = "wasm32", ignore = "slow in wasm: npm run test:all")]
    #[test]
    fn no_triangles_intersect_in_any_unit() {
        for power in (-44..=36).step_by(2) {
            let scale = libm::pow(10.0, f64::from(power)) as f32;
            let mut random = Random::new(5);
            let mut mesh = Mesh::icosahedron(Vec3::ZERO, scale);
            mesh.append(&octahedron(Vec3::X * 2.5 * scale, scale)).unwrap();
            let mut embedding = Embedding::default();
            embedding.sync_with_edge(&mesh, 1.2 * scale);
            let mut held = 0;
            for step in 0..40 {
                let unit = |random: &mut Random| random.unit() as f32 - 0.5;
                let mut displacements = vec![Vec3::ZERO; mesh.slots()];
                for v in mesh.vertices() {
                    let together = Vec3::X * if v.index() < 12 { 0.1 } else { -0.1 };
                    let displacement =
                        together + Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)) * 0.8;
                    displacements[v.index()] = displacement * scale;
                }
                held += embedding.move_all(&mut mesh, &mut displacements).len();
                assert_eq!(count_self_intersections(&mesh.to_triangles()), 0, "10^{power}, step {step}");
            }
            assert!(held > 0, "10^{power}");
        }
    }
}
