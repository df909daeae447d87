//! The oriented one-ring of a vertex.

use super::VertexId;
use crate::math::Vec3;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

/// The number of neighbours that a ring stores without heap allocation. With fewer, many vertices need an allocation;
/// with more, cache lines are wasted, as the mean valence is six.
const INLINE: usize = 10;

/// The one-ring of a vertex: its neighbours as a cycle, counter-clockwise seen from outside.
///
/// Consecutive neighbours `a`, `b` (cyclically) form the triangle `(vertex, a, b)`. The ring of a free slot is empty.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ring(SmallVec<[VertexId; INLINE]>);

impl Ring {
    /// Creates a ring from the neighbours of a vertex in cyclic order, counter-clockwise seen from outside.
    pub fn new(neighbours: impl IntoIterator<Item = VertexId>) -> Self {
        Self(neighbours.into_iter().collect())
    }

    /// Returns the number of neighbours in the ring.
    #[inline]
    pub fn valence(&self) -> usize {
        self.0.len()
    }

    /// Returns whether the ring has no neighbours, which marks a free vertex slot.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the neighbours in cyclic order.
    #[inline]
    pub fn as_slice(&self) -> &[VertexId] {
        &self.0
    }

    /// Returns whether `v` is in the ring.
    #[inline]
    pub fn contains(&self, v: VertexId) -> bool {
        self.0.contains(&v)
    }

    /// Returns the index of `v` in the cycle of neighbours, or `None` if it is not a neighbour.
    #[inline]
    pub fn position(&self, v: VertexId) -> Option<usize> {
        self.0.iter().position(|&w| w == v)
    }

    /// Returns the neighbour after `v` in the cycle, counter-clockwise seen from outside, or `None` if `v` is not a
    /// neighbour.
    #[inline]
    pub fn after(&self, v: VertexId) -> Option<VertexId> {
        let next = self.position(v)? + 1;
        Some(if next == self.0.len() { self.0[0] } else { self.0[next] })
    }

    /// Returns the neighbour before `v` in the cycle, clockwise seen from outside, or `None` if `v` is not a neighbour.
    #[inline]
    pub fn before(&self, v: VertexId) -> Option<VertexId> {
        let here = self.position(v)?;
        Some(self.0[if here == 0 { self.0.len() - 1 } else { here - 1 }])
    }

    /// Returns the index of `v` as [`Self::position`] does; fast if it is a little after `start`, or at it.
    #[inline]
    pub(crate) fn position_from(&self, start: usize, v: VertexId) -> Option<usize> {
        let is_v = |&w: &VertexId| w == v;
        let (before, from) = self.0.split_at(start.min(self.0.len()));
        from.iter().position(is_v).map(|k| before.len() + k).or_else(|| before.iter().position(is_v))
    }

    /// Iterates over pairs of consecutive neighbours `(a, b)`, cyclically; each pair forms a triangle with the vertex
    /// of the ring.
    pub fn pairs(&self) -> impl Iterator<Item = (VertexId, VertexId)> + '_ {
        let shifted = self.0.iter().skip(1).chain(self.0.first());
        self.0.iter().copied().zip(shifted.copied())
    }

    /// Returns the neighbours strictly between `from` and `to` in cyclic order.
    ///
    /// Empty if `from` or `to` is not a neighbour.
    pub fn between(&self, from: VertexId, to: VertexId) -> SmallVec<[VertexId; INLINE]> {
        let (Some(start), Some(end)) = (self.position(from), self.position(to)) else {
            return SmallVec::new();
        };
        let n = self.0.len();
        let count = (end + n - start - 1) % n;
        (1..=count).map(|k| self.0[(start + k) % n]).collect()
    }

    /// Returns the mean over the neighbours of `values`, which are indexed by vertex slot; NaN for an empty ring.
    ///
    /// Of their positions, this is the umbrella operator: the position of the vertex with the least membrane energy,
    /// and, less its own position, its Laplacian.
    #[inline]
    pub fn mean(&self, values: &[Vec3]) -> Vec3 {
        self.0.iter().fold(Vec3::ZERO, |sum, w| sum + values[w.index()]) * (1.0 / self.0.len() as f32)
    }

    pub(super) fn replace(&mut self, old: VertexId, new: VertexId) {
        if let Some(i) = self.position(old) {
            self.0[i] = new;
        }
    }

    pub(super) fn remove(&mut self, v: VertexId) {
        if let Some(i) = self.position(v) {
            self.0.remove(i);
        }
    }

    pub(super) fn insert_after(&mut self, v: VertexId, new: VertexId) {
        if let Some(i) = self.position(v) {
            self.0.insert(i + 1, new);
        }
    }

    /// Replaces the neighbour `old` by the neighbours `new`, in cyclic order; does nothing if `old` is not in the ring.
    pub(super) fn splice(&mut self, old: VertexId, new: &[VertexId]) {
        if let Some(i) = self.position(old) {
            self.0.remove(i);
            self.0.insert_many(i, new.iter().copied());
        }
    }

    /// Reverses the cycle, which turns the triangles of the vertex over if done in all rings.
    pub(super) fn reverse(&mut self) {
        self.0.reverse();
    }

    pub(super) fn renumber(&mut self, new_id: impl Fn(VertexId) -> VertexId) {
        for v in &mut self.0 {
            *v = new_id(*v);
        }
    }
}
