//! Certificates: how long a pair of one-rings is known not to intersect, independent of the tests of other pairs.
//!
//! Each vertex has an odometer, the sum of the largest displacements in its one-ring. A test with clearance c certifies
//! its pair until the odometers of the two vertices together have advanced by 2 c. When the motion bound of a vertex is
//! used up, only the pairs without a valid certificate are tested again; the bounds of the others are half of the
//! remainder. (Certificates with failure times, as in kinetic data structures: Basch, Guibas, Hershberger, *Data
//! structures for mobile data*, 1999.)

use super::one_ring::ORDINARY_RING;
use crate::math::{lower, resize_within};
use crate::mesh::VertexId;
use smallvec::SmallVec;

/// The valence up to which the certificates of a vertex, one per neighbour, are stored inline, without heap allocation.
const ORDINARY: usize = ORDINARY_RING / 2;

/// The largest clearance that a certificate records, relative to the ordinary edge: more than is ever used up between
/// two edits around a vertex.
const MAX_CLEARANCE: f32 = 1.0;

/// The smallest remaining displacement per vertex, relative to the ordinary edge, for which a certificate is reused;
/// with less, a new test may give a larger one.
const WORTH: f32 = 0.01;

/// Generous bound on the relative rounding error of sums of odometers, in single precision.
const ROUNDING: f32 = 4e-7;

/// The reading of an odometer, relative to the ordinary edge, above which all certificates are discarded and odometers
/// are reset: single precision is too coarse for larger sums.
const MAX_ODOMETER: f32 = 500.0;

/// The odometers of all vertices, and the certificates of all one-rings and of all pairs of adjacent ones. Certificates
/// of non-adjacent pairs are stored in the lists of near vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Certificates {
    edge: f32,
    /// The odometer of each vertex, by slot: the sum of the largest displacements in its one-ring, increased further by
    /// edits that change it.
    odometer: Vec<f32>,
    /// For each vertex, the odometer reading up to which its triangles are certified not to intersect each other.
    own: Vec<f32>,
    /// For each vertex and each of its neighbours, in the order of its ring: the sum of both odometers up to which the
    /// triangles at the two are certified not to intersect.
    along_edges: Vec<SmallVec<[f32; ORDINARY]>>,
    worn: bool,
}

impl Certificates {
    /// Discards all certificates and resets the odometers; `edge` is the ordinary edge, to which limits are relative.
    pub(super) fn begin(&mut self, edge: f32) {
        *self = Self { edge, ..Self::default() };
    }

    /// Resizes the arrays to `slots`, with memory for `room` slots.
    pub(super) fn resize(&mut self, slots: usize, room: usize) {
        resize_within(&mut self.odometer, slots, 0.0, room);
        resize_within(&mut self.own, slots, 0.0, room);
        resize_within(&mut self.along_edges, slots, SmallVec::new(), room);
    }

    /// Returns whether an odometer exceeds [`MAX_ODOMETER`], so that the certificates must be reset.
    pub(super) fn are_worn(&self) -> bool {
        self.worn
    }

    /// Adds the largest displacement in the one-ring of `v` during a move to the odometer of `v`.
    pub(super) fn advance(&mut self, v: VertexId, displacement: f32) {
        let odometer = &mut self.odometer[v.index()];
        *odometer = (*odometer + displacement).next_up();
        self.worn |= *odometer > MAX_ODOMETER * self.edge;
    }

    /// Invalidates all certificates of `v`, which an edit created or changed: clears those stored at `v`, and advances
    /// its odometer, so that those stored elsewhere expire.
    pub(super) fn revoke(&mut self, v: VertexId) {
        // A vertex made since the last resizing has none.
        let Some(along_edges) = self.along_edges.get_mut(v.index()) else { return };
        along_edges.clear();
        self.own[v.index()] = 0.0;
        self.advance(v, 2.0 * MAX_CLEARANCE * self.edge);
    }

    /// Prepares the certificates of `v` before its one-ring is tested: discards those along its edges if their number
    /// is not `valence`; with `anew`, discards them and that of `v` itself in any case.
    pub(super) fn prepare(&mut self, v: VertexId, valence: usize, anew: bool) {
        let along_edges = &mut self.along_edges[v.index()];
        if anew || along_edges.len() != valence {
            along_edges.clear();
            along_edges.resize(valence, 0.0);
        }
        if anew {
            self.own[v.index()] = 0.0;
        }
    }

    /// Returns the sum of the odometers of both vertices.
    fn sum(&self, [v, w]: [VertexId; 2]) -> f32 {
        self.odometer[v.index()] + self.odometer[w.index()]
    }

    /// Returns the displacement that remains to the one-rings of a pair before the pair is tested again, where `until`
    /// is the odometer sum up to which it is certified; `None` if that is too little to reuse the certificate.
    pub(super) fn left(&self, pair: [VertexId; 2], until: f32) -> Option<f32> {
        let left = 0.5 * (until - self.sum(pair));
        (left > WORTH * self.edge).then_some(left)
    }

    /// Returns the sum of both odometers up to which a pair is certified not to intersect, after a test that found the
    /// given clearance.
    pub(super) fn until(&self, pair: [VertexId; 2], clearance: f32) -> f32 {
        let sum = self.sum(pair);
        let until = (sum + 2.0 * lower(MAX_CLEARANCE * self.edge, clearance)) * (1.0 - ROUNDING);
        // An odometer that has overflowed certifies nothing.
        if until < f32::INFINITY { until } else { 0.0 }
    }

    /// Returns the displacement that remains to the one-ring of `v` before its triangles are tested against each other
    /// again; `None` if that is too little to reuse the certificate.
    pub(super) fn left_of_own(&self, v: VertexId) -> Option<f32> {
        self.left([v, v], 2.0 * self.own[v.index()])
    }

    pub(super) fn set_own(&mut self, v: VertexId, clearance: f32) {
        self.own[v.index()] = 0.5 * self.until([v, v], clearance);
    }

    /// Returns the displacement that remains to the one-rings of a vertex and its neighbour at `position` in its ring
    /// before the pair is tested again; `None` if that is too little to reuse the certificate.
    pub(super) fn left_along(&self, pair: [VertexId; 2], position: usize) -> Option<f32> {
        self.left(pair, *self.along_edges[pair[0].index()].get(position)?)
    }

    /// Stores at `v` the odometer sum `until` up to which it and its neighbour at `position` in its ring are certified
    /// not to intersect.
    pub(super) fn set_along(&mut self, v: VertexId, position: usize, until: f32) {
        if let Some(own) = self.along_edges[v.index()].get_mut(position) {
            *own = until;
        }
    }
}
