//! Certificates: until when a pair of one-rings is known not to intersect, however the tests of other pairs end.
//!
//! Each vertex has an odometer, the sum of the largest displacements in its one-ring. A test with clearance c certifies its pair until
//! the odometers of the two vertices together have advanced by 2 c. When the motion bound of a vertex is used up, only the pairs
//! without a valid certificate are tested again; the bounds of the others are half of what is left. (Certificates with failure times, as in
//! kinetic data structures: Basch, Guibas, Hershberger, *Data structures for mobile data*, 1999.)

use super::one_ring::ORDINARY_RING;
use crate::math::lower;
use crate::mesh::VertexId;
use smallvec::SmallVec;

/// The valence up to which the certificates of a vertex need no memory of their own.
const ORDINARY: usize = ORDINARY_RING / 2;

/// A clearance counts as this much at most, in the ordinary edge: more than is ever used up between two edits around a vertex.
const MOST: f32 = 1.0;

/// A certificate is worth keeping while more than this is left of it for each vertex, in the ordinary edge; a new test may give more.
const WORTH: f32 = 0.01;

/// Relative rounding of sums of odometers, in single precision, generously.
const ROUNDING: f32 = 4e-7;

/// Odometers beyond this, in the ordinary edge, are too coarse; then everything begins anew.
const LONGEST: f32 = 500.0;

/// The certificates of all pairs of adjacent one-rings, and odometers. Those of non-adjacent ones are stored with the pairs.
#[derive(Clone, Debug, Default)]
pub(super) struct Certificates {
    edge: f32,
    /// By vertex, how far its one-ring has moved, and more wherever an edit changed it.
    odometer: Vec<f32>,
    /// By vertex, the reading up to which its own one-ring is certified.
    own: Vec<f32>,
    /// By vertex and position in its ring, the sum of both readings up to which the pair is certified.
    along_edges: Vec<SmallVec<[f32; ORDINARY]>>,
    worn: bool,
}

impl Certificates {
    /// Discards everything.
    pub(super) fn begin(&mut self, edge: f32, slots: usize) {
        *self = Self { edge, ..Self::default() };
        self.resize(slots);
    }

    pub(super) fn resize(&mut self, slots: usize) {
        self.odometer.resize(slots, 0.0);
        self.own.resize(slots, 0.0);
        self.along_edges.resize(slots, SmallVec::new());
    }

    /// Whether odometers are too coarse by now.
    pub(super) fn are_worn(&self) -> bool {
        self.worn
    }

    /// Advances the odometer of a vertex.
    pub(super) fn advance(&mut self, v: VertexId, displacement: f32) {
        let odometer = &mut self.odometer[v.index()];
        *odometer = (*odometer + displacement).next_up();
        self.worn |= *odometer > LONGEST * self.edge;
    }

    /// Makes all certificates of a vertex invalid, which an edit made or changed.
    pub(super) fn revoke(&mut self, v: VertexId) {
        self.along_edges[v.index()].clear();
        self.own[v.index()] = 0.0;
        self.advance(v, 2.0 * MOST * self.edge);
    }

    /// Prepares for tests of a vertex of some valence; with `anew`, certificates do not count.
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

    /// Both readings together.
    fn sum(&self, [v, w]: [VertexId; 2]) -> f32 {
        self.odometer[v.index()] + self.odometer[w.index()]
    }

    /// What is left for each of two vertices of a certificate up to a sum of readings, if it is worth keeping.
    pub(super) fn left(&self, pair: [VertexId; 2], until: f32) -> Option<f32> {
        let left = 0.5 * (until - self.sum(pair));
        (left > WORTH * self.edge).then_some(left)
    }

    /// The sum of readings up to which a clearance certifies a pair.
    pub(super) fn until(&self, pair: [VertexId; 2], clearance: f32) -> f32 {
        let sum = self.sum(pair);
        let until = (sum + 2.0 * lower(MOST * self.edge, clearance)) * (1.0 - ROUNDING);
        // An odometer that has overflown certifies nothing.
        if until < f32::INFINITY { until } else { 0.0 }
    }

    /// What is left of the certificate of a one-ring.
    pub(super) fn left_of_own(&self, v: VertexId) -> Option<f32> {
        self.left([v, v], 2.0 * self.own[v.index()])
    }

    pub(super) fn set_own(&mut self, v: VertexId, clearance: f32) {
        self.own[v.index()] = 0.5 * self.until([v, v], clearance);
    }

    /// What is left of the certificate of `v` and the neighbour at a position in its ring.
    pub(super) fn left_along(&self, pair: [VertexId; 2], position: usize) -> Option<f32> {
        self.left(pair, *self.along_edges[pair[0].index()].get(position)?)
    }

    /// Sets the certificate of a pair at one of the two, by the position of the other in its ring.
    pub(super) fn set_along(&mut self, v: VertexId, position: usize, until: f32) {
        if let Some(own) = self.along_edges[v.index()].get_mut(position) {
            *own = until;
        }
    }
}
