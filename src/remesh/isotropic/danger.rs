//! The places of the surface as it was where edits that do not look made something cross.

use crate::math::Vec3;
use crate::mesh::{Mesh, VertexId, crossing_pairs};
use std::collections::BTreeSet;

/// How far from what crosses the surface is left as it was, in the aim. With less, what is done beside it crosses in the
/// next run; with more, more edits have to look.
const REACH: f32 = 3.0;

/// Some vertices of the surface as it was.
pub(super) struct Danger<'a> {
    surface: &'a Mesh,
    marked: Vec<bool>,
}

impl<'a> Danger<'a> {
    /// None of the vertices of `surface`.
    pub fn new(surface: &'a Mesh) -> Self {
        Self { surface, marked: vec![false; surface.slots()] }
    }

    pub fn is_nowhere(&self) -> bool {
        !self.marked.contains(&true)
    }

    /// By slot, all others.
    pub fn elsewhere(&self) -> Vec<bool> {
        self.marked.iter().map(|marked| !marked).collect()
    }

    /// By slot, these and what is connected with them within `reach`.
    pub fn and_around(&self, reach: f32) -> Vec<bool> {
        let mut wider = self.marked.clone();
        let is_marked = |v: VertexId| self.marked[v.index()];
        for v in self.surface.vertices().filter(|&v| is_marked(v)) {
            if !self.surface.ring(v).as_slice().iter().all(|&w| is_marked(w)) {
                mark_around(self.surface, v, self.surface.position(v), reach, &mut wider);
            }
        }
        wider
    }

    /// Adds what is near triangles of `mesh` that cross another; `home` names a vertex of the surface that is near.
    pub fn add_crossings(&mut self, mesh: &Mesh, aim: f32, home: impl Fn(VertexId) -> VertexId) {
        for v in crossing_corners(mesh) {
            mark_around(self.surface, home(v), mesh.position(v), REACH * aim, &mut self.marked);
        }
    }
}

/// The corners of all triangles that cross another.
fn crossing_corners(mesh: &Mesh) -> BTreeSet<VertexId> {
    let triangles = mesh.to_triangles();
    // Both are in the order of the slots.
    let names: Vec<VertexId> = mesh.vertices().collect();
    let pairs = crossing_pairs(&triangles);
    let corners = pairs.iter().flatten().flat_map(|&t| triangles.triangles[t as usize]);
    corners.map(|v| names[v as usize]).collect()
}

/// Marks `seed`, and what is connected with it through vertices within `reach` of `centre`.
fn mark_around(surface: &Mesh, seed: VertexId, centre: Vec3, reach: f32, marked: &mut [bool]) {
    let mut waiting = vec![seed];
    let mut seen = BTreeSet::from([seed]);
    while let Some(v) = waiting.pop() {
        marked[v.index()] = true;
        let ring = surface.ring(v).as_slice().iter().copied();
        let near = ring.filter(|&w| surface.position(w).distance_squared(centre) < reach * reach);
        waiting.extend(near.filter(|&w| seen.insert(w)));
    }
}
