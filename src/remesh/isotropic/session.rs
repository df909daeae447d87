//! The state of a remeshing run: for each vertex, an anchor on the input surface and the deviation from it, which edits
//! must keep small.

use super::closest_point::{ClosestPoint, closest_point};
use super::fan::Fan;
use crate::math::Vec3;
use crate::mesh::{EditError, Mesh, VertexId};
use crate::remesh::EditPolicy;

/// The largest deviation from the input surface that collapses and moves may accumulate at a vertex, as a fraction of
/// the target edge. Higher values shorten thin parts and blunt sharp edges; with lower ones, edges on rough surfaces
/// stay out of bounds.
const MAX_DEVIATION: f32 = 0.25;
/// The largest distance between the old and the new edge of a flip, as a fraction of the target edge, so that flips
/// keep the shape.
const FLIP_DEPTH: f32 = 0.15;

/// State of a remeshing run, and the [`EditPolicy`] that keeps the mesh close to the input surface.
pub(super) struct Session<'a, E> {
    /// The input surface of remeshing.
    pub surface: &'a Mesh,
    /// Unit vertex normals of the input surface, by its slots.
    normals: Vec<Vec3>,
    /// For each vertex of the remeshed mesh, by its slots: a nearby vertex of the input surface, where walks to closest
    /// points start.
    anchors: Vec<VertexId>,
    /// For each vertex of the input surface, by its slots: whether edits other than splits are allowed near it.
    free: Vec<bool>,
    /// For each vertex of the remeshed mesh, by its slots: an upper bound of its deviation from the input surface.
    deviation: Vec<f32>,
    /// The deviation from the input surface at the remaining vertex after the last collapse passed to `may_collapse`;
    /// stored once the collapse is made.
    pending_deviation: f32,
    target_edge: f32,
    edits: E,
}

impl<'a, E: EditPolicy> Session<'a, E> {
    /// Starts a run on a copy of `surface`, to be remeshed to edges of about `target_edge`; only vertices near the
    /// `free` ones of the input surface are moved, collapsed or flipped.
    pub fn new(surface: &'a Mesh, target_edge: f32, free: Vec<bool>, edits: E) -> Self {
        let slots = surface.slots();
        let anchors = (0..slots).map(VertexId::from_index).collect();
        let normals = surface.unit_normals();
        Self {
            surface,
            normals,
            free,
            anchors,
            deviation: vec![0.0; slots],
            pending_deviation: 0.0,
            target_edge,
            edits,
        }
    }

