//! Vertices moved as far as nothing crosses.

use super::star::{
    crossings_around, crossings_between, divided_between, divided_through, flatness, longest_edge, spread_out,
};
use super::{Embedding, FREEDOM, NEAREST_CORNER, PIERCING};
use crate::math::{Bounds, Vec3};
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{Nearness, Star};

/// A way is halved down to this share; then its vertex is held where it was.
const LEAST_SHARE: f32 = 0.125;

/// What a vertex may move between two looks, its freedom before and its freedom after some other vertex was looked at.
const TWICE: f32 = 2.0;

/// The pairs of triangles that a vertex is looked at for: both at the vertex; one at a neighbour of it; one at a near
/// vertex that is none.
const AROUND: u8 = 1;
const ALONG: u8 = 2;
const ACROSS: u8 = 4;
const ALL: u8 = AROUND | ALONG | ACROSS;

/// Whether a vertex that is no neighbour may be within the contact distance.
const CLOSE: u8 = 8;

/// What is to be thought of a vertex that an edit made or changed.
pub(super) const UNKNOWN: u8 = ALL | CLOSE;

impl Embedding {
    /// Moves every vertex by its way, and those with triangles that would cross by less: by half of it, a quarter, an
    /// eighth, or not at all. `ways`, by slot, becomes what was gone. Returns the vertices that were held back, and their
    /// shares.
    ///
    /// A mesh that did not cross itself does not afterwards: with every vertex held it would be where it was.
    pub fn carry(&mut self, mesh: &mut Mesh, ways: &mut [Vec3]) -> Vec<(VertexId, f32)> {
        self.follow(mesh);
        let from = mesh.positions().to_vec();
        for (p, way) in mesh.positions_mut().iter_mut().zip(&*ways) {
            *p += *way;
        }
        let mut shares = vec![1.0; ways.len()];
        self.doubt_moved(mesh);
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

    /// Doubts the vertices that have used up their freedom, with their neighbours, and what there is no room around.
    fn doubt_moved(&mut self, mesh: &Mesh) {
        self.doubts.resize(mesh.slots(), 0);
        let freedom = FREEDOM * self.edge;
        for v in mesh.vertices() {
            if self.grid.position(v).distance_squared(mesh.position(v)) > freedom * freedom {
                self.doubt_star(mesh, v);
            } else {
                self.doubt(v, self.tight[v.index()] & ALL);
            }
        }
    }

    fn doubt_star(&mut self, mesh: &Mesh, v: VertexId) {
        self.doubt(v, ALL);
        mesh.ring(v).as_slice().iter().for_each(|&w| self.doubt(w, ALL));
    }

    fn doubt(&mut self, v: VertexId, pairs: u8) {
        let doubts = &mut self.doubts[v.index()];
        if *doubts == 0 && pairs != 0 {
            self.doubtful.push(v);
        }
        *doubts |= pairs;
    }

    /// Looks at every vertex; see [`Self::look`].
    pub(super) fn look_everywhere(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        self.follow(mesh);
        self.doubts.resize(mesh.slots(), 0);
        mesh.vertices().for_each(|v| self.doubt(v, ALL));
        self.look(mesh)
    }

    /// Looks for crossings where there is doubt, and notes where there is room. Returns the corners of all triangles that
    /// cross another, in order.
    fn look(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        let doubtful = std::mem::take(&mut self.doubtful);
        for &v in &doubtful {
            let doubts = self.doubts[v.index()];
            if doubts == ALL {
                self.grid.set(v, mesh.position(v), longest_edge(mesh, v));
            }
            let known = if doubts & ACROSS != 0 { doubts | CLOSE } else { doubts };
            self.tight[v.index()] &= !known;
        }
        let mut crossing = Vec::new();
        for &v in &doubtful {
            let doubts = self.doubts[v.index()];
            if doubts & AROUND != 0 {
                self.look_around(mesh, v, &mut crossing);
            }
            if doubts & ALONG != 0 {
                self.look_along(mesh, v, &mut crossing);
            }
        }
        self.look_across(mesh, &doubtful, &mut crossing);
        doubtful.iter().for_each(|v| self.doubts[v.index()] = 0);
        self.doubtful = doubtful;
        self.doubtful.clear();
        crossing.sort_unstable();
        crossing.dedup();
        crossing
    }

    fn look_around(&mut self, mesh: &Mesh, v: VertexId, crossing: &mut Vec<VertexId>) {
        let room = flatness(mesh, v, self.grid.longest(v));
        if !self.settle(room, AROUND, [v, v]) {
            crossings_around(mesh, v, crossing);
        }
    }

    fn look_along(&mut self, mesh: &Mesh, v: VertexId, crossing: &mut Vec<VertexId>) {
        let ring = mesh.ring(v).as_slice();
        let mut right = ring[ring.len() - 1];
        for (k, &w) in ring.iter().enumerate() {
            let left = ring[if k + 1 == ring.len() { 0 } else { k + 1 }];
            if !self.is_left_to(w, v, ALONG) {
                let longest = self.longest_of(v, w);
                let mut room = divided_through(mesh, [v, w], [left, right], longest);
                if !self.suffices(room) {
                    let other = spread_out(mesh, [v, w], [left, right], longest);
                    room = if other > room { other } else { room };
                }
                if !self.settle(room, ALONG, [v, w]) {
                    crossings_between(mesh, [v, w], crossing);
                }
            }
            right = w;
        }
    }

    /// Looks across from all doubtful vertices, those of a cell together.
    fn look_across(&mut self, mesh: &Mesh, doubtful: &[VertexId], crossing: &mut Vec<VertexId>) {
        let in_doubt = doubtful.iter().filter(|v| self.doubts[v.index()] & ACROSS != 0);
        let mut in_doubt: Vec<(u32, VertexId)> = in_doubt.map(|&v| (self.grid.cell_name(v), v)).collect();
        in_doubt.sort_unstable();
        let nearness = self.nearness();
        let mut near = Vec::new();
        for cell in in_doubt.chunk_by(|a, b| a.0 == b.0) {
            let mut bounds = Bounds::EMPTY;
            let mut longest = 0.0f32;
            for &(_, v) in cell {
                bounds = bounds.joined(&Bounds::of(&[mesh.position(v)]));
                longest = longest.max(self.grid.longest(v));
            }
            self.grid.near_stars(&bounds, longest, nearness, &mut near);
            for &(_, v) in cell {
                self.look_across_to(mesh, v, nearness, &near, crossing);
            }
        }
    }

    /// Where a pair can be that crosses or is in contact before one of both has used up its freedom.
    fn nearness(&self) -> Nearness {
        // Positions that are known are one freedom old, longest edges two; then all may change by as much again.
        let freedom = FREEDOM * self.edge;
        Nearness {
            least: NEAREST_CORNER * self.edge + 4.0 * freedom,
            margin: 4.0 * freedom * (1.0 + PIERCING),
            share: PIERCING,
        }
    }

    fn look_across_to(
        &mut self,
        mesh: &Mesh,
        v: VertexId,
        nearness: Nearness,
        near: &[Star],
        crossing: &mut Vec<VertexId>,
    ) {
        let (p, own) = (mesh.position(v), self.grid.longest(v));
        for star in near {
            let square = star.position.distance_squared(p);
            let reach = nearness.between(own, star.longest);
            let w = star.vertex;
            if square > reach * reach || w == v || mesh.ring(v).contains(w) {
                continue;
            }
            if square < nearness.least * nearness.least {
                self.tight[v.index()] |= CLOSE;
                self.tight[w.index()] |= CLOSE;
            }
            if self.is_left_to(w, v, ACROSS) {
                continue;
            }
            let longest = self.longest_of(v, w);
            let room = match common_edge(mesh, v, w) {
                Some(edge) => divided_through(mesh, [v, w], edge, longest),
                None => divided_between(mesh, [v, w], longest),
            };
            if !self.settle(room, ACROSS, [v, w]) {
                crossings_between(mesh, [v, w], crossing);
            }
        }
    }

    /// Notes where two vertices have too little room for their freedom, and says whether there is any.
    fn settle(&mut self, room: f32, pairs: u8, ends: [VertexId; 2]) -> bool {
        if !self.suffices(room) {
            ends.into_iter().for_each(|v| self.tight[v.index()] |= pairs);
        }
        room > 0.0
    }

    /// Whether there is so much room that both vertices may use up their freedom.
    fn suffices(&self, room: f32) -> bool {
        room > TWICE * FREEDOM * self.edge
    }

    /// Whether a pair at `w` and `v` is looked at from `w`, too, and it is the turn of `w`.
    fn is_left_to(&self, w: VertexId, v: VertexId, pairs: u8) -> bool {
        w < v && self.doubts[w.index()] & pairs != 0
    }

    /// Whether [`Self::company`] of `v` may find any.
    pub fn may_have_company(&self, v: VertexId) -> bool {
        self.tight[v.index()] & CLOSE != 0
    }

    /// Calls `found` with every vertex that is no neighbour of `v` and nearer than `distance`, which is at most the contact
    /// distance of the sampling with this ordinary edge; and with its squared distance.
    pub fn company(&self, mesh: &Mesh, v: VertexId, distance: f32, mut found: impl FnMut(VertexId, f32)) {
        if !self.may_have_company(v) {
            return;
        }
        let (p, ring) = (mesh.position(v), mesh.ring(v));
        self.grid.near_point(p, distance, |w| {
            let square = mesh.position(w).distance_squared(p);
            if square < distance * distance && w != v && !ring.contains(w) {
                found(w, square);
            }
        });
    }

    fn longest_of(&self, v: VertexId, w: VertexId) -> f32 {
        let (a, b) = (self.grid.longest(v), self.grid.longest(w));
        if a > b { a } else { b }
    }
}

/// The edge that `v` and `w` are opposite to each other across.
fn common_edge(mesh: &Mesh, v: VertexId, w: VertexId) -> Option<[VertexId; 2]> {
    mesh.ring(v).pairs().find(|&(a, b)| mesh.ring(a).before(b) == Some(w)).map(|(a, b)| [a, b])
}
