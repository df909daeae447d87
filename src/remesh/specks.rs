//! Small parts that vanish: specks without volume, parts crushed, parts turned inside out.

use super::{Resolver, Sampling, TopologyGuide};
use crate::mesh::{Mesh, VertexId};

/// Components of more vertices are never removed, whatever their volume: a cavity has a negative one.
const LARGEST_SPECK: usize = 32;

/// The volume in δ³ of an icosahedron with edges of δ: the smallest ball that is no speck.
const SMALLEST_BALL: f32 = 2.18;

/// The components of a mesh that are small enough to vanish.
#[derive(Clone, Debug, Default)]
pub(super) struct SmallParts {
    /// A vertex of each, and whether it is solid: its volume is positive.
    parts: Vec<(VertexId, bool)>,
    /// Of the mesh these are the parts of.
    topology_version: Option<u32>,
}

impl SmallParts {
    /// Finds the small parts of the mesh as it is, unless they are known.
    pub(super) fn find(&mut self, mesh: &Mesh) {
        if self.topology_version != Some(mesh.topology_version()) {
            self.find_among(mesh, mesh.vertices());
        }
    }

    /// Finds the small parts again where nothing but the parts of `edited` has changed.
    fn find_again(&mut self, mesh: &Mesh, edited: &[VertexId]) {
        let known = std::mem::take(&mut self.parts);
        let members = known.into_iter().map(|(v, _)| v).chain(edited.iter().copied());
        self.find_among(mesh, members.filter(|&v| mesh.is_live(v)));
    }

    fn find_among(&mut self, mesh: &Mesh, vertices: impl Iterator<Item = VertexId>) {
        self.parts.clear();
        let mut seen = vec![false; mesh.slots()];
        for v in vertices {
            if seen[v.index()] {
                continue;
            }
            // Where this is not all of a component, it is still a piece of a large one.
            let found = mesh.component_of(v, LARGEST_SPECK + 1);
            found.iter().for_each(|w| seen[w.index()] = true);
            if found.len() <= LARGEST_SPECK {
                self.parts.push((v, volume(mesh, &found) > 0.0));
            }
        }
        self.topology_version = Some(mesh.topology_version());
    }
}

impl Resolver {
    /// Removes the component of `v` where it is a speck, and says whether it is gone.
    ///
    /// It may be gone already: the two sides of a cut handle are one component.
    ///
    /// A speck has at most 32 vertices and less than δ³ of volume. Those of negative volume would grow in empty space, unless
    /// `guide` knows of a hollow there.
    pub(super) fn remove_speck(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        v: VertexId,
    ) -> bool {
        if !mesh.is_live(v) {
            return true;
        }
        let members = mesh.component_of(v, LARGEST_SPECK + 1);
        if members.len() > LARGEST_SPECK {
            return false;
        }
        let (volume, least) = (volume(mesh, &members), sampling.smallest_volume());
        if volume >= least || volume <= -least && guide.is_hollow(mesh, &members) {
            return false;
        }
        self.remove_part(mesh, v);
        true
    }

    /// Removes small components that cannot go on as they are after the vertices were moved.
    ///
    /// Where two sides are pressed on each other, vertices are held, no edge gets short, and a part would stay for ever:
    /// so those go that are flat, or of which no vertex could move. And a part so small may turn inside out between two
    /// states of which neither crosses itself, as when the tip of a tetrahedron passes through its base.
    pub(super) fn remove_crushed(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
        stuck: &[VertexId],
    ) {
        self.small.find(mesh);
        let is_stuck = |v: &VertexId| stuck.binary_search(v).is_ok();
        for (v, was_solid) in std::mem::take(&mut self.small.parts) {
            let members = mesh.component_of(v, LARGEST_SPECK + 1);
            let volume = volume(mesh, &members);
            let is_flat =
                || kept_volume(mesh, &members, volume, guide) < SMALLEST_BALL * sampling.smallest_volume();
            let is_crushed = members.iter().any(is_stuck) && (is_flat() || members.iter().all(is_stuck));
            if is_crushed || (volume > 0.0) != was_solid {
                self.remove_part(mesh, v);
            } else {
                self.small.parts.push((v, was_solid));
            }
        }
    }

    /// Notes which parts are small after the edits of a call. Cavities smaller than any ball are removed: such a one may
    /// be a part that an edit turned inside out, and would grow in empty space.
    pub(super) fn note_small_parts(
        &mut self,
        mesh: &mut Mesh,
        sampling: Sampling,
        guide: &dyn TopologyGuide,
    ) {
        self.small.find_again(mesh, &self.edited);
        let least = SMALLEST_BALL * sampling.smallest_volume();
        for (v, is_solid) in std::mem::take(&mut self.small.parts) {
            let is_left = || {
                let members = mesh.component_of(v, LARGEST_SPECK);
                let volume = volume(mesh, &members);
                volume <= -least || kept_volume(mesh, &members, volume, guide) >= sampling.smallest_volume()
            };
            if !is_solid && !is_left() {
                self.remove_part(mesh, v);
            } else {
                self.small.parts.push((v, is_solid));
            }
        }
        self.small.topology_version = Some(mesh.topology_version());
    }