    /// Continues this run with another edit policy and other free vertices of the input surface.
    pub fn with<F>(self, free: Vec<bool>, edits: F) -> Session<'a, F> {
        let Self { surface, normals, anchors, deviation, pending_deviation, target_edge, .. } = self;
        Session { surface, normals, free, anchors, deviation, pending_deviation, target_edge, edits }
    }

    /// Returns the anchor of `v`: a nearby vertex of the input surface, where walks to closest points start.
    pub fn anchor(&self, v: VertexId) -> VertexId {
        self.anchors[v.index()]
    }

    /// Returns whether `v` is in a region where vertices may be moved, collapsed and flipped.
    pub fn is_free(&self, v: VertexId) -> bool {
        self.free[self.anchors[v.index()].index()]
    }

    /// Returns the edge length at which remeshing aims, in units of the mesh.
    pub fn target_edge(&self) -> f32 {
        self.target_edge
    }

    /// Returns the point of the input surface closest to `p`, found by a walk from the anchor of `v`.
    pub fn closest_point(&self, v: VertexId, p: Vec3) -> ClosestPoint {
        closest_point(self.surface, self.anchors[v.index()], p)
    }

    /// Returns whether a triangle of the remeshed mesh with these corners and this normal faces out of the input
    /// surface: the normal is within 90° of that of the input surface near at least one corner.
    pub fn faces_outwards(&self, corners: [VertexId; 3], normal: Vec3) -> bool {
        let [u, v, w] = corners.map(|corner| self.normals[self.anchors[corner.index()].index()]);
        normal.dot(u) > 0.0 || normal.dot(v) > 0.0 || normal.dot(w) > 0.0
    }

    /// Moves `v` to a point of the input surface and stores `deviation`, its accumulated deviation after the move, if
    /// the edit policy allows the move; returns whether `v` was moved.
    pub fn move_to(&mut self, mesh: &mut Mesh, v: VertexId, closest: ClosestPoint, deviation: f32) -> bool {
        let moved = self.edits.attempt(mesh, |mesh| {
            mesh.set_position(v, closest.point);
            Ok(())
        });
        if moved.is_ok() {
            self.anchors[v.index()] = closest.anchor;
            self.deviation[v.index()] = deviation;
        }
        moved.is_ok()
    }

    /// Returns the distance of the vertex `removed` from the surface that remains after its collapse into `kept`, or an
    /// upper bound of it; `None` if a triangle would not face out of the input surface.
    fn gap_without(&self, mesh: &Mesh, kept: VertexId, removed: VertexId) -> Option<f32> {
        let mut fan = Fan::new(mesh.position(removed), mesh.position(kept));
        for (a, b) in mesh.ring(removed).pairs().filter(|&(a, b)| a != kept && b != kept) {
            if !self.faces_outwards([kept, a, b], fan.push(mesh.position(a), mesh.position(b))) {
                return None;
            }
        }
        Some(fan.gap())
    }

    /// Returns the accumulated deviation of `v` from the input surface, increased by `gap`; `None` if it exceeds
    /// [`MAX_DEVIATION`].
    pub fn deviation_after(&self, v: VertexId, gap: f32) -> Option<f32> {
        let deviation = self.deviation[v.index()] + gap;
        (deviation <= MAX_DEVIATION * self.target_edge).then_some(deviation)
    }

    /// Renumbers the mesh so that vertices near each other on its surface are near in memory, and the arrays of the
    /// session that are indexed by its slots with it.
    pub fn reorder(&mut self, mesh: &mut Mesh) {
        let new_ids = mesh.reorder();
        let (mut anchors, mut deviation) = (vec![VertexId(0); mesh.slots()], vec![0.0; mesh.slots()]);
        for (old, new) in new_ids.iter().enumerate() {
            if let Some(new) = new {
                anchors[new.index()] = self.anchors[old];
                deviation[new.index()] = self.deviation[old];
            }
        }
        (self.anchors, self.deviation) = (anchors, deviation);
    }
}

impl<E: EditPolicy> EditPolicy for Session<'_, E> {
    fn attempt<T>(
        &mut self,
        mesh: &mut Mesh,
        edit: impl FnOnce(&mut Mesh) -> Result<T, EditError>,
    ) -> Result<T, EditError> {
        self.edits.attempt(mesh, edit)
    }

    fn effort(&self) -> u64 {
        self.edits.effort()
    }

    fn may_collapse(&mut self, mesh: &Mesh, kept: VertexId, removed: VertexId) -> bool {
        if !self.is_free(kept) || !self.is_free(removed) {
            return false;
        }
        let Some(gap_without) = self.gap_without(mesh, kept, removed) else { return false };
        let Some(deviation) = self.deviation_after(removed, gap_without) else { return false };
        self.pending_deviation = deviation.max(self.deviation[kept.index()]);
        true
    }

    fn may_flip(&mut self, mesh: &Mesh, ends: [VertexId; 2], across: [VertexId; 2]) -> bool {
        let [[p, q], [a, b]] = [ends, across].map(|pair| pair.map(|v| mesh.position(v)));
        let between = (q - p).cross(b - a);
        let depth = between.dot(a - p);
        let most = FLIP_DEPTH * self.target_edge;
        [ends, across].as_flattened().iter().all(|&v| self.is_free(v))
            && depth * depth <= most * most * between.length_squared()
            && self.faces_outwards([ends[0], across[1], across[0]], (b - p).cross(a - p))
            && self.faces_outwards([ends[1], across[0], across[1]], (a - q).cross(b - q))
    }

    fn collapsed(&mut self, kept: VertexId) {
        self.deviation[kept.index()] = self.pending_deviation;
    }

    fn was_split(&mut self, new: VertexId, u: VertexId) {
        if new.index() >= self.anchors.len() {
            self.anchors.resize(new.index() + 1, VertexId(0));
            self.deviation.resize(new.index() + 1, 0.0);
        }
        self.anchors[new.index()] = self.anchors[u.index()];
        self.deviation[new.index()] = self.deviation[u.index()];
    }
}
