//! Transactions: edits of a [`Mesh`] are recorded and can be rolled back.

use super::{Mesh, Ring, VertexId};
use crate::math::Vec3;
use crate::math::order::{combined_rank, sort_pairs};
use smallvec::SmallVec;

/// The undo log of the edits since [`Mesh::begin`]: the state of each vertex slot before its first change.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Journal {
    touched: Vec<Touched>,
    /// The attributes of the touched slots before their first change, one slot after the other, in the order of
    /// `touched`.
    attributes: Vec<f32>,
    /// The vertex slots taken from and returned to the free list, in order, so that a rollback restores the list.
    slots_taken_and_freed: Vec<SlotChange>,
    slots: usize,
    half_edges: usize,
    euler: i64,
    /// Whether edits are being recorded. A closed journal keeps its memory for the next recording.
    open: bool,
}

/// The state of a vertex before its first change since [`Mesh::begin`], so that a rollback restores it.
#[derive(Clone, Debug, PartialEq)]
struct Touched {
    vertex: VertexId,
    ring: Ring,
    position: Vec3,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum SlotChange {
    Taken(VertexId),
    Freed,
}

/// A list of triangles by the ids of their corners, each starting at the lowest id.
pub type TriangleCorners = SmallVec<[[VertexId; 3]; 16]>;

impl Mesh {
    /// Starts to record edits, until [`Mesh::commit`] keeps them or [`Mesh::roll_back`] undoes them.
    ///
    /// If edits are being recorded already, those so far are kept and recording restarts. Each edit searches the
    /// vertices touched so far, so that edits of a large part of the mesh are slow. Bulk changes
    /// ([`Mesh::positions_mut`], [`Mesh::refine`], [`Mesh::reorder`]) and direct changes of attributes are not
    /// recorded.
    pub fn begin(&mut self) {
        let journal = &mut self.journal;
        journal.touched.clear();
        journal.attributes.clear();
        journal.slots_taken_and_freed.clear();
        journal.slots = self.rings.len();
        journal.half_edges = self.half_edges;
        journal.euler = self.euler;
        journal.open = true;
    }

    /// Keeps the edits since [`Mesh::begin`] and stops recording.
    pub fn commit(&mut self) {
        self.journal.open = false;
    }

    /// Undoes the edits since [`Mesh::begin`] and stops recording; does nothing if edits are not being recorded. The
    /// version counters are not restored; they increase.
    pub fn roll_back(&mut self) {
        let journal = std::mem::take(&mut self.journal);
        if !journal.open {
            self.journal = journal;
            return;
        }
        let [vectors, scalars] = self.attributes.counts();
        let width = 3 * vectors + scalars;
        for (k, was) in journal.touched.iter().enumerate() {
            let slot = was.vertex.index();
            self.rings[slot] = was.ring.clone();
            self.positions[slot] = was.position;
            self.attributes.set(slot, &journal.attributes[k * width..(k + 1) * width]);
        }
        for change in journal.slots_taken_and_freed.iter().rev() {
            match *change {
                SlotChange::Taken(v) => self.free.push(v),
                SlotChange::Freed => _ = self.free.pop(),
            }
        }
        self.rings.truncate(journal.slots);
        self.positions.truncate(journal.slots);
        self.attributes.truncate(journal.slots);
        self.half_edges = journal.half_edges;
        self.euler = journal.euler;
        self.topology_changed();
        self.journal = Journal { open: false, ..journal };
    }

    /// Iterates over the vertices touched by edits since [`Mesh::begin`], which collision handling updates: those
    /// moved, created or deleted, and those whose one-ring changed.
    pub fn touched_vertices(&self) -> impl Iterator<Item = VertexId> + '_ {
        let made = (self.journal.slots..self.slots()).map(VertexId::from_index);
        self.journal.touched.iter().map(|was| was.vertex).chain(made)
    }

