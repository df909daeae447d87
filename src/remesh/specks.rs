//! Small parts that have no volume left.

use super::{Resolver, Sampling};
use crate::mesh::{Mesh, VertexId};

/// Components of more vertices are never removed, whatever their volume: a cavity has a negative one.
const LARGEST_SPECK: usize = 32;

/// The volume in δ³ of an icosahedron with edges of δ: the smallest ball that is no speck.
const SMALLEST_BALL: f32 = 2.18;

impl Resolver {
    /// Removes the component of `v` where it is a speck, and says whether it is gone.
    ///
    /// It may be gone already: the two sides of a cut handle are one component.
    ///
    /// A speck has at most 32 vertices and less than δ³ of volume. Those of negative volume would grow in empty space.
    pub(super) fn remove_speck(&mut self, mesh: &mut Mesh, sampling: Sampling, v: VertexId) -> bool {
        self.remove_below(mesh, v, sampling.smallest_volume())
    }

    /// Removes small components that a force squeezes flat: where two sides are pressed on each other, every vertex is
    /// held, no edge gets short, and they would stay for ever.
    pub(super) fn remove_crushed(&mut self, mesh: &mut Mesh, sampling: Sampling) {
        for v in std::mem::take(&mut self.stuck) {
            self.remove_below(mesh, v, SMALLEST_BALL * sampling.smallest_volume());
        }
    }

    fn remove_below(&mut self, mesh: &mut Mesh, v: VertexId, least: f32) -> bool {
        if !mesh.is_live(v) {
            return true;
        }
        let members = mesh.component_of(v, LARGEST_SPECK + 1);
        if members.len() > LARGEST_SPECK || volume(mesh, &members) >= least {
            return false;
        }
        self.embedding.remove_component(mesh, v);
        self.changes.vanished += 1;
        true
    }

    /// Removes every speck of the mesh and returns how many there were.
    pub fn sweep(&mut self, mesh: &mut Mesh, sampling: Sampling) -> u32 {
        let before = self.changes.vanished;
        for members in mesh.component_members() {
            self.remove_speck(mesh, sampling, members[0]);
        }
        self.changes.vanished - before
    }
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
