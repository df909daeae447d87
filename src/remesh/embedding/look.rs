//! Where the mesh is in doubt, looked at for crossings and for room to move.

use super::star::{
    crossings_around, crossings_between, divided_between, divided_through, flatness, longest_edge, spread_out,
};
use super::{Embedding, FREEDOM, NEAREST_CORNER, PIERCING};
use crate::math::Bounds;
use crate::mesh::{Mesh, VertexId};
use crate::spatial::{Nearness, Star, near_pairs};

/// What a vertex may move between two looks, its freedom before and its freedom after some other vertex was looked at.
const TWICE: f32 = 2.0;

/// Where at least one vertex of so many is looked across from, the whole mesh is swept. With more, sweeps over what nobody asked
/// for take longer than the search around those that are in doubt; with less, that search does.
const MANY: usize = 8;

/// The pairs of triangles that a vertex is looked at for: both at the vertex; one at a neighbour of it; one at a near
/// vertex that is none.
const AROUND: u8 = 1;
const ALONG: u8 = 2;
const ACROSS: u8 = 4;
pub(super) const ALL: u8 = AROUND | ALONG | ACROSS;

/// Whether a vertex that is no neighbour may be within the contact distance.
const CLOSE: u8 = 8;

/// What is to be thought of a vertex that an edit made or changed.
pub(super) const UNKNOWN: u8 = ALL | CLOSE;

impl Embedding {
    /// Looks at every vertex; see [`Self::look`].
    pub(super) fn look_everywhere(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        self.know(mesh);
        self.doubts.resize(mesh.slots(), 0);
        mesh.vertices().for_each(|v| self.doubt(v, ALL));
        self.look(mesh)
    }

