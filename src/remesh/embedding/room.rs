//! How far each star may go before its vertex must be looked at again.
//!
//! Triangles at two vertices, with so much room that they do not cross as long as no vertex of both stars goes further, are
//! looked at again when the longest ways in one of both stars add up to that.

use super::star::higher;
use super::{Embedding, FINEST};
use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};

/// What a vertex is looked at for: pairs of triangles that are both at the vertex, or one at a neighbour of it; pairs with
/// one at a near vertex that is no neighbour; other vertices that are near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Concern {
    AtHand,
    Across,
    Search,
}

const CONCERNS: [Concern; 3] = [Concern::AtHand, Concern::Across, Concern::Search];

/// Several of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Concerns(u8);

impl Concerns {
    pub(super) const ALL: Self = Self(7);

    #[inline]
    pub(super) fn has(self, one: Concern) -> bool {
        self.0 & (1 << one as u8) != 0
    }

    #[inline]
    fn with(self, one: Concern) -> Self {
        Self(self.0 | (1 << one as u8))
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// How far a star may still go, by concern; there is none left where it is not positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Room([f32; 3]);

impl Room {
    /// That of a vertex of which nothing is known.
    pub(super) const NONE: Self = Self([0.0; 3]);

    pub(super) fn set(&mut self, concern: Concern, room: f32) {
        self.0[concern as usize] = room;
    }

    /// There is not more than that.
    pub(super) fn bound(&mut self, concern: Concern, room: f32) {
        let own = &mut self.0[concern as usize];
        *own = if *own < room { *own } else { room };
    }

    /// An infinite way uses up whatever there is.
    fn spend(&mut self, way: f32) {
        self.0.iter_mut().for_each(|room| *room = if way < f32::INFINITY { *room - way } else { 0.0 });
    }

    fn used_up(self) -> Concerns {
        let used = CONCERNS.into_iter().filter(|&concern| self.0[concern as usize] <= 0.0);
        used.fold(Concerns::default(), Concerns::with)
    }
}

impl Embedding {
    /// Subtracts displacements from the motion bounds of all stars that the moved vertices are in, and marks for a test those that are
    /// used up. `moved`: the vertices, and their positions before.
    pub(super) fn spend_room(&mut self, mesh: &Mesh, moved: impl IntoIterator<Item = (VertexId, Vec3)>) {
        self.gone.resize(mesh.slots(), 0.0);
        let mut touched = std::mem::take(&mut self.touched);
        for (v, from) in moved {
            // As it came out rounded, not as it was meant to be.
            let to = mesh.position(v);
            if from != to {
                let way = higher(FINEST, to.distance(from));
                for &w in mesh.ring(v).as_slice().iter().chain([&v]) {
                    let gone = &mut self.gone[w.index()];
                    if *gone == 0.0 {
                        touched.push(w);
                    }
                    *gone = higher(*gone, way);
                }
            }
        }
        for v in touched.drain(..) {
            let gone = std::mem::take(&mut self.gone[v.index()]);
            let room = &mut self.room[v.index()];
            room.spend(gone);
            let used_up = room.used_up();
            self.doubt(v, used_up);
        }
        self.touched = touched;
    }

    /// Doubts what edits made or changed, of which nothing is known yet.
    pub(super) fn doubt_fresh(&mut self, mesh: &Mesh) {
        let mut fresh = std::mem::take(&mut self.fresh);
        for v in fresh.drain(..).filter(|&v| mesh.is_live(v)) {
            self.doubt(v, self.room[v.index()].used_up());
        }
        self.fresh = fresh;
    }

    pub(super) fn doubt(&mut self, v: VertexId, what: Concerns) {
        let doubts = &mut self.doubts[v.index()];
        if doubts.is_empty() && !what.is_empty() {
            self.doubtful.push(v);
        }
        // What is found to be near has not been looked at.
        let what = if what.has(Concern::Search) { what.with(Concern::Across) } else { what };
        doubts.0 |= what.0;
    }
}
