//! Where the mesh is in doubt, looked at for crossings and for room to move.

use super::Embedding;
use super::clearance::{clear_around, clear_between};
use super::room::{Concern, Concerns};
use super::star::{
    crossings_around, crossings_between, divided_as_sheets, divided_at, divided_between, divided_through,
    flatness, higher, spread_out,
};
use crate::mesh::{Mesh, VertexId};

/// With less room than this, in the ordinary edge, a better plane is looked for.
const ENOUGH: f32 = 0.03;

/// Concerns with pairs of triangles.
const PAIRS: [Concern; 2] = [Concern::AtHand, Concern::Across];

impl Embedding {
    /// Looks at every vertex; see [`Self::look`].
    pub(super) fn look_everywhere(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        self.know(mesh);
        self.doubts.resize(mesh.slots(), Concerns::default());
        mesh.vertices().for_each(|v| self.doubt(v, Concerns::ALL));
        self.look(mesh)
    }

    /// Looks for crossings where there is doubt, and notes where there is room. Returns the corners of all triangles that
    /// cross another, in order.
    pub(super) fn look(&mut self, mesh: &Mesh) -> Vec<VertexId> {
        let doubtful = std::mem::take(&mut self.doubtful);
        self.find_near(mesh, &doubtful);
        for (&v, concern) in doubtful.iter().flat_map(|v| PAIRS.map(|concern| (v, concern))) {
            if self.doubts[v.index()].has(concern) {
                self.room[v.index()].set(concern, f32::INFINITY);
            }
        }
        let mut crossing = Vec::new();
        for &v in &doubtful {
            let doubts = self.doubts[v.index()];
            if doubts.has(Concern::AtHand) {
                self.look_around(mesh, v, &mut crossing);
                self.look_along(mesh, v, &mut crossing);
            }
            if doubts.has(Concern::Across) {
                self.look_across(mesh, v, &mut crossing);
            }
        }
        doubtful.iter().for_each(|v| self.doubts[v.index()] = Concerns::default());
        self.doubtful = doubtful;
        self.doubtful.clear();
        crossing.sort_unstable();
        crossing.dedup();
        crossing
    }

    fn look_around(&mut self, mesh: &Mesh, v: VertexId, crossing: &mut Vec<VertexId>) {
        let longest = self.longest[v.index()];
        let mut room = flatness(mesh, v, longest);
        if !self.suffices(room) {
            room = higher(room, clear_around(mesh, v, longest));
        }
        if !self.settle(room, Concern::AtHand, [v, v]) {
            crossings_around(mesh, v, self.output.as_ref(), crossing);
        }
    }

    fn look_along(&mut self, mesh: &Mesh, v: VertexId, crossing: &mut Vec<VertexId>) {
        let ring = mesh.ring(v).as_slice();
        let mut right = ring[ring.len() - 1];
        for (k, &w) in ring.iter().enumerate() {
            let left = ring[if k + 1 == ring.len() { 0 } else { k + 1 }];
            if !self.is_left_to(w, v, Concern::AtHand) {
                let longest = self.longest_of(v, w);
                let mut room = divided_through(mesh, [v, w], [left, right], longest);
                if !self.suffices(room) {
                    room = higher(room, spread_out(mesh, [v, w], [left, right], longest));
                }
                let room = self.or_clearance(mesh, [v, w], room);
                if !self.settle(room, Concern::AtHand, [v, w]) {
                    crossings_between(mesh, [v, w], self.output.as_ref(), crossing);
                }
            }
            right = w;
        }
    }

    fn look_across(&mut self, mesh: &Mesh, v: VertexId, crossing: &mut Vec<VertexId>) {
        for k in 0..self.near[v.index()].len() {
            let w = self.near[v.index()][k];
            // Since they were found to be near, edits may have changed the one or the other.
            if self.is_left_to(w, v, Concern::Across)
                || !mesh.is_live(w)
                || w == v
                || mesh.ring(v).contains(w)
            {
                continue;
            }
            let room = self.or_clearance(mesh, [v, w], self.room_across(mesh, [v, w]));
            if !self.settle(room, Concern::Across, [v, w]) {
                crossings_between(mesh, [v, w], self.output.as_ref(), crossing);
            }
        }
    }

    /// By how much the vertices around two that are no neighbours may move; not positive where it must be worked out.
    fn room_across(&self, mesh: &Mesh, [v, w]: [VertexId; 2]) -> f32 {
        let longest = self.longest_of(v, w);
        if let Some(edge) = common_edge(mesh, v, w) {
            return divided_through(mesh, [v, w], edge, longest);
        }
        match *mesh.common_neighbours(v, w) {
            [] => {
                let room = divided_between(mesh, [v, w], longest);
                if self.suffices(room) {
                    room
                } else {
                    higher(room, divided_as_sheets(mesh, [v, w], longest))
                }
            }
            [c] => divided_at(mesh, [v, w], c, longest),
            [c, d] => divided_through(mesh, [v, w], [c, d], longest),
            _ => 0.0,
        }
    }

    /// The motion bound that planes between two stars give or, where that is small, the one between their triangles.
    fn or_clearance(&self, mesh: &Mesh, [v, w]: [VertexId; 2], room: f32) -> f32 {
        if self.suffices(room) {
            return room;
        }
        higher(room, clear_between(mesh, [v, w], self.longest_of(v, w), ENOUGH * self.edge))
    }

    /// Notes how much room two vertices have for each other, and says whether there is any.
    fn settle(&mut self, room: f32, concern: Concern, ends: [VertexId; 2]) -> bool {
        let is_room = room > self.finest();
        let room = if is_room { room } else { 0.0 };
        ends.into_iter().for_each(|v| self.room[v.index()].bound(concern, room));
        is_room
    }

    fn suffices(&self, room: f32) -> bool {
        room > ENOUGH * self.edge
    }

    /// Whether a pair at `w` and `v` is looked at from `w`, too, and it is the turn of `w`.
    pub(super) fn is_left_to(&self, w: VertexId, v: VertexId, concern: Concern) -> bool {
        w < v && self.doubts[w.index()].has(concern)
    }

    fn longest_of(&self, v: VertexId, w: VertexId) -> f32 {
        let (a, b) = (self.longest[v.index()], self.longest[w.index()]);
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
            embedding.doubts.resize(mesh.slots(), Concerns::default());
            doubtful.iter().for_each(|&v| embedding.doubt(v, Concerns::ALL));
            embedding.close.fill(false);
            let (mut swept, mut searched) = (embedding.clone(), embedding);
            swept.sweep(&mesh);
            searched.grid.fill_cells();
            searched.search(&mesh, &doubtful);
            for v in mesh.vertices() {
                [&mut swept, &mut searched].into_iter().for_each(|e| e.near[v.index()].sort_unstable());
            }
            assert_eq!(swept.near, searched.near, "seed {seed}");
            assert_eq!(swept.close, searched.close, "seed {seed}");
        }
    }
}
