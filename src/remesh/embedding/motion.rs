//! Vertices moved as far as nothing crosses.

use super::look::{ALL, PAIRS, SEARCH};
use super::{Embedding, FREEDOM, SEARCH_FREEDOM};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use std::collections::BTreeMap;

/// A way is halved down to this share; then its vertex is held where it was.
const LEAST_SHARE: f32 = 0.125;

impl Embedding {
    /// As [`Self::carry_some`], of all vertices.
    pub fn carry(&mut self, mesh: &mut Mesh, ways: &mut [Vec3]) -> Vec<(VertexId, f32)> {
        let all: Vec<VertexId> = mesh.vertices().collect();
        self.carry_some(mesh, &all, ways)
    }

    /// Moves some vertices by their ways, and those with triangles that would cross by less: by half of it, a quarter, an
    /// eighth, or not at all. `ways`, by slot, becomes what was gone. Returns the vertices that were held back, in order,
    /// and their shares.
    ///
    /// A mesh that did not cross itself does not afterwards: with every vertex held it would be where it was.
    pub fn carry_some(
        &mut self,
        mesh: &mut Mesh,
        moving: &[VertexId],
        ways: &mut [Vec3],
    ) -> Vec<(VertexId, f32)> {
        self.know(mesh);
        self.from.resize(mesh.slots(), Vec3::ZERO);
        let positions = mesh.positions_mut();
        for i in moving.iter().map(|v| v.index()) {
            self.from[i] = positions[i];
            positions[i] += ways[i];
        }
        let mut shares = BTreeMap::new();
        self.doubt_moved(mesh, moving, ways);
        loop {
            let mut held = self.look(mesh);
            held.retain(|v| ways[v.index()] != Vec3::ZERO);
            if held.is_empty() {
                break;
            }
            for v in held {
                let i = v.index();
                let share = shares.entry(v).or_insert(1.0);
                let less = if *share > LEAST_SHARE { 0.5 } else { 0.0 };
                (*share, ways[i]) = (*share * less, ways[i] * less);
                mesh.set_position(v, self.from[i] + ways[i]);
                self.doubt_star(mesh, v, ALL);
            }
        }
        self.version = Some(mesh.geometry_version());
        shares.into_iter().collect()
    }

    /// Doubts the vertices that have used up their freedom, with their neighbours, what there is no room around where
    /// something goes its way, and what edits changed.
    fn doubt_moved(&mut self, mesh: &Mesh, moving: &[VertexId], ways: &[Vec3]) {
        self.doubts.resize(mesh.slots(), 0);
        let mut fresh = std::mem::take(&mut self.fresh);
        fresh.iter().filter(|v| mesh.is_live(**v)).for_each(|&v| self.doubt_tight(v));
        fresh.clear();
        self.fresh = fresh;
        let [near, far] = [FREEDOM, SEARCH_FREEDOM].map(|freedom| freedom * self.edge * freedom * self.edge);
        for &v in moving.iter().filter(|v| ways[v.index()] != Vec3::ZERO) {
            let p = mesh.position(v);
            if self.grid.position(v).distance_squared(p) > far {
                self.doubt_star(mesh, v, ALL);
            } else if self.seen[v.index()].0.distance_squared(p) > near {
                self.doubt_star(mesh, v, PAIRS);
            } else {
                self.doubt_tight(v);
                mesh.ring(v).as_slice().iter().for_each(|&w| self.doubt_tight(w));
            }
        }
    }

    fn doubt_tight(&mut self, v: VertexId) {
        self.doubt(v, self.tight[v.index()] & ALL);
    }

    fn doubt_star(&mut self, mesh: &Mesh, v: VertexId, what: u8) {
        for &w in mesh.ring(v).as_slice().iter().chain([&v]) {
            // What an edit changed has not searched yet.
            self.doubt(w, what | self.tight[w.index()] & SEARCH);
        }
    }

    pub(super) fn doubt(&mut self, v: VertexId, what: u8) {
        let doubts = &mut self.doubts[v.index()];
        if *doubts == 0 && what != 0 {
            self.doubtful.push(v);
        }
        *doubts |= what;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::count_crossings;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    /// What an edit puts near a vertex that has looked around itself before is seen by that vertex, though it does not move
    /// so far that it would look again.
    #[test]
    fn what_an_edit_puts_near_is_seen() {
        let mut mesh = Mesh::icosahedron(Vec3::ZERO, 1.0);
        let top = mesh.vertices().max_by(|&a, &b| mesh.position(a).z.total_cmp(&mesh.position(b).z)).unwrap();
        let tip = mesh.position(top);
        let small = Mesh::icosahedron(tip + Vec3::Z * 5.0, 0.5);
        let lowest = |mesh: &Mesh| mesh.positions().iter().fold(f32::INFINITY, |low, p| low.min(p.z));
        let down = lowest(&small) - tip.z - 0.02;
        let first = mesh.slots();
        mesh.append(&small).unwrap();
        let mut embedding = Embedding::default();
        embedding.follow_with(&mesh, 1.2);
        // All are looked at, and nothing is near.
        let mut ways = vec![Vec3::X * 0.02; mesh.slots()];
        assert!(embedding.carry(&mut mesh, &mut ways).is_empty());
        let moved: Vec<VertexId> = (first..mesh.slots()).map(VertexId::from_index).collect();
        let edit = |mesh: &mut Mesh| {
            moved.iter().for_each(|&v| mesh.set_position(v, mesh.position(v) - Vec3::Z * down));
            Ok(())
        };
        embedding.attempt(&mut mesh, edit).unwrap();
        let mut ways = vec![Vec3::ZERO; mesh.slots()];
        ways[top.index()] = Vec3::Z * 0.03;
        let held = embedding.carry_some(&mut mesh, &[top], &mut ways);
        assert_eq!(count_crossings(&mesh.to_triangles()), 0);
        assert_eq!(held.len(), 1);
    }
}
