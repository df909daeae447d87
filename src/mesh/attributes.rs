//! Per-vertex attributes of a [`Mesh`](super::Mesh), such as data of a method, that edits keep up to date.

use super::VertexId;
use super::renumber::in_order;
use crate::math::{Vec3, resize};
use serde::{Deserialize, Serialize};

/// A handle of a per-vertex 3D vector attribute, returned by [`Mesh::add_vector`](super::Mesh::add_vector).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VectorKey(usize);

/// A handle of a per-vertex scalar attribute, returned by [`Mesh::add_scalar`](super::Mesh::add_scalar).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScalarKey(usize);

/// The attributes of a mesh: one array per attribute, with one value per vertex slot.
///
/// Edits append, interpolate and reorder the slots of all arrays together, and a rollback restores and truncates them.
/// So the arrays always have the length of the mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Attributes {
    vectors: Vec<Vec<Vec3>>,
    scalars: Vec<Vec<f32>>,
}

impl Attributes {
    pub(super) fn add_vector(&mut self, slots: usize) -> VectorKey {
        self.vectors.push(vec![Vec3::ZERO; slots]);
        VectorKey(self.vectors.len() - 1)
    }

    pub(super) fn add_scalar(&mut self, slots: usize) -> ScalarKey {
        self.scalars.push(vec![0.0; slots]);
        ScalarKey(self.scalars.len() - 1)
    }

    pub(super) fn vector(&self, key: VectorKey) -> &[Vec3] {
        &self.vectors[key.0]
    }

    pub(super) fn vector_mut(&mut self, key: VectorKey) -> &mut [Vec3] {
        &mut self.vectors[key.0]
    }

    pub(super) fn scalar(&self, key: ScalarKey) -> &[f32] {
        &self.scalars[key.0]
    }

    pub(super) fn scalar_mut(&mut self, key: ScalarKey) -> &mut [f32] {
        &mut self.scalars[key.0]
    }

    pub(super) fn vector_and_scalar_mut(
        &mut self,
        vector: VectorKey,
        scalar: ScalarKey,
    ) -> (&mut [Vec3], &mut [f32]) {
        (&mut self.vectors[vector.0], &mut self.scalars[scalar.0])
    }

    pub(super) fn grow(&mut self, slots: usize) {
        self.vectors.iter_mut().for_each(|v| resize(v, slots, Vec3::ZERO));
        self.scalars.iter_mut().for_each(|s| resize(s, slots, 0.0));
    }

    /// Sets the attributes of slot `target` to those of `a` and `b`, interpolated linearly: those of `a` for `t` = 0,
    /// those of `b` for `t` = 1.
    pub(super) fn blend(&mut self, target: VertexId, a: VertexId, b: VertexId, t: f32) {
        let (target, a, b) = (target.index(), a.index(), b.index());
        for v in &mut self.vectors {
            v[target] = v[a] + (v[b] - v[a]) * t;
        }
        for s in &mut self.scalars {
            s[target] = s[a] + (s[b] - s[a]) * t;
        }
    }

    /// Appends all attributes of the vertex in a slot to `out`, for the undo log.
    pub(super) fn get(&self, slot: usize, out: &mut Vec<f32>) {
        self.vectors.iter().for_each(|v| out.extend(v[slot].to_array()));
        out.extend(self.scalars.iter().map(|s| s[slot]));
    }

    /// Restores all attributes of the vertex in a slot from the numbers appended by [`Self::get`].
    pub(super) fn set(&mut self, slot: usize, data: &[f32]) {
        let (vectors, scalars) = data.split_at(3 * self.vectors.len());
        for (to, from) in self.vectors.iter_mut().zip(vectors.chunks_exact(3)) {
            to[slot] = Vec3::from_slice(from);
        }
        for (to, &from) in self.scalars.iter_mut().zip(scalars) {
            to[slot] = from;
        }
    }

    pub(super) fn truncate(&mut self, slots: usize) {
        self.vectors.iter_mut().for_each(|v| v.truncate(slots));
        self.scalars.iter_mut().for_each(|s| s.truncate(slots));
    }

    /// Moves the attributes of slot `order[i]` to slot `i`, when vertices are renumbered, with memory for at least `room`
    /// slots.
    pub(super) fn reorder(&mut self, order: &[VertexId], room: usize) {
        for v in &mut self.vectors {
            *v = in_order(order, room, |slot| v[slot]);
        }
        for s in &mut self.scalars {
            *s = in_order(order, room, |slot| s[slot]);
        }
    }

    /// Returns the numbers of vector and of scalar attributes.
    pub(super) fn counts(&self) -> [usize; 2] {
        [self.vectors.len(), self.scalars.len()]
    }

    pub(super) fn is_finite(&self, v: VertexId) -> bool {
        let i = v.index();
        self.vectors.iter().all(|of| of[i].is_finite()) && self.scalars.iter().all(|of| of[i].is_finite())
    }

    pub(super) fn fits(&self, slots: usize) -> bool {
        self.vectors.iter().all(|v| v.len() == slots) && self.scalars.iter().all(|s| s.len() == slots)
    }
}