    /// Removes the component of `v`.
    pub(super) fn remove_part(&mut self, mesh: &mut Mesh, v: VertexId) {
        self.embedding.remove_component(mesh, v);
        self.changes.vanished += 1;
    }

    /// Removes every speck of the mesh and returns how many there were.
    pub fn sweep(&mut self, mesh: &mut Mesh, sampling: Sampling, guide: &dyn TopologyGuide) -> u32 {
        let before = self.changes.vanished;
        for members in mesh.component_members() {
            self.remove_speck(mesh, sampling, guide, members[0]);
        }
        self.changes.vanished - before
    }
}

/// The volume of a part as it counts against being removed: that of a hollow which `guide` knows of is positive.
fn kept_volume(mesh: &Mesh, members: &[VertexId], volume: f32, guide: &dyn TopologyGuide) -> f32 {
    if volume < 0.0 && guide.is_hollow(mesh, members) { -volume } else { volume }
}

/// The signed volume of a whole component; positive where its triangles face outwards.
fn volume(mesh: &Mesh, members: &[VertexId]) -> f32 {
    let origin = mesh.position(members[0]);
    let triangle = |u: VertexId, (a, b): (VertexId, VertexId)| {
        if u > a || u > b {
            return 0.0;
        }
        let [p, q, r] = [u, a, b].map(|w| mesh.position(w) - origin);
        p.dot(q.cross(r)) / 6.0
    };
    members.iter().flat_map(|&u| mesh.ring(u).pairs().map(move |pair| triangle(u, pair))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::mesh::TriangleMesh;
    use crate::remesh::Changes;
    use std::f32::consts::TAU;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let positions = positions.iter().map(|&p| Vec3::from(p)).collect();
        Mesh::from_triangles(&TriangleMesh { positions, triangles: triangles.to_vec(), ..Default::default() })
            .unwrap()
    }

    fn step(mesh: &mut Mesh, sampling: Sampling, mut ways: Vec<Vec3>) -> Changes {
        let mut resolver = Resolver::with_room_for(1000);
        resolver.carry(mesh, sampling, &mut ways);
        let all: Vec<VertexId> = mesh.vertices().collect();
        resolver.resolve(mesh, sampling, &all)
    }

    /// Neither state crosses itself. One like the one after grew in empty space until it filled it: merge and split,
    /// seed 297.
    #[test]
    fn a_part_turned_inside_out_vanishes() {
        let rim = |k: u32| {
            let angle = TAU * k as f32 / 6.0;
            [libm::cosf(angle), libm::sinf(angle), 0.0]
        };
        let mut positions: Vec<[f32; 3]> = (0..6).map(rim).collect();
        positions.extend([[0.0, 0.0, 0.45], [0.0, 0.0, -0.45]]);
        let sides = (0..6).flat_map(|k| [[k, (k + 1) % 6, 6], [(k + 1) % 6, k, 7]]);
        let lens = mesh(&positions, &sides.collect::<Vec<_>>());
        let mut ways = vec![Vec3::ZERO; 8];
        assert_eq!(step(&mut lens.clone(), Sampling::new(0.6), ways.clone()), Changes::default());
        (ways[6], ways[7]) = (Vec3::Z * -0.95, Vec3::Z * 0.95);
        let mut passing = lens;
        assert_eq!(step(&mut passing, Sampling::new(0.6), ways).vanished, 1);
        assert_eq!(passing.vertex_count(), 0);
    }

    /// All edges are within bounds, and any move inwards makes it cross: merge and split, seed 404.
    #[test]
    fn a_part_that_cannot_shrink_vanishes() {
        let mut part = mesh(
            &[
                [22.015448, 21.224213, 21.005508],
                [21.30414, 23.457825, 21.515993],
                [19.880173, 21.749306, 21.090736],
                [18.910048, 20.52349, 21.04583],
                [19.413857, 21.692667, 19.572815],
                [22.018099, 22.400068, 19.543438],
                [19.792208, 23.546644, 19.620173],
                [18.065186, 19.906729, 19.959562],
                [22.888927, 23.65509, 19.344536],
                [21.199392, 23.79402, 19.419054],
            ],
            &[
                [0, 1, 2],
                [0, 2, 3],
                [0, 3, 4],
                [0, 4, 5],
                [0, 5, 1],
                [2, 1, 6],
                [2, 6, 4],
                [2, 4, 7],
                [2, 7, 3],
                [3, 7, 4],
                [8, 6, 1],
                [8, 1, 5],
                [8, 5, 9],
                [8, 9, 6],
                [5, 4, 9],
                [6, 9, 4],
            ],
        );
        let sampling = Sampling::new(1.4);
        for _ in 0..20 {
            let normals = part.to_triangles().vertex_normals();
            let ways = normals.iter().map(|n| *n * (-0.3 * sampling.shortest())).collect();
            step(&mut part, sampling, ways);
            if part.vertex_count() == 0 {
                return;
            }
            part = Mesh::from_triangles(&part.to_triangles()).unwrap();
        }
        panic!("{} vertices are left", part.vertex_count());
    }
}