    /// Returns the triangles that edits since [`Mesh::begin`] created or moved, each once, for the tests of collision
    /// handling.
    pub fn changed_triangles(&self) -> TriangleCorners {
        let mut found = TriangleRanks::new();
        for was in &self.journal.touched {
            let ring = self.ring(was.vertex);
            let all = was.ring.is_empty() || was.position != self.position(was.vertex);
            // Most neighbours of a hub with thousands follow each other as before.
            let mut before = 0;
            let mut is_as_before = |a, b| {
                let Some(k) = was.ring.position_from(before, a) else { return false };
                before = if k + 1 == was.ring.valence() { 0 } else { k + 1 };
                was.ring.as_slice()[before] == b
            };
            let pairs = ring.pairs().filter(|&(a, b)| all || !is_as_before(a, b));
            found.extend(pairs.map(|(a, b)| rank([was.vertex, a, b])));
        }
        for v in (self.journal.slots..self.slots()).map(VertexId::from_index) {
            found.extend(self.ring(v).pairs().map(|(a, b)| rank([v, a, b])));
        }
        sorted_distinct(found)
    }

    /// Records the state of vertex `v` in the undo log if edits are being recorded; must be called before its slot is
    /// changed.
    #[inline]
    pub(super) fn touch(&mut self, v: VertexId) {
        if self.journal.open {
            self.record(v);
        }
    }

    /// Records the states of distinct vertices as [`Self::touch`] does; fast if nothing was recorded before.
    pub(super) fn touch_distinct(&mut self, vertices: &[VertexId]) {
        let is_first = self.journal.touched.is_empty();
        for &v in vertices {
            if is_first && self.journal.open && v.index() < self.journal.slots {
                self.record_anew(v);
            } else {
                self.touch(v);
            }
        }
    }

    fn record(&mut self, v: VertexId) {
        let journal = &self.journal;
        if v.index() < journal.slots && !journal.touched.iter().any(|was| was.vertex == v) {
            self.record_anew(v);
        }
    }

    fn record_anew(&mut self, v: VertexId) {
        let journal = &mut self.journal;
        let (ring, position) = (self.rings[v.index()].clone(), self.positions[v.index()]);
        journal.touched.push(Touched { vertex: v, ring, position });
        self.attributes.get(v.index(), &mut journal.attributes);
    }

    pub(super) fn slot_taken(&mut self, v: VertexId) {
        self.slot_taken_recorded(v);
        self.touch(v);
    }

    /// Records that a slot whose state was recorded already was taken from the free list.
    pub(super) fn slot_taken_recorded(&mut self, v: VertexId) {
        if self.journal.open {
            self.journal.slots_taken_and_freed.push(SlotChange::Taken(v));
        }
    }

    pub(super) fn slot_freed(&mut self) {
        if self.journal.open {
            self.journal.slots_taken_and_freed.push(SlotChange::Freed);
        }
    }

    /// Returns the ring of `v` for modification, after recording the state of `v` in the undo log.
    #[inline]
    pub(super) fn ring_mut(&mut self, v: VertexId) -> &mut Ring {
        self.touch(v);
        &mut self.rings[v.index()]
    }

    /// Returns the triangles that have a corner in `vertices`, each once, sorted by vertex ids.
    pub fn triangles_at(&self, vertices: &[VertexId]) -> TriangleCorners {
        let at = |v: VertexId| self.ring(v).pairs().map(move |(a, b)| rank([v, a, b]));
        sorted_distinct(vertices.iter().flat_map(|&v| at(v)).collect())
    }
}

/// The ranks by which [`TriangleCorners`] are sorted: the ids of the corners, from the lowest on.
type TriangleRanks = SmallVec<[(u64, u32); 16]>;

fn rank([a, b, c]: [VertexId; 3]) -> (u64, u32) {
    let [VertexId(a), VertexId(b), VertexId(c)] = if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    };
    (combined_rank(a, b), c)
}

fn sorted_distinct(mut ranks: TriangleRanks) -> TriangleCorners {
    sort_pairs(&mut ranks);
    ranks.dedup();
    ranks.into_iter().map(|(ab, c)| [(ab >> 32) as u32, ab as u32, c].map(VertexId)).collect()
}
