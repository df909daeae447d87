//! Regions of the input surface where unchecked edits caused self-intersections.

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId};
use std::collections::BTreeSet;

/// The radius, in units of the target edge, around intersections in which the next run of remeshing leaves the surface
/// unchanged. With a smaller one, edits next to the region cause intersections in that run; a larger one needs more
/// checked edits.
const REACH: f32 = 3.0;

/// The set of vertices of the input surface near self-intersections found so far, which the next run leaves unchanged.
pub(super) struct ConflictMask<'a> {
    surface: &'a Mesh,
    marked: Vec<bool>,
}

impl<'a> ConflictMask<'a> {
    /// Creates an empty set of vertices of `surface`, the input of remeshing.
    pub fn new(surface: &'a Mesh) -> Self {
        Self { surface, marked: vec![false; surface.slots()] }
    }

    pub fn is_empty(&self) -> bool {
        !self.marked.contains(&true)
    }

    /// Returns, by slot of the input surface, whether each vertex is not in the set, so that it may be edited.
    pub fn complement(&self) -> Vec<bool> {
        self.marked.iter().map(|marked| !marked).collect()
    }

    /// Returns, by slot of the input surface, whether each vertex is in the set or connected to it within a distance of
    /// `reach`.
    pub fn dilated(&self, reach: f32) -> Vec<bool> {
        let mut wider = self.marked.clone();
        let is_marked = |v: VertexId| self.marked[v.index()];
        for v in self.surface.vertices().filter(|&v| is_marked(v)) {
            if !self.surface.ring(v).as_slice().iter().all(|&w| is_marked(w)) {
                mark_around(self.surface, v, self.surface.position(v), reach, &mut wider);
            }
        }
        wider
    }

    /// Adds the vertices within three target edges of `position`, that of a corner of an intersecting triangle;
    /// `anchor` is a nearby vertex of the input surface.
    pub fn add(&mut self, anchor: VertexId, position: Vec3, target_edge: f32) {
        mark_around(self.surface, anchor, position, REACH * target_edge, &mut self.marked);
    }
}

/// Marks `seed` and the vertices connected to it via vertices within `reach` of `centre`.
fn mark_around(surface: &Mesh, seed: VertexId, centre: Vec3, reach: f32, marked: &mut [bool]) {
    let mut pending = vec![seed];
    let mut seen = BTreeSet::from([seed]);
    while let Some(v) = pending.pop() {
        marked[v.index()] = true;
        let ring = surface.ring(v).as_slice().iter().copied();
        let near = ring.filter(|&w| surface.position(w).distance_squared(centre) < reach * reach);
        pending.extend(near.filter(|&w| seen.insert(w)));
    }
}
