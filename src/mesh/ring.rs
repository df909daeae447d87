//! The oriented one-ring of a vertex.

use super::VertexId;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

/// Neighbours held without a heap allocation: with fewer, common vertices spill over; with more, cache lines are
/// wasted on the mean valence of six.
const INLINE: usize = 10;

/// The neighbours of a vertex as a cycle, counter-clockwise seen from outside.
///
/// Consecutive neighbours `a`, `b` (the last one is followed by the first) form the triangle `(vertex, a, b)`. The
/// empty ring marks a free slot.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ring(SmallVec<[VertexId; INLINE]>);

impl Ring {
    /// A ring of the given neighbours in order.
    pub fn new(neighbours: impl IntoIterator<Item = VertexId>) -> Self {
        Self(neighbours.into_iter().collect())
    }

    /// The number of neighbours.
    #[inline]
    pub fn valence(&self) -> usize {
        self.0.len()
    }

    /// Whether the slot is free.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The neighbours in order.
    #[inline]
    pub fn as_slice(&self) -> &[VertexId] {
        &self.0
    }

    /// Whether `v` is a neighbour.
    #[inline]
    pub fn contains(&self, v: VertexId) -> bool {
        self.0.contains(&v)
    }

    /// Where `v` stands in the cycle.
    #[inline]
    pub fn position(&self, v: VertexId) -> Option<usize> {
        self.0.iter().position(|&w| w == v)
    }

    /// The neighbour after `v`, or `None` where `v` is not a neighbour.
    #[inline]
    pub fn after(&self, v: VertexId) -> Option<VertexId> {
        let next = self.position(v)? + 1;
        Some(if next == self.0.len() { self.0[0] } else { self.0[next] })
    }

    /// The neighbour before `v`, or `None` where `v` is not a neighbour.
    #[inline]
    pub fn before(&self, v: VertexId) -> Option<VertexId> {
        let here = self.position(v)?;
        Some(self.0[if here == 0 { self.0.len() - 1 } else { here - 1 }])
    }

    /// Consecutive neighbours `(a, b)`: each forms a triangle with the ring's vertex.
    pub fn pairs(&self) -> impl Iterator<Item = (VertexId, VertexId)> + '_ {
        let shifted = self.0.iter().skip(1).chain(self.0.first());
        self.0.iter().copied().zip(shifted.copied())
    }

    /// The neighbours strictly between `from` and `to`, going round from `from`.
    ///
    /// Empty where either is missing.
    pub fn between(&self, from: VertexId, to: VertexId) -> SmallVec<[VertexId; INLINE]> {
        let (Some(start), Some(end)) = (self.position(from), self.position(to)) else {
            return SmallVec::new();
        };
        let n = self.0.len();
        let count = (end + n - start - 1) % n;
        (1..=count).map(|k| self.0[(start + k) % n]).collect()
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

    /// Puts `new` in the place of `old`, in order.
    pub(super) fn splice(&mut self, old: VertexId, new: &[VertexId]) {
        if let Some(i) = self.position(old) {
            self.0.remove(i);
            self.0.insert_many(i, new.iter().copied());
        }
    }

    pub(super) fn rename(&mut self, name: impl Fn(VertexId) -> VertexId) {
        for v in &mut self.0 {
            *v = name(*v);
        }
    }
}
