//! Vertices moved as far as nothing crosses.

use super::look::ALL;
use super::{Embedding, FREEDOM};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};

/// A way is halved down to this share; then its vertex is held where it was.
const LEAST_SHARE: f32 = 0.125;

impl Embedding {
    /// Moves every vertex by its way, and those with triangles that would cross by less: by half of it, a quarter, an
    /// eighth, or not at all. `ways`, by slot, becomes what was gone. Returns the vertices that were held back, and their
    /// shares.
    ///
    /// A mesh that did not cross itself does not afterwards: with every vertex held it would be where it was.
    pub fn carry(&mut self, mesh: &mut Mesh, ways: &mut [Vec3]) -> Vec<(VertexId, f32)> {
        self.know(mesh);
        let from = mesh.positions().to_vec();
        for (p, way) in mesh.positions_mut().iter_mut().zip(&*ways) {
            *p += *way;
        }
        let mut shares = vec![1.0; ways.len()];
        self.doubt_moved(mesh, ways);
        loop {
            let mut held = self.look(mesh);
            held.retain(|v| ways[v.index()] != Vec3::ZERO);
            if held.is_empty() {
                break;
            }
            for v in held {
                let i = v.index();
                let share = if shares[i] > LEAST_SHARE { 0.5 } else { 0.0 };
                (shares[i], ways[i]) = (shares[i] * share, ways[i] * share);
                mesh.set_position(v, from[i] + ways[i]);
                self.doubt_star(mesh, v);
            }
        }
        self.version = Some(mesh.geometry_version());
        let held = |(i, share)| (share < 1.0).then(|| (VertexId::from_index(i), share));
        shares.into_iter().enumerate().filter_map(held).collect()
    }

    /// Doubts the vertices that have used up their freedom, with their neighbours, and what there is no room around where
    /// something goes its way.
    fn doubt_moved(&mut self, mesh: &Mesh, ways: &[Vec3]) {
        self.doubts.resize(mesh.slots(), 0);
        let freedom = FREEDOM * self.edge;
        let goes = |v: VertexId| ways[v.index()] != Vec3::ZERO;
        for v in mesh.vertices() {
            let tight = self.tight[v.index()] & ALL;
            if self.grid.position(v).distance_squared(mesh.position(v)) > freedom * freedom {
                self.doubt_star(mesh, v);
            } else if tight != 0 && (goes(v) || mesh.ring(v).as_slice().iter().any(|&w| goes(w))) {
                self.doubt(v, tight);
            }
        }
    }

    fn doubt_star(&mut self, mesh: &Mesh, v: VertexId) {
        self.doubt(v, ALL);
        mesh.ring(v).as_slice().iter().for_each(|&w| self.doubt(w, ALL));
    }

    pub(super) fn doubt(&mut self, v: VertexId, pairs: u8) {
        let doubts = &mut self.doubts[v.index()];
        if *doubts == 0 && pairs != 0 {
            self.doubtful.push(v);
        }
        *doubts |= pairs;
    }
}
