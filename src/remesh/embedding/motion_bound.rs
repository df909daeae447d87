//! Motion bounds: the displacement of a vertex's one-ring up to which the vertex need not be tested again.
//!
//! A test of the triangles at two vertices returns a clearance: they cannot intersect before some vertex of both
//! one-rings has moved by that distance. So they are tested again when the largest displacements in one of the two
//! one-rings add up to the clearance.

use super::{Embedding, MIN_LENGTH};
use crate::math::{Vec3, higher, resize};
use crate::mesh::{Mesh, VertexId};

/// A kind of collision check at a vertex, with a motion bound of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Check {
    /// Pairs of triangles that are both at the vertex, or one at the vertex and one at an adjacent vertex.
    OneRing,
    /// Pairs of triangles, one at the vertex and one at a non-adjacent vertex near it.
    Nearby,
    /// The search for non-adjacent vertices near the vertex by the broad phase; followed by [`Check::Nearby`].
    Search,
}

const CHECKS: [Check; 3] = [Check::OneRing, Check::Nearby, Check::Search];

/// A set of collision checks, such as those pending for a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Checks(u8);

impl Checks {
    pub(super) const ALL: Self = Self(7);

    #[inline]
    pub(super) fn has(self, one: Check) -> bool {
        self.0 & (1 << one as u8) != 0
    }

    #[inline]
    fn with(self, one: Check) -> Self {
        Self(self.0 | (1 << one as u8))
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// The displacement that remains to the one-ring of a vertex before each kind of check is due; due if it is not
/// positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MotionBounds([f32; 3]);

impl MotionBounds {
    /// The motion bounds of a vertex that was never tested, or has to be tested again: all checks are due.
    pub(super) const NONE: Self = Self([0.0; 3]);

    pub(super) fn set(&mut self, check: Check, clearance: f32) {
        self.0[check as usize] = clearance;
    }

    /// Lowers the motion bound of one kind of check to `clearance` if it is higher.
    pub(super) fn lower(&mut self, check: Check, clearance: f32) {
        let own = &mut self.0[check as usize];
        *own = if *own < clearance { *own } else { clearance };
    }

    /// Subtracts a displacement of the one-ring from all motion bounds; an infinite displacement makes all checks due.
    fn subtract(&mut self, displacement: f32) {
        self.0.iter_mut().for_each(|bound| {
            *bound = if displacement < f32::INFINITY { *bound - displacement } else { 0.0 }
        });
    }

    fn used_up(self) -> Checks {
        let used = CHECKS.into_iter().filter(|&check| self.0[check as usize] <= 0.0);
        used.fold(Checks::default(), Checks::with)
    }
}

impl Embedding {
    /// Subtracts the displacements of a move from the motion bounds of all one-rings that contain a moved vertex, and
    /// marks those vertices dirty whose bounds are used up. `moved` contains the moved vertices and their previous
    /// positions.
    pub(super) fn apply_motion(&mut self, mesh: &Mesh, moved: impl IntoIterator<Item = (VertexId, Vec3)>) {
        resize(&mut self.ring_displacement, mesh.slots(), 0.0);
        // Where few vertices move, nothing here takes time for all others.
        let mut touched = Vec::new();
        for (v, from) in moved {
            // The displacement after rounding of the position.
            let to = mesh.position(v);
            if from != to {
                let displacement = higher(MIN_LENGTH, to.distance(from));
                for &w in mesh.ring(v).as_slice().iter().chain([&v]) {
                    let travelled = &mut self.ring_displacement[w.index()];
                    if *travelled == 0.0 {
                        touched.push(w);
                    }
                    *travelled = higher(*travelled, displacement);
                }
            }
        }
        for v in touched {
            let travelled = std::mem::take(&mut self.ring_displacement[v.index()]);
            let bounds = &mut self.motion_bounds[v.index()];
            bounds.subtract(travelled);
            self.certificates.advance(v, travelled);
            let used_up = bounds.used_up();
            self.mark_dirty(v, used_up);
        }
    }

    /// Marks the vertices that edits created or changed since the last move as dirty, for the checks whose motion
    /// bounds are used up.
    pub(super) fn mark_edited_dirty(&mut self, mesh: &Mesh) {
        for v in std::mem::take(&mut self.edited) {
            self.is_edited[v.index()] = false;
            if mesh.is_live(v) {
                self.mark_dirty(v, self.motion_bounds[v.index()].used_up());
            }
        }
    }

    pub(super) fn mark_dirty(&mut self, v: VertexId, what: Checks) {
        // New pairs have to be tested, too.
        let what = if what.has(Check::Search) { what.with(Check::Nearby) } else { what };
        let pending = &mut self.pending[v.index()];
        if pending.is_empty() && !what.is_empty() {
            self.dirty.push(v);
        }
        pending.0 |= what.0;
    }
}
