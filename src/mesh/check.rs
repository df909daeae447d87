//! The kernel's own invariants, one function each.

use super::{Mesh, VertexId};

/// One broken invariant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Flaw {
    /// A vertex has fewer than three neighbours.
    #[error("{0:?} has fewer than three neighbours")]
    LowValence(VertexId),
    /// A neighbour stands twice in a ring: an edge is doubled.
    #[error("the edge from {0:?} to {1:?} is doubled")]
    DoubledEdge(VertexId, VertexId),
    /// A neighbour does not exist, is the vertex itself, or does not know the vertex.
    #[error("{0:?} names {1:?} as a neighbour, which does not name it back")]
    OneSidedEdge(VertexId, VertexId),
    /// The corners of a triangle do not agree on it: the surface is open or not oriented there.
    #[error("the corners of ({0:?}, {1:?}, {2:?}) do not agree on this triangle")]
    BrokenTriangle(VertexId, VertexId, VertexId),
    /// χ counted is not χ predicted by the edits, or the edge count is off.
    #[error("the edits predict χ = {predicted}, but {counted} is counted")]
    EulerMismatch {
        /// What the edits add up to.
        predicted: i64,
        /// V − E + F.
        counted: i64,
    },
    /// Per-vertex arrays, the free list and the rings are out of step.
    #[error("the arrays of the mesh are out of step")]
    OutOfStep,
    /// A coordinate or an attribute is NaN or infinite.
    #[error("{0:?} has a position or attribute that is not finite")]
    NotFinite(VertexId),
}

impl Mesh {
    /// Every invariant, tested; see the module's documentation.
    ///
    /// # Errors
    /// The first [`Flaw`] found.
    pub fn check(&self) -> Result<(), Flaw> {
        self.check_arrays()?;
        for v in self.vertices() {
            self.check_valence(v)?;
            self.check_neighbours(v)?;
            self.check_triangles(v)?;
            if !self.position(v).is_finite() || !self.attributes.is_finite(v) {
                return Err(Flaw::NotFinite(v));
            }
        }
        self.check_euler()
    }

    fn check_arrays(&self) -> Result<(), Flaw> {
        let empty = self.rings.iter().filter(|ring| ring.is_empty()).count();
        let fits = self.positions.len() == self.rings.len() && self.attributes.fits(self.rings.len());
        if fits && self.free.len() == empty && self.free_slots_are_distinct() {
            Ok(())
        } else {
            Err(Flaw::OutOfStep)
        }
    }

    fn free_slots_are_distinct(&self) -> bool {
        let mut listed = vec![false; self.slots()];
        self.free.iter().all(|v| {
            let empty = self.rings.get(v.index()).is_some_and(|ring| ring.is_empty());
            empty && !std::mem::replace(&mut listed[v.index()], true)
        })
    }

    fn check_valence(&self, v: VertexId) -> Result<(), Flaw> {
        if self.ring(v).valence() >= 3 { Ok(()) } else { Err(Flaw::LowValence(v)) }
    }

    fn check_neighbours(&self, v: VertexId) -> Result<(), Flaw> {
        let ring = self.ring(v).as_slice();
        for (k, &w) in ring.iter().enumerate() {
            if w == v || !self.is_live(w) || !self.ring(w).contains(v) {
                return Err(Flaw::OneSidedEdge(v, w));
            }
            if ring[..k].contains(&w) {
                return Err(Flaw::DoubledEdge(v, w));
            }
        }
        Ok(())
    }

    fn check_triangles(&self, v: VertexId) -> Result<(), Flaw> {
        for (a, b) in self.ring(v).pairs() {
            if self.ring(a).after(b) != Some(v) || self.ring(b).after(v) != Some(a) {
                return Err(Flaw::BrokenTriangle(v, a, b));
            }
        }
        Ok(())
    }

    fn check_euler(&self) -> Result<(), Flaw> {
        let half_edges: usize = self.rings.iter().map(|ring| ring.valence()).sum();
        let counted = self.vertex_count() as i64 - half_edges as i64 / 2 + half_edges as i64 / 3;
        if half_edges == self.half_edges && counted == self.euler {
            return Ok(());
        }
        Err(Flaw::EulerMismatch { predicted: self.euler, counted })
    }
}