    /// Looks for crossings where there is doubt, and notes where there is room. Returns the corners of all triangles that
    /// cross another, in order.
    pub(super) fn look(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        let doubtful = std::mem::take(&mut self.doubtful);
        let across = doubtful.iter().filter(|v| self.doubts[v.index()] & ACROSS != 0).count();
        let many = MANY * across >= mesh.vertex_count();
        if many {
            self.grid.empty_cells();
        } else {
            self.grid.fill_cells();
        }
        let is_entered = self.entered == Some(mesh.geometry_version());
        for &v in &doubtful {
            let doubts = self.doubts[v.index()];
            if doubts == ALL && !is_entered {
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
        if many {
            self.sweep_across(mesh, &mut crossing);
        } else {
            self.look_across(mesh, &doubtful, &mut crossing);
        }
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

    /// Looks across from all doubtful vertices, in one sweep over the mesh.
    fn sweep_across(&mut self, mesh: &Mesh, crossing: &mut Vec<VertexId>) {
        let nearness = self.nearness();
        let stars = mesh.vertices().map(|v| self.grid.star(v)).collect();
        near_pairs(stars, nearness, |a, b| {
            if (self.doubts[a.vertex.index()] | self.doubts[b.vertex.index()]) & ACROSS != 0 {
                let square = a.position.distance_squared(b.position);
                self.look_at_pair(mesh, [a.vertex, b.vertex], square, nearness, crossing);
            }
        });
    }

    /// Looks across from all doubtful vertices, those of a cell together.
    fn look_across(&mut self, mesh: &Mesh, doubtful: &[VertexId], crossing: &mut Vec<VertexId>) {
        let nearness = self.nearness();
        let in_doubt = doubtful.iter().filter(|v| self.doubts[v.index()] & ACROSS != 0);
        let mut in_doubt: Vec<(u32, VertexId)> = in_doubt.map(|&v| (self.grid.cell_name(v), v)).collect();
        in_doubt.sort_unstable();
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
            if square <= reach * reach && w != v && !self.is_left_to(w, v, ACROSS) {
                self.look_at_pair(mesh, [v, w], square, nearness, crossing);
            }
        }
    }

    /// Looks at two vertices that may be neighbours, and are near each other at this squared distance.
    fn look_at_pair(
        &mut self,
        mesh: &Mesh,
        [v, w]: [VertexId; 2],
        square: f32,
        nearness: Nearness,
        crossing: &mut Vec<VertexId>,
    ) {
        if mesh.ring(v).contains(w) {
            return;
        }
        if square < nearness.least * nearness.least {
            self.tight[v.index()] |= CLOSE;
            self.tight[w.index()] |= CLOSE;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, Vec3};
    use crate::mesh::{crossing_pairs, shapes};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn any(random: &mut Random) -> Vec3 {
        Vec3::new(random.unit() as f32, random.unit() as f32, random.unit() as f32) * 2.0 - 1.0
    }

    fn one_of<const N: usize>(random: &mut Random, values: [f32; N]) -> f32 {
        values[random.below(N as u32) as usize]
    }

    /// A closed part of some size: smooth, rough or crumpled, perhaps flat or with a needle or with vertices on each other.
    fn part(random: &mut Random) -> Mesh {
        let mut mesh = match random.below(8) {
            0 => Mesh::icosphere(Vec3::ZERO, 1.0, 1.0).unwrap(),
            1..4 => Mesh::from_triangles(&shapes::torus(0.7, 0.3, 5, 4)).unwrap(),
            _ => Mesh::icosahedron(Vec3::ZERO, 1.0),
        };
        let rough = one_of(random, [0.0, 1e-6, 0.05, 0.2, 1.0]);
        let squash = Vec3::new(1.0, 1.0, one_of(random, [1.0, 1.0, 1.0, 0.5, 1e-3, 1e-9, 0.0]));
        let size = one_of(random, [1.0, 1.0, 1.0, 0.1, 1e-4, 50.0]);
        let place = any(random) * one_of(random, [0.0, 1.0, 3.0]);
        for p in mesh.positions_mut() {
            *p = (*p + any(random) * rough) * squash * size + place;
        }
        let count = mesh.slots() as u32;
        let [v, w] = [(); 2].map(|()| VertexId(random.below(count)));
        match random.below(6) {
            0 => mesh.set_position(v, mesh.position(w)),
            1 => mesh.set_position(v, any(random) * 5.0),
            2 => mesh.set_position(v, any(random) * 1e4),
            _ => {}
        }
        mesh
    }

    fn crumpled(random: &mut Random) -> Mesh {
        let mut mesh = part(random);
        for _ in 0..random.below(3) {
            mesh.append(&part(random)).unwrap();
        }
        let offset = any(random) * one_of(random, [0.0, 0.0, 10.0, 1e4, 1e7]);
        mesh.positions_mut().iter_mut().for_each(|p| *p += offset);
        mesh
    }

    /// The corners of the triangles that cross, found without any of this.
    fn expected(mesh: &Mesh) -> Vec<VertexId> {
        let triangles = mesh.to_triangles();
        let names: Vec<VertexId> = mesh.vertices().collect();
        let corners = |t: u32| triangles.triangles[t as usize].map(|v| names[v as usize]);
        let mut crossing: Vec<VertexId> =
            crossing_pairs(&triangles).into_iter().flatten().flat_map(corners).collect();
        crossing.sort_unstable();
        crossing.dedup();
        crossing
    }

    #[test]
    fn what_crosses_is_what_crosses_by_all_pairs() {
        let (mut sound, mut crossing) = (0, 0);
        for seed in 0..2000 {
            let random = &mut Random::new(seed);
            let mesh = crumpled(random);
            let mut embedding = Embedding::default();
            embedding.follow_with(&mesh, one_of(random, [1.0, 0.3, 5.0, 1e-3]));
            let found = embedding.look_everywhere(&mesh);
            assert_eq!(found, expected(&mesh), "seed {seed}");
            if found.is_empty() { sound += 1 } else { crossing += 1 }
        }
        assert!(sound > 200 && crossing > 200, "{sound} sound, {crossing} crossing");
    }

    #[test]
    fn a_sweep_and_a_search_around_each_vertex_find_the_same() {
        for seed in 0..1000 {
            let random = &mut Random::new(seed);
            let mesh = crumpled(random);
            let mut embedding = Embedding::default();
            embedding.follow_with(&mesh, one_of(random, [1.0, 0.3, 5.0]));
            let doubtful: Vec<VertexId> = mesh.vertices().filter(|_| random.below(3) > 0).collect();
            embedding.doubts.resize(mesh.slots(), 0);
            doubtful.iter().for_each(|&v| embedding.doubt(v, ALL));
            embedding.tight.fill(0);
            let (mut swept, mut searched) = (embedding.clone(), embedding);
            let [mut by_sweep, mut by_search] = [Vec::new(), Vec::new()];
            swept.sweep_across(&mesh, &mut by_sweep);
            searched.grid.fill_cells();
            searched.look_across(&mesh, &doubtful, &mut by_search);
            for found in [&mut by_sweep, &mut by_search] {
                found.sort_unstable();
                found.dedup();
            }
            assert_eq!(by_sweep, by_search, "seed {seed}");
            assert_eq!(swept.tight, searched.tight, "seed {seed}");
        }
    }
}
