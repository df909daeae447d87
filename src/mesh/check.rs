//! Tests of the invariants of the dynamic [`Mesh`], one function each.

use super::{Mesh, VertexId};

/// A violated invariant of a mesh, found by [`Mesh::check`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvariantViolation {
    /// This vertex has fewer than three neighbours.
    #[error("{0:?} has fewer than three neighbours")]
    LowValence(VertexId),
    /// The second vertex occurs twice in the ring of the first, so that the edge between them is doubled.
    #[error("the edge from {0:?} to {1:?} is doubled")]
    DoubledEdge(VertexId, VertexId),
    /// The second vertex is in the ring of the first, but is not live, is the first itself, or does not have the first
    /// in its ring.
    #[error("{1:?} is in the ring of {0:?}, but not {0:?} in the ring of {1:?}")]
    OneSidedEdge(VertexId, VertexId),
    /// The rings of these three corners of a triangle are inconsistent: the surface is open or not oriented there.
    #[error("the rings of the corners of triangle ({0:?}, {1:?}, {2:?}) are inconsistent")]
    BrokenTriangle(VertexId, VertexId, VertexId),
    /// The Euler characteristic or the number of half-edges maintained by the edits differs from the counted one.
    #[error("χ = {predicted} according to the edits, but {counted} according to a count")]
    EulerMismatch {
        /// The Euler characteristic maintained by the edits.
        predicted: i64,
        /// The Euler characteristic V − E + F, counted.
        counted: i64,
    },
    /// The lengths of the per-vertex arrays differ, or the free list does not contain each slot with an empty ring
    /// once.
    #[error("the arrays of the mesh are inconsistent")]
    InconsistentArrays,
    /// A position or attribute of this vertex is NaN or infinite.
    #[error("{0:?} has a position or attribute that is not finite")]
    NotFinite(VertexId),
}

impl Mesh {
    /// Tests the invariants of a closed, oriented 2-manifold listed in the documentation of the [module](super), and
    /// that the per-vertex arrays, the free list and the counters are consistent and all positions and attributes
    /// finite.
    ///
    /// # Errors
    /// The first violated invariant found.
    pub fn check(&self) -> Result<(), InvariantViolation> {
        self.check_arrays()?;
        for v in self.vertices() {
            self.check_valence(v)?;
            self.check_neighbours(v)?;
            self.check_triangles(v)?;
            if !self.position(v).is_finite() || !self.attributes.is_finite(v) {
                return Err(InvariantViolation::NotFinite(v));
            }
        }
        self.check_euler()
    }

    fn check_arrays(&self) -> Result<(), InvariantViolation> {
        let empty = self.rings.iter().filter(|ring| ring.is_empty()).count();
        let fits = self.positions.len() == self.rings.len() && self.attributes.fits(self.rings.len());
        if fits && self.free.len() == empty && self.free_slots_are_distinct() {
            Ok(())
        } else {
            Err(InvariantViolation::InconsistentArrays)
        }
    }

    fn free_slots_are_distinct(&self) -> bool {
        let mut listed = vec![false; self.slots()];
        self.free.iter().all(|v| {
            let empty = self.rings.get(v.index()).is_some_and(|ring| ring.is_empty());
            empty && !std::mem::replace(&mut listed[v.index()], true)
        })
    }

    fn check_valence(&self, v: VertexId) -> Result<(), InvariantViolation> {
        if self.ring(v).valence() >= 3 { Ok(()) } else { Err(InvariantViolation::LowValence(v)) }
    }

    fn check_neighbours(&self, v: VertexId) -> Result<(), InvariantViolation> {
        let ring = self.ring(v).as_slice();
        for (k, &w) in ring.iter().enumerate() {
            if w == v || !self.is_live(w) || !self.ring(w).contains(v) {
                return Err(InvariantViolation::OneSidedEdge(v, w));
            }
            if ring[..k].contains(&w) {
                return Err(InvariantViolation::DoubledEdge(v, w));
            }
        }
        Ok(())
    }

    fn check_triangles(&self, v: VertexId) -> Result<(), InvariantViolation> {
        for (a, b) in self.ring(v).pairs() {
            if self.ring(a).after(b) != Some(v) || self.ring(b).after(v) != Some(a) {
                return Err(InvariantViolation::BrokenTriangle(v, a, b));
            }
        }
        Ok(())
    }

    fn check_euler(&self) -> Result<(), InvariantViolation> {
        let half_edges: usize = self.rings.iter().map(|ring| ring.valence()).sum();
        let counted = self.vertex_count() as i64 - half_edges as i64 / 2 + half_edges as i64 / 3;
        if half_edges == self.half_edges && counted == self.euler {
            return Ok(());
        }
        Err(InvariantViolation::EulerMismatch { predicted: self.euler, counted })
    }
}
